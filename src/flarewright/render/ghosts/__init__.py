"""The ghost pass, in draft quality (paraxial matrices) and final quality (traced ray bundles).

`ghost_pass` calls `draft_ghosts` or `final_ghosts`, which distribute paths over threads, call the drawing code for each
path and light, and add the pictures in a fixed order.

Modules:

- `ghost_pass`: `render_ghosts`: the entry point
- `draft_ghosts`: `draw_drafts`: all ghosts of a picture in draft quality
- `final_ghosts`: `draw_finals`, `plain_level`: all ghosts of a picture in final quality
- `ghost_sums`: `GhostWork`, `GhostPass`, `sum_ghosts`: what both share; pictures are added in a fixed order
- `final_pass`: `FinalPass`, one path of one light, ready to be drawn
- `pupil_search`: `ghost_search`: search the accepted pupil of every path and light
- `traced_ghosts`: `find_final`, `draw_final`, `draw_alone`: ghosts in final quality
- `paraxial_ghosts`: `draw_draft` and others: ghosts in draft quality
- `draft_colors`: `draft_colors`: their colours
- `draft_spread`: `draft_alone`, `mark_spread`: those that are spread, ramped or blurred
- `matrix_flux`: `matrix_fluxes`, `weigh_drafts`: their light, without drawing them
- `steep_ghosts`: correct colours of ghosts whose throughput changes fast with wavelength
- `wavelength_subset`: `gathered_weights`: draw faint ghosts at few wavelengths
- `diffraction_rings`: `ringing_for`, `Rings`: diffraction patterns of the iris inside ghosts
- `ring_tables`: patterns from tables of straight edges and corners
- `ring_flux`: `ring_flux`: the factor that keeps the flux of a ghost with rings
- `ring_visibility`: `ripples_seen`: whether rings are visible
- `background_level`: `surroundings`: coarse picture of the light around each ghost
- `visible_stop`: `seen_in_stop`: the part of the stop that a picture shows
- `cost`: `CostMeter`, `GhostCost`: time and work of each ghost, for `render --profile`
- `extent_blur`: `blur_by_extent`, `spread_window`, `shape_kernel`: convolution with the shape of a light or of a
  defocused aperture
- `art_filters`: `filtered_ghost`: colour ramps and blurs of art direction
"""
