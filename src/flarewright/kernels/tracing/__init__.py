"""Ray tracing through a lens: intersection, refraction, bundles on an adaptive grid, clipping.

Python calls `trace_nodes` and `trace_hits` (`sequential`), `find_box` (`pupil_prepass`), `build_mesh`
(`adaptive_grid`), and the functions of `representative_rays` and `iris_edge`.

- `intersect`: intersection with conics, spheres and sags; columns of the shape table; `sag_of_shape`
- `refract`: refraction and reflection; constants of steps and of traced nodes; rays of near lights
- `lens_arrays`, `path_steps`, `incident_light`: named tuples that the kernels take: `ConicLens` and `ShapedLens`,
  `PathSteps`, `IncidentLight`
- `sequential`: one path at one wavelength: `trace_nodes`, `trace_hits`, for kernels `trace_lanes`
- `general_lanes`: the same in lanes for surfaces of any shape and position
- `general_ray`: one ray through surfaces of any shape and position
- `pupil_prepass`: `find_box`, bounds of the accepted part of the pupil
- `gap_search`: `search_gaps`, `search_axis`: light between the rays of the pre-pass
- `ray_failures`: `passes`, `failure`, `rejected`: which rays pass, and how others fail
- `samples`: `Samples`, the rays of the pre-pass
- `grid_limits`: `GridLimits`, how far the adaptive grid is refined
- `adaptive_grid`: `build_mesh`, a traced and triangulated quadtree over that part
- `cell_neighbours`: light of its leaves that enters cells beside them: `halve_neighbours`, `has_lit_side`
- `ray_interpolation`: `rays_between`, `visible_areas`, rays at other wavelengths
- `torn_triangles`: `cut_torn`, the parts that pass of triangles in which some rays fail
- `representative_rays`: `seen_rays`, `choose_seen`, `choose_representatives`, `shift_quantile`
- `iris_edge`: where light reaches the iris edge: `reached_edges`, `bounded_by_iris`, `widen_box`, `widen_stops`,
  `largest_part`
- `clip`: clips triangles and polygons by rims, blades and the picture
"""
