"""Commands `flarewright lens ...`, `lenses` and `coating ...`.

- `lenses`: `lenses`, the shipped lenses
- `cameras`: `cameras`, the cameras of `--sensor`
- `show`: `lens show`, a prescription as a table, JSON or a drawing
- `check`: `lens check`
- `convert`: `lens convert`
- `schema`: `lens schema`
- `coating_list`: `coating list`
- `coating_plot`: `coating plot`
"""
