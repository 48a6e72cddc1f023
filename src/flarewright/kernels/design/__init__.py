"""Lens design: paraxial ghosts with exact derivatives, cost of a prescription, local searches.

- `ghosts`: place, size and scale of all ghosts: `ghosts_of_many`, `ghosts_with_derivatives`
- `cost`: misfit to targets, cost of extra ghosts: `irradiance_of_ghosts`, for kernels `total_cost`
- `assignment`: `match`, ghosts to targets at least cost
- `vignetting`: visibility of ghosts and its derivatives
- `edge_thickness`: `edge_values`, by how much each edge is too thin; `beam_of`, the axial beam
- `local_search`: `polish_many`, Levenberg-Marquardt on ghost targets; `limit_excess`
- `picture_search`: `polish_by_picture`, damped Gauss-Newton on pictures; `draw_picture`
- `arguments`: named tuples that the searches take: `LensStructure`, `FreeVariables`, `GhostAims`, `Effort`,
  `TargetPicture`, `GeneCode`
- `fitness`: `fitness_of_genes`, `decode_many`, `sorted_misfit`, for general-purpose solvers
"""
