"""The options of `flarewright predict`, a record for each section of its help page.

- `general`: what is predicted and written
- `camera`: the lens and the camera
- `curves`: the curves of a lens or a measured flare
- `scene_search`: a scene: a better camera position, and shots
- `record`: `PredictOptions`, all of them together
"""
