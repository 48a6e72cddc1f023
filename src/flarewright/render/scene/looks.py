"""Apply a look to a project with another lens and other lights, or extract the look of a project."""

from __future__ import annotations

from os import PathLike
from typing import Any

from ...errors import ProjectError
from ...io.files.file_kind import is_ghost_model_file
from ...io.project.look_file import read_look
from ...model import Art, Bare, Camera, Everywhere, InTurn, Iris, Light, Look, Preset, Project
from ...model.project.look import CAMERA_KEYS, LIGHT_KEYS
from ...model.project.project import AsLens, CoatingChoice
from ...optics.lens.zoom import positioned
from ...optics.rays.pack import preset_names, resolve_coatings, rows_in_air
from ...sentences import INVALID, validation_sentences
from .photographic_defaults import as_photographed
from .resolve import open_lens

# keys of a look whose values a curve of another name sets
_LOOK_KEYS = {"f_number": "f_number", "rotation_deg": "iris.rotation_deg"}
_COLOURS = ("rgb", "temperature_k")


def with_look(project: Project, look: Look | str | PathLike[str]) -> tuple[Project, tuple[str, ...]]:
    """Apply a look to a project.

    Parameters
    ----------
    project : Project
        Its lens, the positions of its lights and all settings that the look does not contain stay.
    look : Look, str or path
        A look, the name of a shipped one, or a file.

    Returns
    -------
    project : Project
        Lights with a size keep it. The f-number is at least that of the lens. Curves of values that the look sets are
        left out.
    remarks : tuple of str
        Parts of the look that do not fit this lens, and the curves that are left out.

    Raises
    ------
    FlarewrightError
        A lens or the look cannot be read.
    """
    look = look if isinstance(look, Look) else read_look(look)
    changes: dict[str, Any] = {}
    remarks: list[str] = []
    same_lens = look.example.lens == project.lens
    for key in look.says:
        section = key.partition(".")[0]
        if section == "coating":
            changes["coating"] = look.example.coating if same_lens else _transferred_coating(look.example, project)
        elif section == "f_number" and look.example.f_number is not None:
            # a zoom may open less at its long end
            lens = positioned(open_lens(project.lens).lens, project.zoom, project.camera.focus_distance)
            changes["f_number"] = max(look.example.f_number, lens.f_number)
            if look.example.f_number < lens.f_number:
                remarks.append(
                    f"the look's f/{look.example.f_number:g} is wider than {lens.name} opens: f/{lens.f_number:g}"
                )
        elif section == "art":
            art = look.example.art if same_lens else without_lens_rules(look.example.art)
            if (lost := len(look.example.art.rules) - len(art.rules)) > 0:
                remarks.append(f"{lost} of the look's rules name ghosts of {look.example.lens} and are left out")
            changes["art"] = art
        elif section == "scatter" and look.example.scatter is not None and not same_lens:
            scatter = look.example.scatter
            # rows of another lens are other surfaces
            changes["scatter"] = scatter.replace(rows=())
            if scatter.rows:
                which = "row" if len(scatter.rows) == 1 else "rows"
                remarks.append(
                    f"the look's scatter at {which} {', '.join(str(each.row) for each in scatter.rows)} is for "
                    "another lens, and left out"
                )
        elif section == "iris":
            own = project.iris or open_lens(project.lens).lens.iris
            changes["iris"] = own.replace(**look.of("iris"))
        elif section == "camera":
            changes["camera"] = project.camera.replace(**look.of("camera"))
        elif section == "lights":
            changes["lights"] = tuple(_with_look_light(light, look) for light in project.lights)
        else:
            changes[section] = getattr(look.example, section)
    found, replaced = _without_curves(project.replace(**changes), look)
    if replaced:
        remarks.append(f"the look's values replace the project's curves of {', '.join(replaced)}")
    return found, tuple(remarks)


def look_of(project: Project, name: str, notes: str = "") -> tuple[Look, tuple[str, ...]]:
    """Extract the look of a project: its settings that differ from a bare lens with white point lights.

    Parameters
    ----------
    project : Project
        With a lens, not with a measured flare.
    name, notes : str

    Returns
    -------
    look : Look
    remarks : tuple of str
        Parts of the project that the look does not contain.

    Raises
    ------
    FlarewrightError
        The lens cannot be read, or no setting of the project belongs to a look.
    """
    if isinstance(project.lens, str) and is_ghost_model_file(project.lens):
        raise ProjectError("a look cannot be taken from a measured flare; give a project with a lens")
    lens = open_lens(project.lens).lens
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
        remarks.append("lights differ in colour or size: the look uses those of the first")
    try:
        return Look(name=name, notes=notes, example=project, says=tuple(says)), tuple(remarks)
    except INVALID as error:
        raise ProjectError(f"of the look, {validation_sentences(error)[0]}") from None


def without_lens_rules(art: Art) -> Art:
    """Return the art rules without those that name ghosts or rows of one lens."""
    rules = tuple(rule for rule in art.rules if not any(letter.isdigit() for letter in _named(rule.select)))
    return art.replace(rules=rules)


def _named(select: str) -> str:
    """Return the part of a selector that can name ghosts of one lens; numbers of `brightest` and `largest` do not."""
    return "" if "brightest:" in select or "largest:" in select else select


def _without_curves(project: Project, look: Look) -> tuple[Project, list[str]]:
    """Return a project without curves of values that a look sets, which they would override; and their names."""
    # the art table is applied as a whole, with the gains that it leaves at 1
    kept = tuple(
        curve
        for curve in project.curves
        if ("art" if curve.of.startswith("gain.") else _LOOK_KEYS.get(curve.of)) not in look.says
    )
    replaced: list[str] = [curve.of for curve in project.curves if curve not in kept]
    if "lights.spectrum" not in look.says:
        return project.replace(curves=kept), replaced
    lights = []
    for k, light in enumerate(project.lights):
        replaced += [f"{curve.of} of light {k} (counted from 0)" for curve in light.curves if curve.of in _COLOURS]
        lights.append(light.replace(curves=tuple(curve for curve in light.curves if curve.of not in _COLOURS)))
    return project.replace(curves=kept, lights=tuple(lights)), replaced


def _with_look_light(light: Light, look: Look) -> Light:
    """Give a light the look's spectrum, and the look's size if it has none."""
    values = look.of("lights")
    if light.extended:
        values = {key: value for key, value in values.items() if key == "spectrum"}
    return light.replace(**values)


def _transferred_coating(example: Project, project: Project) -> CoatingChoice:
    """Return the example's coatings for another lens: `InTurn` if the example lists them by row."""
    choice = example.coating
    if isinstance(choice, Everywhere | InTurn | AsLens):
        return choice
    if isinstance(choice, Preset) and choice.name in preset_names(open_lens(project.lens).lens):
        return choice
    lens = open_lens(example.lens).lens
    coatings = resolve_coatings(lens, choice)
    return InTurn(coatings=tuple(coatings[k] or Bare() for k in rows_in_air(lens)))


def demonstration(look: Look, size_px: tuple[int, int] | None = None) -> Project:
    """Return a look with the lens and light of its example; all other settings are photographic defaults.

    Parameters
    ----------
    look : Look
    size_px : tuple of int, optional
        Of the picture; None: the project's default.
    """
    example = Project(lens=look.example.lens, lights=look.example.lights, zoom=look.example.zoom)
    project, _ = as_photographed(with_look(example, look)[0], look_keys(look))
    if size_px is None:
        return project
    return project.replace(camera=project.camera.replace(size_px=size_px))


def look_keys(look: Look) -> frozenset[str]:
    """Return the keys of a look as `render.scene.photographic_defaults.as_photographed` names them."""
    sized = ("lights.diameter_deg", "lights.shape")
    return frozenset("lights" if key in sized else key for key in look.says)
