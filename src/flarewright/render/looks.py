"""Looks on projects: a look is put on another lens and light, and taken from any project."""

from __future__ import annotations

from typing import Any

from ..errors import ProjectError
from ..io.ghost_model_file import names_ghost_model
from ..model import Art, Bare, Camera, Everywhere, InTurn, Iris, Light, Look, Preset, Project
from ..model.look import CAMERA_KEYS, LIGHT_KEYS
from ..model.project import AsLens, CoatingChoice
from ..optics.pack import preset_names, resolve_coatings, rows_in_air
from .photographed import as_photographed
from .prepare import as_lens


def with_look(project: Project, look: Look) -> tuple[Project, tuple[str, ...]]:
    """Put a look on a project.

    Parameters
    ----------
    project : Project
        Its lens and the places of its lights stay, as does what the look says nothing of.
    look : Look

    Returns
    -------
    project : Project
        Lights that have a size keep it. The f-number is not below the lens'.
    remarks : tuple of str
        What of the look does not fit this lens.

    Raises
    ------
    FlarewrightError
        When a lens cannot be read.
    """
    changes: dict[str, Any] = {}
    remarks: list[str] = []
    same_lens = look.example.lens == project.lens
    for key in look.says:
        section = key.partition(".")[0]
        if section == "coating":
            changes["coating"] = look.example.coating if same_lens else _carried(look.example, project)
        elif section == "f_number" and look.example.f_number is not None:
            changes["f_number"] = max(look.example.f_number, as_lens(project.lens).f_number)
        elif section == "art":
            art = look.example.art if same_lens else general(look.example.art)
            if (lost := len(look.example.art.rules) - len(art.rules)) > 0:
                remarks.append(f"{lost} of the look's rules name ghosts of {look.example.lens} and are left out")
            changes["art"] = art
        elif section == "iris":
            own = project.iris or as_lens(project.lens).iris
            changes["iris"] = own.replace(**look.of("iris"))
        elif section == "camera":
            changes["camera"] = project.camera.replace(**look.of("camera"))
        elif section == "lights":
            changes["lights"] = tuple(_lit(light, look) for light in project.lights)
        else:
            changes[section] = getattr(look.example, section)
    found: Project = project.replace(**changes)
    return found, tuple(remarks)


def look_of(project: Project, name: str, notes: str = "") -> tuple[Look, tuple[str, ...]]:
    """Take the look of a project: what it says beyond a bare lens and white points of light.

    Parameters
    ----------
    project : Project
        Of a lens, not of a measured flare.
    name, notes : str

    Returns
    -------
    look : Look
    remarks : tuple of str
        What of the project the look does not hold.

    Raises
    ------
    FlarewrightError
        When the lens cannot be read, or the project says nothing that a look could hold.
    """
    if isinstance(project.lens, str) and names_ghost_model(project.lens):
        raise ProjectError("a measured flare is the look of its own lens; a look is taken from a project with a lens")
    lens = as_lens(project.lens)
    plain = Project(lens=project.lens, lights=project.lights)
    says = [
        section
        for section in ("f_number", "coating", "filter", "imperfection", "scatter", "dirt", "starburst", "art")
        if getattr(project, section) != getattr(plain, section)
    ]
    iris = project.iris or lens.iris
    says += [f"iris.{key}" for key in Iris.model_fields if getattr(iris, key) != getattr(lens.iris, key)]
    says += [f"camera.{key}" for key in CAMERA_KEYS if getattr(project.camera, key) != getattr(Camera(), key)]
    first = project.lights[0]
    point = Light(field_deg=first.field_deg)
    says += [f"lights.{key}" for key in LIGHT_KEYS if getattr(first, key) != getattr(point, key)]
    if not says:
        raise ProjectError(
            "the project is a bare lens, wide open, with a white point of light: there is nothing in it for a look"
        )
    remarks = []
    if any(getattr(light, key) != getattr(first, key) for light in project.lights for key in LIGHT_KEYS):
        remarks.append("lights differ in colour or size: the look has those of the first")
    return Look(name=name, notes=notes, example=project, says=tuple(says)), tuple(remarks)


def general(art: Art) -> Art:
    """Return changes by hand without the rules that name ghosts or rows of one lens."""
    rules = tuple(rule for rule in art.rules if not any(letter.isdigit() for letter in _named(rule.select)))
    found: Art = art.replace(rules=rules)
    return found


def _named(select: str) -> str:
    """Return the part of a selector that may name ghosts of one lens; counts of ghosts do not."""
    return "" if "brightest:" in select or "largest:" in select else select


def _lit(light: Light, look: Look) -> Light:
    """Give a light the look's spectrum, and its size where it has none of its own."""
    said = look.of("lights")
    if light.diameter_deg > 0.0 or light.shape is not None:
        said = {key: value for key, value in said.items() if key == "spectrum"}
    lit: Light = light.replace(**said)
    return lit


def _carried(example: Project, project: Project) -> CoatingChoice:
    """Return the coatings of the example as another lens may wear them: in turn, where its rows list them."""
    choice = example.coating
    if isinstance(choice, Everywhere | InTurn | AsLens):
        return choice
    if isinstance(choice, Preset) and choice.name in preset_names(as_lens(project.lens)):
        return choice
    lens = as_lens(example.lens)
    worn = resolve_coatings(lens, choice)
    return InTurn(coatings=tuple(worn[k] or Bare() for k in rows_in_air(lens)))


def shown(look: Look, size_px: tuple[int, int] | None = None) -> Project:
    """Return a look on the lens and in the light that it is shown with; what it leaves open is as photographed.

    Parameters
    ----------
    look : Look
    size_px : tuple of int, optional
        Of the picture; the project's own where left out.

    Returns
    -------
    Project
    """
    stage = Project(lens=look.example.lens, lights=look.example.lights, zoom=look.example.zoom)
    project, _ = as_photographed(with_look(stage, look)[0], look_says(look))
    if size_px is None:
        return project
    found: Project = project.replace(camera=project.camera.replace(size_px=size_px))
    return found


def look_says(look: Look) -> frozenset[str]:
    """Return what a look says, in the words of `render.photographed.as_photographed`."""
    sized = ("lights.diameter_deg", "lights.shape")
    return frozenset("lights" if key in sized else key for key in look.says)
