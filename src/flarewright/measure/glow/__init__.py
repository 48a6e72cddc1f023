"""Measures and subtracts the glow around the light source: its halo and its star.

The glow moves with the light, so a low quantile over views that are registered by the light separates it from ghosts.

- `fit`: fits halo and star and their strength over the constellation (`register`, `fit_halo`, `fit_star`, `followed`,
  `iris_of`)
- `laws`: radiance of halo and star at offsets from the light (`halo_at`, `star_at`)
- `rejection`: detected ghosts that are residual glow (`is_residual_glow`, `with_glow_unwanted`,
  `with_glow_among_removed`)
- `settings`: settings of fit, subtraction and rejection (`GlowSettings`)
- `subtraction`: views without the glow, and the masks of the ghost search (`fit_and_subtract_glow`, `subtract_glow`,
  `masks_of`)
"""
