"""Openings and shapes: the iris, dirt in the pupil, and the shapes of lights.

- `blade_form`: `blade_form`, an iris described at one corner
- `dirt`: `generate_dirt`, `rasterise`, `scattered`, dust, scratches and fingerprints
- `iris`: `blade_edges`, `iris_outline`, `transmission`, the opening of the stop
- `light_shape`: `light_outline`, `parts`, area lights
- `mask_levels`: `mask_levels`, the resolution pyramid of an iris image
- `occlusion`: `visible_shape`, `hidden_part`, visible part of a light behind an image
- `polygon`: borders as weighted edges: `content`, `centroid`, `solid_angle`, `shape_brightness`
- `pupil_function`: `pupil_amplitude`, the sampled wave behind the pupil
"""
