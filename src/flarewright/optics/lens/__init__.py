"""First-order and geometric properties of lenses.

- `dispersion`: `refractive_index`
- `field_angles`: `constellation_and_roll`, `field_angles`, `brightness_scale`, position of a light
- `paraxial`: `first_order`, `flare_matrices`, `path_matrices`, ray transfer matrices
- `paths`: `LightPath`, `ghost_paths`, `direct_path`, light paths as steps over rows
- `plane_plates`: `with_filter`, `with_cover_glass`
- `surface_shape`: `sag`, `shape_table`, `has_rotational_symmetry`, shape and pose of rows
- `tolerances`: `imperfect`, `ghost_offset`, samples within tolerances
- `zernike`: `zernike_polynomial`, `figure_polynomial`
- `zoom`: `positioned`, `at_position`, zoom and focus
"""
