"""Monte Carlo rendering: reference quality, the energy ledger and the search for four-reflection ghosts.

Modules:

- `estimator`: `render_reference`: trace batches until a target error is reached; `ReferenceRun`: resume and limits
- `ray_generation`: `reference_rays`: start the rays of each light at the light or at the sensor
- `batches`: `ray_source`, `run_batch`, `Sums`, `batches_in_order`: numbered batches of random rays
- `camera_rays`: `camera_source`, `run_camera`: rays from the sensor to area lights
- `shot_arrays`: a shot as the kernels of random rays read it
- `energy_ledger`: `ledger_of`, `trace_ledger`: where the light that entered the lens ends
- `four_reflections`: `find_four_reflections`, `find_four_reflections_unbounded`: the bright four-reflection paths
- `search_sums`: `SearchSums`: what that search has found after its batches so far
- `kept_search`: `search_kept`: that search for a picture that keeps its finished part
"""
