"""Changes of light, camera, iris, dirt, coating and quality: a project and some words in, a new project out."""

from __future__ import annotations

from itertools import count
from typing import Any

from ..errors import ProjectError
from ..io.coating_text import parse_coating_choice
from ..io.look_file import read_look, shipped_looks
from ..io.spectrum_text import parse_spectrum
from ..measure.rendering import check_measured, is_measured
from ..model import BlackBody, Everywhere, Holdout, Iris, Light, PerRow, Project, QuarterWave, Surface
from ..render.looks import with_look
from ..render.prepare import as_lens, settle

# a drag goes no further out than this: beyond it a flat picture has no place for the light
STEEPEST_DEG = 80.0


def move_light(project: Project, light: int, x: float, y: float) -> Project:
    """Put a light at field angles, degrees right and up; as far out as `STEEPEST_DEG`."""
    held = tuple(max(-STEEPEST_DEG, min(STEEPEST_DEG, round(angle, 4))) for angle in (x, y))
    return set_light(project, light, {"field_deg": held})


def set_light(project: Project, light: int, values: dict[str, Any]) -> Project:
    """Change fields of a light; `spectrum` as the command line writes it."""
    lights = list(project.lights)
    if not 0 <= light < len(lights):
        raise ProjectError(f"there is no light {light}; they count from 0 to {len(lights) - 1}")
    changes = dict(values)
    if isinstance(changes.get("spectrum"), str):
        changes["spectrum"] = parse_spectrum(changes["spectrum"])
    if changes.get("diameter_deg"):
        changes["shape"] = None
    lights[light] = lights[light].replace(**changes)
    return _with(project, lights=tuple(lights))


def add_light(project: Project) -> Project:
    """Add a light on the other side of the picture."""
    x, y = project.lights[-1].field_deg
    taken = {light.name for light in project.lights}
    name = next(name for k in count(len(project.lights) + 1) if (name := f"light {k}") not in taken)
    new = Light(name=name, field_deg=(-x, y), spectrum=BlackBody(temperature_k=3200.0))
    return _with(project, lights=(*project.lights, new))


def remove_light(project: Project, light: int) -> Project:
    """Take a light away; the last one stays."""
    if len(project.lights) == 1:
        raise ProjectError("a flare needs a light; move the last one instead of removing it")
    return _with(project, lights=tuple(one for k, one in enumerate(project.lights) if k != light))


def set_camera(project: Project, values: dict[str, Any]) -> Project:
    """Change fields of the camera; the sensor's own shape is kept when only the picture's width changes."""
    return _with(project, camera=project.camera.replace(**values))


def set_quality(project: Project, values: dict[str, Any]) -> Project:
    """Change fields of the quality."""
    return _with(project, quality=project.quality.replace(**values))


def set_fields(project: Project, values: dict[str, Any]) -> Project:
    """Change fields of the project itself: f_number, as far as the lens opens, and zoom."""
    known = {"f_number", "zoom"}
    if unknown := set(values) - known:
        raise ProjectError(f"{', '.join(sorted(unknown))} cannot be set here; known are {', '.join(sorted(known))}")
    if is_measured(project):
        changed = _with(project, **values)
        check_measured(changed)
        return changed
    if (f_number := values.get("f_number")) is not None:
        values = {**values, "f_number": max(f_number, as_lens(project.lens).f_number)}
    changed = _with(project, **values)
    settle(changed)
    return changed


def iris_of(project: Project) -> Iris:
    """Return the iris: the project's own, else that of its lens file."""
    return project.iris if project.iris is not None else as_lens(project.lens).iris


def set_iris(project: Project, values: dict[str, Any]) -> Project:
    """Change the iris; what is not said stays as the lens file has it."""
    iris = iris_of(project)
    changes = dict(values)
    if changes.get("blades") in (1, 2):
        # the slider passes over numbers that no iris has
        changes["blades"] = 3 if iris.blades < 3 else 0
    return _with(project, iris=iris.replace(**changes))


def set_holdout(project: Project, light: int | None, values: dict[str, Any] | None) -> Project:
    """Change what hides all lights, or one light more; None takes it away.

    Parameters
    ----------
    project : Project
    light : int or None
        None: all of them.
    values : dict or None
        Fields of `Holdout`; an image takes the place of a depth plate, and the other way round.

    Returns
    -------
    Project
    """
    if light is not None and not 0 <= light < len(project.lights):
        raise ProjectError(f"there is no light {light}; they count from 0 to {len(project.lights) - 1}")
    old = project.holdout if light is None else project.lights[light].holdout
    new: Holdout | None = None
    if values is not None:
        changes = dict(values)
        if changes.get("image"):
            changes["depth"] = None
        elif changes.get("depth"):
            changes |= {"image": None, "invert": False}
        new = Holdout(**changes) if old is None else old.replace(**changes)
    return _with(project, holdout=new) if light is None else set_light(project, light, {"holdout": new})


def set_dirt(project: Project, values: dict[str, Any]) -> Project:
    """Change dust, scratches and the like."""
    return _with(project, dirt=project.dirt.replace(**values))


def set_starburst(project: Project, values: dict[str, Any]) -> Project:
    """Change how the direct image is drawn."""
    return _with(project, starburst=project.starburst.replace(**values))


def set_pass_gain(project: Project, name: str, gain: float) -> Project:
    """Multiply a whole pass, "ghosts", "starburst" or "scatter"; 1 is physics."""
    gains = {key: value for key, value in project.art.gain.items() if key != name}
    if gain != 1.0:
        gains[name] = gain
    return _with(project, art=project.art.replace(gain=gains))


def set_coating(project: Project, text: str) -> Project:
    """Choose the coating of the whole lens by a short text, as `--coating` does."""
    changed = _with(project, coating=parse_coating_choice(text))
    settle(changed)
    return changed


def put_look(project: Project, name: str) -> Project:
    """Put a look that ships on the lens and the lights."""
    if is_measured(project):
        raise ProjectError("a measured flare has the look of its own lens; choose a lens first")
    if name not in shipped_looks():
        raise ProjectError(f"the library has no look {name!r}")
    changed, _ = with_look(project, read_look(name))
    settle(changed)
    return changed


def set_row_wavelengths(project: Project, values: dict[str, float]) -> Project:
    """Give rows quarter-wave coatings of stated centre wavelengths; the others keep what they wear."""
    from ..optics.pack import resolve_coatings

    lens = as_lens(project.lens)
    coats = list(resolve_coatings(lens, project.coating))
    for key, wavelength_nm in values.items():
        row = int(key)
        if not 0 <= row < len(coats) or not isinstance(lens.rows[row], Surface):
            raise ProjectError(f"row {row} is no surface; nothing can be coated there")
        coats[row] = QuarterWave(center_wavelength_nm=float(wavelength_nm))
    return _with(project, coating=PerRow(coatings=tuple(coats)))


def coating_text(project: Project) -> str:
    """Return the coating of the whole lens as a short text; "per-row" where rows differ."""
    from ..io.coating_text import format_coating

    choice = project.coating
    if isinstance(choice, Everywhere):
        return format_coating(choice.coating)
    return f"preset:{choice.name}" if choice.kind == "preset" else choice.kind


def _with(project: Project, **changes: Any) -> Project:
    changed: Project = project.replace(**changes)
    return changed
