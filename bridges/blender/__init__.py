"""Flarewright in Blender: the lens flare of a scene's lights, frame by frame, added to its render.

An extension for Blender 4.2 and later. It writes camera and lights as JSON, runs `flarewright shot` as a separate
program, and puts the frames into the compositor. Only `scene`, `compositor` and `panels` use Blender.

- `errors`: `FlareError`, what a user sees
- `vectors`: three numbers
- `camera`: `CameraView`, `drawn_window`: the picture of a camera
- `light`: `lamp_samples`, `mesh_samples`: irradiance at the camera
- `document`: `scene_data`, the file; names of files
- `program`: `shot_command`, `Running`: the separate program
- `job`: `Job`, work in small steps
- `scene`: `read_scene`, camera and lights of all frames
- `compositor`: `put_into_compositor`
- `panels`: settings, commands, panels

Copyright (c) 2026 The Flarewright developers. MIT license.
"""

bl_info = {
    "name": "Flarewright",
    "author": "The Flarewright developers",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "Properties > Render > Flarewright",
    "description": "Lens flare of a real lens, from the lights of the scene",
    "category": "Render",
}


def register() -> None:
    """Add everything to Blender."""
    from . import panels

    panels.register()


def unregister() -> None:
    """Remove everything from Blender, and end what runs."""
    from . import panels

    panels.unregister()
