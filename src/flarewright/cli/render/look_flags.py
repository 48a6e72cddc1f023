"""`--look` and photographic defaults: settings that the flags of `flarewright render` leave open."""

from __future__ import annotations

from dataclasses import replace

from ...errors import ProjectError
from ...io.files.file_kind import is_ghost_model_file
from ...io.project.look_file import read_look
from ...model import Light, Project
from ...render.scene.looks import look_keys, with_look
from ...render.scene.photographic_defaults import as_photographed
from .options.record import RenderOptions
from .project_flags import flag_lights


def flags_with_look(flags: RenderOptions, name: str) -> tuple[RenderOptions, frozenset[str], tuple[str, ...]]:
    """Apply a look below the flags: to their lens and lights, to those of their project, or to the look's own.

    Parameters
    ----------
    flags : RenderOptions
    name : str
        `--look`.

    Returns
    -------
    flags : RenderOptions
        Their lens, lights and project file are in `base`, a project with the look.
    given : frozenset of str
        Settings of the look, for `as_photographed`.
    remarks : tuple of str

    Raises
    ------
    FlarewrightError
        When there is no such look, or the lens or the project cannot be read.
    """
    if flags.resume is not None:
        raise ProjectError("--resume continues a picture with its settings; omit --look")
    look = read_look(name)
    if flags.fstop is not None and (others := tuple(key for key in look.says if key != "f_number")):
        # no remark on an f-number that the flag overrides
        look = look.replace(says=others)
    base = flags.base
    stage = base or look.example
    lens = stage.lens if flags.lens is None else flags.lens
    if isinstance(lens, str) and is_ghost_model_file(lens):
        raise ProjectError(f"{lens} is a measured flare and has the look of its lens; omit --look")
    lights = tuple(Light.model_validate(fields) for fields in flag_lights(flags)) or stage.lights
    if base is None:
        zoom = stage.zoom if flags.lens is None else None
        shot = Project(lens=lens, lights=lights, zoom=zoom)
    else:
        shot = base.replace(lens=lens, lights=lights)
    found, remarks = with_look(shot, look)
    return (
        replace(flags, lens=None, light=[], light_px=[], sun=None, project=None, base=found),
        look_keys(look),
        remarks,
    )


def settings_of(flags: RenderOptions) -> frozenset[str]:
    """Return the settings of flags for a library lens, for `photographic_defaults.as_photographed`."""
    sizes = (
        flags.light_diameter,
        flags.light_size,
        flags.light_polygon,
        flags.sun,
        any("@" in text for text in (*flags.light, *flags.light_px)),
    )
    given = {
        "f_number": flags.fstop is not None,
        "coating": flags.coating is not None,
        "iris.blades": flags.blades is not None,
        "iris.rounding": flags.rounding is not None,
        "iris.roughness_um": flags.roughness is not None,
        "iris.mask": flags.iris_image is not None,
        "lights": any(sizes),
    }
    return frozenset(name for name, value in given.items() if value)


def photographed(project: Project, given: frozenset[str]) -> tuple[Project, list[str]]:
    """Apply photographic defaults to open settings; return the project and a remark on them."""
    found, chosen = as_photographed(project, given)
    return found, [f"as photographed: {', '.join(chosen)}; --ideal omits this"] if chosen else []
