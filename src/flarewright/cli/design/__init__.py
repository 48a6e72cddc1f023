"""Commands `flarewright design ...`: search lenses and coatings for target ghosts.

- `solve`: `design solve` and `design resume`; `search` is shared with `scratch` and `measure explain`
- `scratch`: `design scratch`, without a start lens
- `target`: `design target`, a project with the ghosts of a picture as targets
- `colors`: `design colors`, coatings for ghost colours
- `edit`: `design resize` and `design move-stop`
- `identify`: `design identify`, what ghosts determine of a lens
- `benchmark`: `design benchmark`, the tests of the thesis
- `options`: options that several commands of searches share
- `checks`: checks of options that several design commands share
"""
