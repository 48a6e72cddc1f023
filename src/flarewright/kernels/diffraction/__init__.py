"""Diffraction on pixels: starbursts, their wings, rings of ghosts, Fresnel propagation.

- `fresnel`: `sum_turns` and `turn_frequencies`, phase factors of a band of wavelengths
- `resample`: starburst core `deposit_core`; wings `blend_fan_wings` and `blend_blade_wings`
- `wings`: wings of many starbursts: `add_coarse_wings`, `add_sharp_wings`, `add_moved`
- `ringing`: `draw_ringing`, a bundle multiplied by patterns in the stop plane
- `corner_table`: `average_corner`, a table averaged over a band of colours and over a pixel
- `image_lines`: `sum_lines`, an image resampled along one axis
- `fast_power`: `raise_lanes`, vectorised powers
"""
