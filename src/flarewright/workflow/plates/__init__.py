"""Shots over plates.

- `plate_sources`: `plate_shot` finds and follows the lights of a plate; `PlateShot`
- `plate_frame`: `with_plate_lights`, a frame's project over a plate; `write_comp`
"""
