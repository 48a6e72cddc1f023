"""Pictures: canvases, layers, colour and display.

Modules:

- `canvas`: `Canvas`, `merge`, `to_layer`, `lit_window`: planes of flux at several resolutions
- `sheet`: `Sheet`: memory on which ghosts are drawn apart from the picture
- `partial_picture`: `PartialPicture`, `KeptSteps`: canvases in files, from which an interrupted render resumes
- `compose`: `beauty`, `add_layer`: the sum of layers
- `ghost_ranking`: `GhostRanking`, `ghost_matte`: the brightest ghosts of each pixel
- `shown_layer`: `ShownLayer`: a layer that can show itself in a notebook
- `gamut`: `apply_gamut`, `compressed`: colours outside the primaries of a file
- `photographic_exposure`: `photographic_stops`: exposure from shutter, f-number and ISO
- `display`: `view`, `auto_exposure`: from linear light to 8-bit sRGB
- `aces_view`: `aces_pixels`: the ACES view through opencolorio
- `ocio_space`: `check_file_space`, `in_file_space`: colour spaces of OpenColorIO for files
- `cache`: `Kept` (a cache by key) and `BufferPool` (arrays joined in one block)
"""
