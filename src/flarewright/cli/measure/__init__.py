"""Commands `flarewright measure ...`: from photographs to a ghost model and its replay.

- `run`: `measure merge` and `measure run`
- `stages`: `measure find`, `fit`, `track` and `compress`
- `replay`: `measure replay`
- `report`: `measure report`
- `explain`: `measure explain`, a lens that makes the measured ghosts
"""
