"""The model of measured ghosts: drawing, derivatives, normal equations, and search.

A ghost is a polynomial map of its pupil to the sensor (`pupil_mesh`), or Walch's Bezier shape (`bezier`). Pictures are
stored as differences along rows until `sum_along_rows` sums them.

Drawing:

- `pupil_mesh`: parameters of a ghost, points of its pupil and their places on the sensor
- `pupil_polygon`: a regular polygon as the iris of the pupil
- `ghost_mesh`: mesh and cells of a ghost: `window_of`, `parting_of`
- `edge_coverage`: exact coverage edge by edge: `sum_along_rows`, `sum_changes_along_rows`, `sum_into`
- `gaussian_edges`: blur by the discrete Gaussian
- `lateral_colour`: rims at several wavelengths of a channel
- `draw`: `draw_ghosts`, all ghosts of a channel for a replay
- `jacobian`: `draw_with_changes`, a ghost with its derivatives
- `pupil_centre`: `fill_middles`, place, size and radiance at the pupil's centre
- `bezier`: Walch's ghosts: `draw_beziers`, `bezier_window`
- `bezier_distance`: signed distance from a Bezier border
- `glow`: `halo_light`, `star_light` around a light

Fitting and search:

- `residuals`: `weigh_misfit`, residuals and weights of a picture
- `normal_equations`: normal equations of one ghost
- `patches`: one ghost in many patches: `miss_patches`, `weigh_changes`, `weigh_presence`
- `frame_equations`: brightness, place and size of all ghosts of a view: `windows_together`, `draw_together`,
  `add_together`
- `joint_equations`: `add_jointly`, all parameters of all ghosts of a view
- `hough`: search for rims: `rim_outline_points`, `salient_slopes`, `search`
- `strip_means`: `means_along`, means under sliding masks
- `box_means`: `box_means`, means over squares
- `cubic_sampling`: `cubic_samples`, cubic convolution
- `block_matching`: motion of blocks: `block_misfits`, `block_structure`, `refine_blocks`
- `motion_smoothness`: agreement of neighbouring blocks: `move_costs`, `agree`
"""
