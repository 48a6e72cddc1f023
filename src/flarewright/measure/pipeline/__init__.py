"""The stages of a measurement, each a function from files and models to a run, a model or tracks.

The order is merge, find, fit, track, compress; `workflow/measure_run` calls the stages and stores their results.

- `merge_stage`: `merge_captures` merges photographs to HDR frames and solves the geometry; `check_same_run`
- `find_stage`: `find_ghosts` detects the ghosts of a run and returns a rough model
- `fit_stage`: `fit_ghosts` fits the detected ghosts in all colours and at all constellations
- `track_stage`: `track_ghosts` fits each ghost in each frame; `check_size`, `checked_ghosts`
- `compress_stage`: `compress_ghosts` replaces the tracks by curves and prunes the model
- `search_images`: reduced frames with mixed colours, in which ghosts are searched; `model_of_run`, `reference_of`
- `removed_light`: views without the ghosts that the user removed (`without_removed`)
- `settings`: settings of all stages after merging (`MeasureSettings`)
- `provenance`: digests of the inputs of each stage (`run_digest`, `is_current`, `note`) and stored corrections
"""
