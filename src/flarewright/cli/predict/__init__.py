"""The command `flarewright predict`.

- `command`: `predict`, curves of a lens or a measured flare
- `options`: the options of `predict`, a record for each section of the help page
- `scene`: all lights in all cameras of a scene file
"""
