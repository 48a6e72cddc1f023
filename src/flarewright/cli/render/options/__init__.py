"""The options of `flarewright render` and `flarewright shot`, a record for each section of their help pages.

- `light`: the lights, and what hides them
- `place`: lights in pixels, tracks, the sun
- `plate`: a plate, and which areas of it are lights
- `lens`: the lens: aperture, iris, coating, scatter, zoom, filters
- `camera`: the sensor and the picture
- `quality`: how the picture is computed
- `art`: overrides of the artist
- `layers`: which layers are written, and in what form
- `output`: where the picture is written, and how the PNG shows it
- `reference`: reference quality: errors, samples, time
- `starburst`: dirt in the pupil and its effect on the starburst
- `inputs`: what is rendered: a lens or a measured flare, a project, a look
- `shot`: `ShotOptions`, all of `flarewright shot`
- `record`: `RenderOptions`, all of them together
"""
