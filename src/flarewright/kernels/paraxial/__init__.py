"""Paraxial ghosts by ray transfer matrices.

- `ghosts`: `path_matrices`; `draw_matrix_ghosts` and `measure_matrix_ghosts` for many paths
- `arguments`: named tuples that these take: `PathList`, `MeridianLens`, `EntranceLight`, `StopOutline`, `SensorFrame`
- `iris_images`: `close_ring`, `cut_ring`, the entrance cut by the images of the iris
- `path_reflectance`: `path_throughput`, `ray_throughput`, `throughput_between`, spectral throughput of paths
"""
