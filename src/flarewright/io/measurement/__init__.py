"""Files of measurements: lists of captures, merged runs and ghost models.

- `captures`: `read_captures`, `read_camera`, `parse_rule`
- `ghost_model_file`: `read_ghost_model`, `write_ghost_model`; tracks, corrections, replay cameras
- `merged`: `read_run`, `write_run`, `read_frame`, `write_frame`
"""
