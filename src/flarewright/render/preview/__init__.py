"""Fast pictures for the editor.

Modules:

- `drag_preview`: `moving_picture`: the picture while the user drags a light
- `diagnostic_views`: `working_ghosts`: ghosts without coatings or without the edge of the first surface
"""
