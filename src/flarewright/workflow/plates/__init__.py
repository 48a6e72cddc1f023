"""Shots over plates.

- `plate_files`: `plate_picture` and `plate_frames`, the pictures of a sequence or a film; `backplate_picture`
- `plate_sources`: `plate_shot` finds and follows the lights of a plate; `PlateShot`
- `kept_sources`: `read_sources`, `write_sources`, the file from which an interrupted search resumes
- `found_lights`: the lights of a single plate as lights of a project, and what keeps them in place
- `plate_frame`: `with_plate_lights`, a frame's project over a plate; `write_comp`
"""
