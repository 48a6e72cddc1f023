"""Outlines that ghosts can have."""

from __future__ import annotations

from ...model.measurement.ghost_model import Blades


def rims_of(iris: Blades | None) -> list[Blades | None]:
    """Return the possible rims of a ghost: round, the iris and, for an odd number of blades, the inverted iris."""
    if iris is None:
        return [None]
    turned = Blades(count=iris.count, first_deg=iris.first_deg + 180.0)
    return [None, iris, turned] if iris.count % 2 else [None, iris]
