"""`--look` and what a lens of the library is photographed with: what the flags of `flarewright render` leave open."""

from __future__ import annotations

from dataclasses import replace

from ..errors import ProjectError
from ..io.ghost_model_file import names_ghost_model
from ..io.look_file import read_look
from ..io.project_file import read_project
from ..model import Light, Project
from ..render.looks import look_says, with_look
from ..render.photographed import as_photographed
from .flag_set import Flags
from .render_flags import light_of

__all__ = ["put_look", "said_by"]


def put_look(flags: Flags, name: str) -> tuple[Flags, frozenset[str], tuple[str, ...]]:
    """Put a look under the flags: on their lens and lights, on those of their project, or on the look's own.

    Parameters
    ----------
    flags : Flags
    name : str
        `--look`.

    Returns
    -------
    flags : Flags
        Their lens, lights and project file are in `resumed`, a project that has the look.
    said : frozenset of str
        What the look says, as `as_photographed` takes it.
    remarks : tuple of str

    Raises
    ------
    FlarewrightError
        When there is no such look, or the lens or the project cannot be read.
    """
    if flags.resumed is not None:
        raise ProjectError("--resume goes on with the picture that was begun; leave --look out")
    look = read_look(name)
    base = None if flags.project is None else read_project(flags.project)
    stage = base or look.example
    lens = stage.lens if flags.lens is None else flags.lens
    if isinstance(lens, str) and names_ghost_model(lens):
        raise ProjectError(f"{lens} is a measured flare and has the look of its own lens; leave --look out")
    lights = tuple(Light.model_validate(light_of(text)) for text in flags.light) or stage.lights
    if base is None:
        zoom = stage.zoom if flags.lens is None else None
        shot = Project(lens=lens, lights=lights, zoom=zoom)
    else:
        shot = base.replace(lens=lens, lights=lights)
    found, remarks = with_look(shot, look)
    return replace(flags, lens=None, light=[], project=None, resumed=found), look_says(look), remarks


def said_by(flags: Flags) -> frozenset[str]:
    """Return what flags say of a lens of the library, as `render.photographed.as_photographed` takes it."""
    sizes = (flags.light_diameter, flags.light_size, flags.light_polygon, any("@" in text for text in flags.light))
    given = {
        "f_number": flags.fstop is not None,
        "coating": flags.coating is not None,
        "iris.blades": flags.blades is not None,
        "iris.rounding": flags.rounding is not None,
        "iris.roughness_um": flags.roughness is not None,
        "iris.mask": flags.iris_image is not None,
        "lights": any(sizes),
        "quality.ringing": flags.ringing is not None,
    }
    return frozenset(name for name, value in given.items() if value)


def photographed(project: Project, said: frozenset[str]) -> tuple[Project, list[str]]:
    """Fill in what is not said, and say in one remark what was filled in."""
    found, told = as_photographed(project, said)
    return found, [f"as photographed: {', '.join(told)}; --ideal leaves this out"] if told else []
