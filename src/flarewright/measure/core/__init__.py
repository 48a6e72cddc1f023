"""Data and tools that every step of a measurement shares.

The modules hold merged frames as the fitter sees them, the parameters of one ghost, the conversion of a model to kernel
arrays, the journal of finished steps, and the helpers for threads and memory. This folder imports no other folder of
`measure`.

- `binning`: pictures averaged over blocks of pixels (`binned`)
- `checkpoint`: journal that lets a stopped stage resume (`journal`, `Journal`, `recorded`)
- `frame_reading`: reads the frames of a merged run (`read_views`)
- `measured_side`: the side of the axis on which a light was photographed (`measured_side`)
- `neighbourhood`: `brightest`, `darkest` values of square neighbourhoods
- `parallel`: work shared among threads (`map_batched`, `done_by`, `dealt_out`, `run_concurrently`)
- `parameter_vector`: ghosts of a model as the arrays that kernels take, and back (`channel_numbers`, `channel_of`,
  `bezier_numbers`, `field`, `frame`, `frame_in`, `visible`)
- `parameters`: one colour of one ghost during a fit, and its free parameters (`Shape`, `free_numbers`, `stepped`)
- `pose_curves`: brightness, shift and size of a ghost over the constellation (`Pose`, `posed`, `pose_at`)
- `rim_kinds`: outlines that a ghost can have (`rims_of`)
- `robust`: spread of values with outliers (`MAD_TO_SIGMA`)
- `sampling`: evenly spaced items of a sequence (`evenly_spaced`)
- `scratch`: working memory of a thread that is used again (`ScratchBuffer`)
- `views`: one merged frame with its noise and the position of the light (`View`, `views_of`, `halved_view`,
  `halved_pixels`)
"""
