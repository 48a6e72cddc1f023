"""Thin-film coatings.

- `presets`: `standard_films`, standard coatings of four eras
- `response`: `coating_response`, reflectance and colour of a coated surface
- `thin_film`: `film_stack`, `stack_reflectance`, `reflectance_table`, characteristic matrices
"""
