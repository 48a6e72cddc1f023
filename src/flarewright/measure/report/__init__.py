"""The HTML report of a measurement.

- `page`: `write_report` writes the report; `strange` checks that a model belongs to a run
- `overview`: `write_overview` writes one picture of all frames; `frame_of`, `in_rec709`
- `frames`: sections with frames, the outlines of ghosts, and replays with their differences; `usual_light`
- `ghosts`: section about the path and the light of each ghost; `paths_of`
- `curves`: section about the model's parameters over the constellation
- `tables`: `numbers_table` lists all parameters of one ghost
- `tracks`: section about births, deaths and the factors of each frame
"""
