"""Commands `flarewright render`, `flarewright shot`, `flarewright sources` and `flarewright ghosts`.

- `command`: `render`, and the files written
- `options`: the options of `render`, a record for each section of the help page
- `project_flags`: `build_project` converts options to a project
- `look_flags`: `--look`, and photographic defaults of library lenses
- `framing`: `--sensor NAME`, `--crop` and `--overscan`
- `tracks`: `--light-px` and `--track`, lights whose places are given in pixels
- `sun_light`: `--sun`, the sun at a place and time
- `art_flags`: options for overrides: `--rule`, `--solo`, `--mute`, `--gain`, `--physical`
- `profile_table`: `--profile`, the table of what each ghost costs
- `preview`: the PNG: options, exposure, file
- `nuke_command`: `flarewright nuke-script`
- `shot_command`: `shot`, the frames of a moving project
- `plate_flags`: `plate_settings` converts the options of a plate
- `film_command`: `film`, a film of finished frames
- `sources_command`: `sources`, the lights found in a plate
- `ghosts_command`: `ghosts`, the ghost analysis of a lens
- `kept_glare`: `kept_glare`, the veiling glare index of a command that resumes
- `ghost_sweep`: its `--sweep` over fields, wavelengths and f-numbers
"""
