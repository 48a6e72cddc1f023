"""Learn the residual: the light of the frames that ghosts, star and halo do not explain, stored as sprites.

- `learn`: `with_residual` adds all sprites to a model; the entry point
- `star_spikes`: `spike_sprites` learns narrow strips along the spikes of the star
- `sprite_fit`: `light_sprites` (follow the light) and `axis_sprite` (stays about the axis), and their common fit
- `motion_fit`: `with_moves` measures the motion of the residual between images
- `fine_detail_fit`: `with_detail` adds detail finer than the cells
- `clamp_range`: `with_reaches` learns how far light moves between images, the range for clamping
"""
