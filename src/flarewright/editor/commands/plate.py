"""Commands for the plate under the flare."""

from __future__ import annotations

from typing import Any

from ...errors import ProjectError
from ...model import Backplate, Project
from ...model.project.backplate import found_in_plate

SEARCH = "search"


def set_plate(project: Project, values: dict[str, Any]) -> Project:
    """Put a plate under the flare, or change how it is read and searched.

    Parameters
    ----------
    project : Project
    values : dict
        Fields of `Backplate`; those of "search" are changed alone. Another image has its own lights: those of the
        project stay, but are no longer in its unit.
    """
    changes = {key: value for key, value in values.items() if key != SEARCH}
    if "lights_above" in changes:
        raise ProjectError("the threshold of the lights is what a search has found; find the lights")
    old = project.plate
    search = values.get(SEARCH, {})
    if not isinstance(search, dict):
        raise ProjectError(f"the search of a plate has settings, not {search!r:.60}")
    if old is None and "image" not in changes:
        raise ProjectError("there is no plate; drop a picture on the page, or choose one")
    if old is None or changes.get("image", old.image) != old.image:
        # the settings of the search serve the next frame too
        kept = {} if old is None else {SEARCH: old.search}
        new = Backplate(**{**kept, **changes})
    else:
        new = old.replace(**changes)
    new = new.replace(search=new.search.replace(**search))
    lights = project.lights
    if new.lit and old is not None:
        # the other settings count at the next search
        ratio = new.search.gain / old.search.gain
        lights = tuple(
            light.replace(intensity=light.intensity * ratio) if found_in_plate(light) else light for light in lights
        )
    return project.replace(plate=new, lights=lights)


def remove_plate(project: Project) -> Project:
    """Remove the plate; lights that were found in it stay."""
    return project.replace(plate=None)
