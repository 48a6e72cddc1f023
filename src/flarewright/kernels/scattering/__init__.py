"""Single scattering at surfaces, and veiling glare.

- `single_scatter`: `gather_scatter`, irradiance on the sensor; `scattered_total`, share of a surface; `spread_polar`,
  interpolation to a picture
- `glare`: `light_from_surround`, light of a uniform surround along one path
"""
