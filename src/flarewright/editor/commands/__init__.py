"""Commands: functions from a project and values of the page to a new project.

Public entry points: `registry.COMMANDS` and `registry.done`, which checks and runs a command by its name.

- `registry`: all commands by name, with labels for the history
- `shot`: light, camera, iris, dirt, coating, quality
- `light_path`: keyframes of a light's path
- `plate`: the plate under the flare
- `ghosts`: solo, mute, gain and tint of single ghosts
- `ghost_rules`: what all rules together make of each ghost
- `design_targets`: ghost targets of the project's design
- `lens`: the prescription: cells, another lens; `prescription` returns the table
- `lens_rows`: its rows: added, copied and removed ones, and the place of the stop
- `row_numbers`: what refers to rows by their numbers, after rows are added, removed or moved
- `lens_notes`: remarks on cells of the prescription
"""
