"""Pictures that a project reads, and messages on missing or invalid ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...model import Lens, Project


@dataclass(frozen=True)
class Named:
    """A picture file of a project.

    Attributes
    ----------
    path : str
    what : str
        Its role.
    panel : str
        Panel on which to choose another one.
    """

    path: str
    what: str
    panel: str


def pictures(project: Project) -> tuple[Named, ...]:
    """Return all pictures that a project reads, except those of its lens file."""
    iris = project.iris
    if iris is None and isinstance(project.lens, Lens):
        iris = project.lens.iris
    found = [
        (None if iris is None else iris.mask, "iris image", "Iris"),
        (project.dirt.image, "drawing of dirt", "Iris"),
    ]
    if project.plate is not None:
        found.append((project.plate.image, "plate", "Light"))
    for holdout in (project.holdout, *(light.holdout for light in project.lights)):
        if holdout is not None:
            found += [(holdout.image, "matte", "Light"), (holdout.depth, "depth plate", "Light")]
    return tuple(Named(path, what, panel) for path, what, panel in found if path is not None)


def in_short(words: str, project: Project, file: str | None) -> str:
    """Shorten picture paths in a message to the page's names; for a missing picture add the folder searched.

    Parameters
    ----------
    words : str
        Error message with paths of the renderer.
    project : Project
    file : str or None
        Project file.

    Returns
    -------
    str
        One sentence.
    """
    for picture in pictures(project):
        if picture.path not in words:
            continue
        place = Path(picture.path)
        beside = file is not None and place.resolve().is_relative_to(Path(file).parent)
        name = place.resolve().relative_to(Path(str(file)).parent).as_posix() if beside else place.name
        if place.is_file():
            return words.replace(picture.path, name)
        where = f"beside {Path(str(file)).name}" if beside else f"in {place.resolve().parent}"
        return (
            f"the {picture.what} {name} does not exist {where}; put it there, or choose another on the panel "
            f"{picture.panel}"
        )
    return words
