"""The web server of the editor.

Public entry points: `launch.open_editor`, `app.serve`, `app.make_app`, `workspace.Workspace`.

- `launch`: `open_editor` joins session, access and server
- `app`: routes, request handlers, and `serve`
- `workspace`: `Workspace` joins session, screen, solver and browser tabs
- `access`: `Access`, and `Guard`, which checks origin and token of requests
- `thumbnails`: `ThumbnailMaker` renders thumbnails of the user's lenses in a child process
- `tokens`: the token: chosen, or random and kept
- `turns`: `Turns` runs the work of requests on a few threads, with a bounded queue
- `drag_socket`: requests of a drag through a socket (`follow`)
- `messages`: JSON objects of requests and sockets, of bounded depth; why a request failed
- `page_state`: the state of the session as JSON for the page
- `uploads`: dropped and chosen files
"""
