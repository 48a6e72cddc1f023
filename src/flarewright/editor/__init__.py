"""The browser editor: a local web server, the page, and a session with undo and autosave.

State is a project of `model`, pictures come from `render`, solutions from `design`.

- `server`: the web server, access control, uploads, and the page's state as JSON
- `session`: the open project: history, files, autosave, view settings
- `commands`: all changes that the page can make to a project
- `preview`: pictures for the viewport, from drag drafts to final pictures; diagrams
- `design`: lens and coating searches in the background
- `common`: background threads, and wording of error messages
- `static`: the page: HTML, CSS and JavaScript
"""
