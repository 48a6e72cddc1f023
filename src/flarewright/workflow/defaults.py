"""Default sizes of `flarewright predict`."""

SHOWN_PX = 240
"""Width in pixels of a flare that is drawn for viewing."""

SIDE_PX = 192
"""Width in pixels of a measured flare that is drawn for statistics."""

WIDTH_MM = 36.0
"""Width of a sensor of unknown size."""
