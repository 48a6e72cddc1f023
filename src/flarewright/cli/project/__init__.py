"""Commands `flarewright project ...` and `scene ...`.

- `init`: `project init`
- `check`: `project check`
- `schema`: `project schema`
- `scene_init`: `scene init`
- `scene_check`: `scene check`
- `scene_schema`: `scene schema`
"""
