"""Commands for light, camera, iris, dirt, coating and quality: a project and values in, a new project out."""

from __future__ import annotations

from itertools import chain, count
from typing import Any

from ...errors import ProjectError
from ...io.lens.coating_text import parse_coating_choice
from ...io.project.look_file import read_look, shipped_looks
from ...io.project.spectrum_text import parse_spectrum
from ...measure.replay.measured_project import check_measured, is_measured
from ...model import BlackBody, Everywhere, Holdout, Iris, Light, Look, PerRow, Project, QuarterWave, Surface
from ...optics.lens.zoom import positioned
from ...render.scene.looks import with_look
from ...render.scene.resolve import open_lens, resolve_project
from .design_targets import with_lights_at

# largest angle of a dragged light: beyond it a flat picture has no place for the light
STEEPEST_DEG = 80.0
# an added light is at least this far from all others
APART_DEG = 0.1


def move_light(project: Project, light: int, x: float, y: float) -> Project:
    """Put a light at field angles, degrees right and up, limited to `STEEPEST_DEG`."""
    held = tuple(max(-STEEPEST_DEG, min(STEEPEST_DEG, round(angle, 4))) for angle in (x, y))
    return set_light(project, light, {"field_deg": held})


def light_of(project: Project, light: int) -> Light:
    """Return a light by its number; raises ProjectError if there is none."""
    if not 0 <= light < len(project.lights):
        raise ProjectError(f"there is no light {light}; they count from 0 to {len(project.lights) - 1}")
    return project.lights[light]


def set_light(project: Project, light: int, values: dict[str, Any]) -> Project:
    """Change fields of a light; `spectrum` has the syntax of the command line."""
    old, lights = light_of(project, light), list(project.lights)
    changes = dict(values)
    if isinstance(changes.get("spectrum"), str):
        changes["spectrum"] = parse_spectrum(changes["spectrum"])
    if changes.get("diameter_deg"):
        changes["shape"] = None
    lights[light] = old.replace(**changes)
    return project.replace(lights=tuple(lights))


def add_light(project: Project) -> Project:
    """Add a light on the other side of the picture, where no other light hides it."""
    taken = {light.name for light in project.lights}
    name = next(name for k in count(len(project.lights) + 1) if (name := f"light {k}") not in taken)
    # in the unit of a plate, 1 may be a million times a lamp
    intensity = project.lights[-1].intensity if project.lit_by_plate else 1.0
    place = _free_place(project)
    new = Light(name=name, field_deg=place, spectrum=BlackBody(temperature_k=3200.0), intensity=intensity)
    return project.replace(lights=(*project.lights, new))


def _free_place(project: Project) -> tuple[float, float]:
    """Return mirrored angles of the last light, or the nearest ones towards the middle that no light has."""
    x, y = project.lights[-1].field_deg
    mirrored = ((-x, y), (-x, -y), (x, -y))
    inwards = ((-x + (k if x > 0.0 else -k), y) for k in count(1))
    taken = [light.field_deg for light in project.lights]
    return next(
        place
        for place in chain(mirrored, inwards)
        if all(max(abs(place[0] - u), abs(place[1] - v)) >= APART_DEG for u, v in taken)
    )


def remove_light(project: Project, light: int) -> Project:
    """Remove a light and its targets; the last one cannot be removed."""
    if len(project.lights) == 1:
        raise ProjectError("a flare needs a light; move the last one instead")
    light_of(project, light)
    left: Project = project.replace(lights=tuple(one for k, one in enumerate(project.lights) if k != light))
    return with_lights_at(left, lambda k: None if k == light else k - (k > light))


def set_section(section: str, project: Project, values: dict[str, Any]) -> Project:
    """Change fields of a section; if only the picture's width changes, the sensor keeps its shape."""
    return project.replace(**{section: getattr(project, section).replace(**values)})


def set_fields(project: Project, values: dict[str, Any]) -> Project:
    """Change fields of the project itself: f_number, limited to the lens' range, and zoom."""
    known = {"f_number", "zoom"}
    if unknown := set(values) - known:
        raise ProjectError(f"{', '.join(sorted(unknown))} cannot be set here; known are {', '.join(sorted(known))}")
    if is_measured(project):
        changed = project.replace(**values)
        check_measured(changed, limit=True)
        return changed
    changed = project.replace(**values)
    if changed.f_number is not None:
        # a zoom may open less at its long end
        lens = positioned(open_lens(project.lens).lens, changed.zoom, project.camera.focus_distance)
        changed = changed.replace(f_number=max(changed.f_number, lens.f_number))
    resolve_project(changed)
    return changed


def iris_of(project: Project) -> Iris:
    """Return the iris of the project, else that of its lens file."""
    return project.iris if project.iris is not None else open_lens(project.lens).lens.iris


def set_iris(project: Project, values: dict[str, Any]) -> Project:
    """Change the iris; other fields keep the values of the lens file."""
    iris = iris_of(project)
    changes = dict(values)
    if changes.get("blades") in (1, 2):
        # the slider passes over blade counts that no iris has
        changes["blades"] = 3 if iris.blades < 3 else 0
    return project.replace(iris=iris.replace(**changes))


def set_holdout(project: Project, light: int | None, values: dict[str, Any] | None) -> Project:
    """Change the occluder of all lights, or an additional one of a single light; None removes it.

    Parameters
    ----------
    project : Project
    light : int or None
        None: all of them.
    values : dict or None
        Fields of `Holdout`; an image replaces a depth plate, and vice versa.
    """
    old = project.holdout if light is None else light_of(project, light).holdout
    new: Holdout | None = None
    if values is not None:
        changes = dict(values)
        if changes.get("image"):
            changes["depth"] = None
        elif changes.get("depth"):
            changes |= {"image": None, "invert": False}
        new = Holdout(**changes) if old is None else old.replace(**changes)
    return project.replace(holdout=new) if light is None else set_light(project, light, {"holdout": new})


def set_pass_gain(project: Project, name: str, gain: float) -> Project:
    """Set the gain of a whole pass, "ghosts", "starburst" or "scatter"; 1 is physical."""
    gains = {key: value for key, value in project.art.gain.items() if key != name}
    if gain != 1.0:
        gains[name] = gain
    return project.replace(art=project.art.replace(gain=gains, physical=False))


def set_coating(project: Project, text: str) -> Project:
    """Set the coating of the whole lens from a short text with the syntax of `--coating`."""
    changed = project.replace(coating=parse_coating_choice(text))
    resolve_project(changed)
    return changed


def put_look(project: Project, name: str) -> Project:
    """Apply a shipped look to the lens and the lights."""
    if name not in shipped_looks():
        raise ProjectError(f"the library has no look {name!r}")
    return wearing(project, read_look(name))[0]


def wearing(project: Project, look: Look) -> tuple[Project, tuple[str, ...]]:
    """Apply a look, with remarks on what does not fit; a measured flare, or a lens that cannot wear it, is refused."""
    if is_measured(project):
        raise ProjectError("a measured flare has the look of its lens; choose a lens first")
    changed, remarks = with_look(project, look)
    resolve_project(changed)
    return changed, remarks


def set_row_wavelengths(project: Project, values: dict[str, float]) -> Project:
    """Give rows quarter-wave coatings of the stated centre wavelengths; the other rows are unchanged."""
    from ...optics.rays.pack import resolve_coatings

    lens = open_lens(project.lens).lens
    coats = list(resolve_coatings(lens, project.coating))
    for key, wavelength_nm in values.items():
        row = int(key)
        if not 0 <= row < len(coats) or not isinstance(lens.rows[row], Surface):
            raise ProjectError(f"row {row} is no surface; nothing can be coated there")
        coats[row] = QuarterWave(center_wavelength_nm=float(wavelength_nm))
    return project.replace(coating=PerRow(coatings=tuple(coats)))


def coating_text(project: Project) -> str:
    """Return the coating of the whole lens as a short text; "per-row" where rows differ."""
    from ...io.lens.coating_text import format_coating

    choice = project.coating
    if isinstance(choice, Everywhere):
        return format_coating(choice.coating)
    return f"preset:{choice.name}" if choice.kind == "preset" else choice.kind
