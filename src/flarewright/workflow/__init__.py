"""Whole tasks as library calls: measure a camera, search lenses, predict flare, open all files of a project.

The command line and other front ends call these functions; nothing here prints.

- `measure_run`: `run_stages` runs the stages of a measurement in a run's folder (`StageResult`)
- `measure_merge`: `merge_photographs` merges a list of photographs, on this machine or on a cluster
- `measure_provenance`: `STAGES`; records from which model the file of a later stage was made
- `searches`: `search_lenses` searches lenses for a project's targets, `search_in_folder` writes them and resumes
- `flare_curves`: `flare_curves` predicts a lens' flare over the constellation
- `lens_flares`: `lens_flares`, `scene_flare` and `camera_project` build the flares that a prediction needs
- `flare_pictures`: `pictures_elsewhere`, processes or a cluster that draw the pictures of predictions
- `ghost_sweep`: `sweep_ghosts` analyses ghosts over fields, wavelengths and f-numbers, `surface_gains` ranks surfaces
- `lens_export`: `export_lens` writes a lens in the formats of other programs
- `own_library`: the user's library of lenses: `add_lenses`, `own_library`, `remove_lens`, `make_thumbnails`
- `measured_flares`: `model_flares` builds them from a measured model
- `measured_camera`: `model_in_scene` does so for a camera of a scene; `model_errors` finds its errors
- `project_files`: `open_project_files` opens all files of a project and collects the errors
- `scene_prediction`: `predict_scene` predicts all lights in all cameras of a scene, ranked, with shots
- `scene_check`: `camera_errors` and `light_errors` find the errors of a scene
- `keyframes`: `project_at`, a project with the values of its keyframes and curves at a time
- `light_places`: `lights_at_pixels` and `with_tracks`, lights whose places are given in pixels
- `sun_place`: `sun_place`, where a camera sees the sun
- `plates`: shots over plates: `plate_shot` finds lights, `write_comp` writes comps
- `shot`: `shot` draws the frames of a moving project on all cores, with a `ShotResult`
- `shot_frame`: `draw_frame`, one of them, and the digest of what made it
- `films`: films of finished frames: `assemble_film`
- `nuke_script`: `nuke_script`, the text of a script or gizmo that composites a flare in Nuke
- `nuke_graph`: `flare_nodes`, `nodes_text`, its nodes and their text
- `frame_files`: `with_frame_files`, the files of one frame of sequences that hide lights
- `motion_blur`: `subframe_count` and `mean_layers`, the mean over the open shutter
- `training_pairs`: `dataset` draws training pairs for flare removal and detection
- `kept_work`: checkpoints of long jobs, and where commands without an output keep their partial work
- `long_jobs`: `JOBS` lists the commands that can run for more than a minute, and how each keeps its partial work
- `defaults`: default sizes of predictions
"""

from __future__ import annotations

from ..lazy import lazy_names

__all__, __getattr__, __dir__ = lazy_names(__name__)
