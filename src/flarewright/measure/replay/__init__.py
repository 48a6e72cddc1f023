"""Draw a measured flare from its ghost model, at any constellation, roll and picture size.

The public entry points are `replay_model` and, for projects, `render_any`.

- `model_image`: `replay_model` draws the layers of a model; `draw` its ghosts only; `light_px`, `within_reach`
- `measured_project`: `render_any`, `render_measured` and `check_measured` handle a project with a measured flare
- `light_place`: `measured_angles_at`, the field angles of a light at a pixel
- `placement`: `constellation_of_light` in a scene; `brightness_gain` at other camera settings;
  `over_clipping`
- `flare_only`: `counted_flare` draws the light that counts as flare
- `art`: `ghost_gains` applies the rules of art direction
- `light_law`: focal length and distortion from detected light positions
- `ghost_arrays`: `pack` converts ghosts to the arrays of the kernels
- `residual`: `draw_residual` draws the sprites of a model
- `sprites`: `draw_sprites`, and the interpolation between a sprite's images
- `blob_drawing`: sprites of earlier versions that follow one small, bright ghost
- `motion_warp`: moves the residual along its measured motion
- `fine_detail`: detail finer than a sprite's cells
- `clamping`: limits a replay to the range of the adjacent photographs
"""
