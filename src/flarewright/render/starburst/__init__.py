"""Starbursts: direct images of lights, spread by diffraction at the iris.

Modules:

- `starburst_pass`: `starburst_of`, the pass that draws all lights; `read_soil` reads the dirt on the pupil
- `pattern`: `starburst_layer`: the starburst of one light; `Painter` draws a pattern on any pixel grid
- `many_lights`: `draw_stars`: starbursts of many lights that share one pattern
- `bands`: `in_threads`: rows of a picture, in bands on several threads
- `translated_wings`: `add_moved_wings`: far parts of a pattern, drawn once and shifted to every light
- `spectrum_basis`: `basis_spectra`: represent many spectra as sums of few
"""
