"""Sizes that `flarewright predict` takes where nothing is said."""

SHOWN_PX = 240
"""Pixels across a flare that is drawn to be looked at."""

SIDE_PX = 192
"""Pixels across a measured flare that is drawn for statistics."""

WIDTH_MM = 36.0
"""Width of a sensor that is not known."""
