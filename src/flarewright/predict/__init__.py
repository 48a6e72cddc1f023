"""Predict flare: statistics over the constellation, loss of contrast, and cameras and lights in a scene.

- `flare`: `Flare`, the flare of one light as a function of its position, and `Frame`
- `lens_flare`: `lens_flare` and `square_flare` build a `Flare` from a lens
- `wavelengths`: few wavelengths that give the right luminance
- `statistics`: `Statistics` of a picture's flare (`measure`)
- `pictures`: `draw_all` draws pictures that are missing, here or by other processes
- `table`: `FlareTable` draws each picture of a flare once
- `curves`: `sample_curves` samples the statistics over the constellation; `check_curves`
- `contrast`: `contrast` and `washed_share`, the loss of contrast
- `occurrence`: `predict_occurrence` predicts the flare of one camera; `occurrence_data` as JSON
- `occurrence_page`: `occurrence_page`, its HTML report
- `photometry`: illuminance by lamps; `exposure_level`, the signal of a sensor over its clipping level
- `sun`: path and illuminance of the sun; `sky_direction`
- `tracks`: positions of a scene's cameras and lights over time (`sightings`)
- `plan`: `plan_scene` predicts the flare of a scene; `ranking` sorts its pairs of camera and light, with
  the signal of each over its clipping level
- `switching`: `choose_cameras` chooses the camera with the least flare over time
- `search`: `best_position` searches a camera position with less flare
- `worst`: `render_worst` renders the worst moments
- `scene_data`: `scene_data`, the plan as JSON
- `scene_page`: `scene_page`, its HTML report
"""

from __future__ import annotations

from ..lazy import lazy_names

__all__, __getattr__, __dir__ = lazy_names(__name__)
