"""Plates: photographs and rendered pictures whose light sources drive the flare, and comps of both.

- `settings`: `PlateSettings`, what a user says about a plate; `parse_source`
- `detection`: `find_sources`, connected areas above a threshold as `Sources`
- `tracking`: `follow` matches sources of neighbouring frames, `steady` keeps them from flickering at the threshold
- `joining`: `joined` limits the number of lights and keeps their sum
- `field_map`: `field_map`, directions and solid angles of pixels through the traced lens
- `lights`: `lights_at`, lights of the renderer; `plate_factor`, the plate value of an irradiance on the sensor
- `measured_plate`: `measured_pixels`, primaries and expanded highlights
- `comp`: `composed` adds the flare to a plate
- `marked`: `marked_plate`, a picture of the found sources
"""
