"""The open project of the editor: history, files, view settings and autosave.

Public entry points: `session.begin`, `session.Session`.

- `session`: `Session` holds history, view and file; `begin` starts or resumes one
- `history`: `History`, undo and redo
- `files`: open, import, save and export
- `known_files`: `KnownFiles`, project files that were opened or saved, and changes by other programs
- `autosave`: the history on disk, to resume after a crash
- `autosave_lock`: `AutosaveWriter` writes it on a thread and locks it against other editors
- `view_settings`: `View`, settings of the screen
- `measured_project`: projects of measured flares
- `plate_finder`: `PlateFinder` finds the lights of the plate on a thread
- `reach`: `Reach`, the files that the page may open and save
- `image_files`: pictures that a project reads, and messages on missing ones
- `input_notes`: messages on clamped input
"""
