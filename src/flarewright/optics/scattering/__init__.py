"""Scattered light: surfaces, dust, the sensor, and veiling glare.

- `brdf`: `scatter_tables` and the scatter functions of roughness and measured surfaces
- `dust`: `dust_density`, `particles_above`
- `internal_beams`: `trace_beams`, the direct beam inside the lens
- `mie`: `mie`, scattering by spheres
- `sensor_grating`: `grating_orders`, `order_efficiency`, the sensor as a reflection grating
- `veiling_glare`: `from_surround`, glare of a uniform surround
"""
