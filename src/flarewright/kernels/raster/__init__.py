"""Light on pixels: polygons with exact coverage, ray bundles, iris images, display codes.

- `bundle`: `draw_bundle`, `measure_bundle`, `node_densities` of a traced bundle
- `polygons`: convex polygons in blocks of pixels: `blank_plane`, `fill_polygon`, `to_pixels`, `sum_rows`
- `plane_memory`: memory of large planes and pictures in pages of their own: `black_memory`, `black_picture`,
  `unset_picture`, `black_differences`
- `iris_mask`: polygons multiplied by an iris image
- `stop_pattern`: patterns in the stop plane and their look-up, pixel by pixel: `weave`
- `spread`: `spread_taps`, convolution of a picture with a small kernel
- `edge_blur`: `spread_marks`, convolution of a picture stored as differences with a flat shape
- `pyramid`: `collect` and `add_doubled`, from blocks at several resolutions to pixels
- `display_codes`: `encode`, `encode_clipped`, `encode_sum`, `compress_gamut`: linear light to 8-bit codes
- `exposure`: `record`, noise, black level and clipping of a sensor
- `perceived_hue`: `keep_hue` of a colour that is mixed with white
"""
