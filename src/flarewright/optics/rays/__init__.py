"""Ray tracing of light paths: packed lenses, ray bundles and the ghost table.

`pack.pack_lens` makes the arrays, `pupil_region.find_region` locates the light of a path in the pupil, and
`bundle.trace_grid` traces it with an adaptive grid.

- `bundle`: `incidence`, `Refinement`, `trace_grid`, `trace_bundle`, `trace_points`
- `ghost_table`: `GhostQuery`, `pack_for_query`, `ghost_table`: flux, position and size of every path
- `image_height`: `image_heights`, distortion
- `pack`: `PackedLens`, `pack_lens`, `resolve_coatings`, `facing`
- `path_reflectance`: `coating_curves`, `path_spectra`, `spectra_of_rays`, `products_between`, coatings between the
  traced wavelengths
- `pupil_region`: `find_region`, `first_look`, `Region`
- `single_rays`: `trace_polylines`
- `steepness`: `interpolation_error`, `gap_errors`, `throughput_ratios`, throughput that changes fast with wavelength
- `torn_cells`: `cut_failed_triangles`, triangles with failed rays
"""
