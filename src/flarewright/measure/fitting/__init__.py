"""Fits ghosts to all constellations of a run.

A fit minimizes the noise-weighted squares of one ghost (`ghost_fit`) or of all ghosts at once (`joint_shapes`) by the
Levenberg-Marquardt method. `alternating_fit.fit_all` combines both until the ghosts agree.

- `alternating_fit`: fits all detected ghosts together, colour by colour, and decides whether a ghost is round or has
  the shape of the iris (`fit_all`, `to_model`)
- `amplitudes`: brightness of a ghost in each view (`presences`, `usual_amplitude`)
- `colour_prior`: prior that ties the colours of a ghost (`ties`, `expectation`)
- `detected_ghost`: a detected ghost, and pictures with ghosts added or subtracted (`DetectedGhost`, `isolated_views`,
  `residual_of`)
- `footprint`: area that a shape covers, and the overlap of two shapes (`footprint`, `overlap`)
- `ghost_fit`: fit of one ghost (`refine`, `Fit`, `improve`, `render`)
- `joint_intensities`: linear solution for the brightness of all ghosts (`solve_intensities`)
- `joint_shapes`: fit of the shapes of all ghosts at once (`fit_shapes_jointly`)
- `levenberg_marquardt`: the minimizer that all fits share (`minimize`)
- `lifetimes`: range of views in which a ghost is visible (`visible_range`, `update_ranges`)
- `model_growth`: frees parameters, and adds discs that cut the pupil, while the cost falls enough (`grow`)
- `normal_equations`: solves normal equations that may be singular (`solution`, `inverse`)
- `patches`: windows of the views around one ghost, and the residuals there (`patches_of`, `residual_in`, `equations`)
- `restart`: refits all detected ghosts from plain shapes (`restart_jointly`)
- `settings`: settings of all fits (`FitSettings`, `Growth`)
"""
