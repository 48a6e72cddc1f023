"""Render pictures for the viewport: small drafts while something moves, final ones at rest."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import lru_cache
from math import sqrt

import numpy as np

from ...errors import FlarewrightError
from ...io.lens.library import lens_path
from ...measure.replay.measured_project import is_measured, render_any
from ...model import Art, Backplate, Layer, Lens, Output, Project, Quality, Rule, Surface
from ...render.ghosts.ring_tables import table_obstacle
from ...render.ghosts.traced_ghosts import SCREEN_PX
from ...render.image.display import auto_exposure
from ...render.preview.diagnostic_views import working_ghosts
from ...render.scene.resolve import open_lens
from ...typing import Pixels, Progress
from ...workflow.keyframes import still
from ..session.view_settings import View
from .draft_match import EVEN, Levels, Match
from .picture import DrawnPicture, Grade

# largest size of a moving picture
WIDEST, HIGHEST = 960, 540
# a picture at rest has the size of the page's frame, with at most this number of pixels
MOST_PX = 1920 * 1080
DRAFT_WAVELENGTHS = 3
# largest number of wavelengths for final pictures on screen; coatings determine the colours in between
SOON_WAVELENGTHS = 7
SOON_TOLERANCE_PX = SCREEN_PX
# the same for the traced preview
HASTY_TOLERANCE_PX = 2.0
# any plate with the lights of a project
_ANY_LIT = Backplate(image="any", lights_above=1.0)
# more area lights are points in quick pictures
MOST_WIDE_LIGHTS = 2
POINTS = "area lights are points until the full picture is drawn"
NO_RINGS = (
    "the screen leaves out rings inside ghosts, which are slow with an image, dirt, cylinders or spectral lines; "
    "files have them"
)


def view_size(project: Project, scale: float = 1.0) -> tuple[int, int]:
    """Return the size of the viewport's picture: that of the project, scaled to fit."""
    width, height = project.camera.size_px
    zoom = min(WIDEST / width, HIGHEST / height) * scale
    return max(16, round(width * zoom)), max(16, round(height * zoom))


def rest_size(project: Project, room: tuple[int, int]) -> tuple[int, int]:
    """Return the size of a picture at rest: that of the page's frame, limited by the file's size and `MOST_PX`.

    Parameters
    ----------
    project : Project
    room : tuple of int
        Pixels of the screen that the frame covers.

    Returns
    -------
    tuple of int
        At least `view_size`, the size of pictures during a drag.
    """
    width, height = project.camera.size_px
    zoom = min(room[0] / width, room[1] / height, sqrt(MOST_PX / (width * height)), 1.0)
    return max(view_size(project), (round(width * zoom), round(height * zoom)))


def staged(
    project: Project, grade: Grade, scale: float = 1.0, room: tuple[int, int] | None = None, hasty: bool = False
) -> Project:
    """Return the project as the viewport draws it, with another size and sufficient quality.

    Parameters
    ----------
    project : Project
    grade : {"moving", "draft", "soon", "final", "working"}
    scale : float
        Factor on the picture's sides.
    room : tuple of int, optional
        As in `rest_size`, for a picture at rest.
    hasty : bool
        A traced preview may be coarser in steps, rims and rings, to save time; many area lights are points.
    """
    if isinstance(project.lens, str) and not is_measured(project):
        project = project.replace(lens=_loaded(project.lens, lens_path(project.lens).stat().st_mtime_ns))
    size = view_size(project, scale) if room is None else rest_size(project, room)
    camera = project.camera.replace(size_px=size, sensor_mm=project.camera.sensor)
    if hasty or grade in ("moving", "draft"):
        project = pointlike(project)
    own = project.quality
    if grade in ("soon", "final"):
        # reference quality is for files: it never finishes
        quality = own.replace(mode="final") if own.mode != "final" else own
        if _slow_rings(project):
            quality = quality.replace(ringing="off")
        if grade == "soon":
            few = min(quality.wavelengths, SOON_WAVELENGTHS)
            coarse = max(quality.tolerance_px, HASTY_TOLERANCE_PX if hasty else SOON_TOLERANCE_PX)
            quality = quality.replace(wavelengths=few, bridge=True, tolerance_px=coarse, screen=True)
    else:
        quality = Quality(mode="draft", wavelengths=DRAFT_WAVELENGTHS, paths=own.paths)
    output = Output(layers="passes", starburst=project.output.starburst)
    return project.replace(camera=camera, quality=quality, output=output)


def pointlike(project: Project) -> Project:
    """Return a project without area lights, if it has many: the blur of their ghosts takes most of the time."""
    if sum(light.extended for light in project.lights) <= MOST_WIDE_LIGHTS:
        return project
    lights = tuple(light.replace(diameter_deg=0.0, shape=None) for light in project.lights)
    return project.replace(lights=lights)


def _slow_rings(project: Project) -> bool:
    """Return whether a project's rings are too slow for the screen; its lens must be resolved."""
    if is_measured(project):
        return False
    assert isinstance(project.lens, Lens)
    iris = project.iris or project.lens.iris
    image = (iris is not None and iris.mask is not None) or (project.dirt.in_ghosts and not project.dirt.clean)
    slow = table_obstacle(project.lights, image=image) is not None or any(
        isinstance(row, Surface) and row.toroidal for row in project.lens.rows
    )
    return slow and project.quality.ringing != "off"


@lru_cache(maxsize=8)
def _loaded(name: str, changed_ns: int) -> Lens:
    """Read a lens; cached until its file changes."""
    del changed_ns
    return open_lens(name).lens


def take(
    project: Project,
    grade: Grade,
    look: View,
    *,
    scale: float = 1.0,
    room: tuple[int, int] | None = None,
    hasty: bool = False,
    levels: Levels = (),
    progress: Progress | None = None,
) -> DrawnPicture:
    """Render a picture for the viewport.

    Parameters
    ----------
    project : Project
    grade : {"moving", "draft", "soon", "final", "working"}
        "working" applies the view settings of `look` by `working_ghosts`.
    look : View
    scale, room, hasty
        As in `staged`.
    levels : Levels
        Gains of a draft's ghosts, as in `Match.levels`.
    progress : callable, optional
        Exceptions that it raises end the render.

    Raises
    ------
    FlarewrightError
        When the project cannot be rendered.
    """
    started = time.perf_counter()
    stage = staged(project, grade, scale, room, hasty)
    size = stage.camera.size_px
    if look.grey or look.unclipped:
        layer = working_ghosts(stage, grey=look.grey, unclipped=look.unclipped)
        light = spread_layers([layer], size)
        seconds = time.perf_counter() - started
        return DrawnPicture(project, "working", light, np.zeros_like(light), seconds, grey=look.grey)
    rendering = render_any(stage.replace(art=_levelled(stage.art, levels)), progress=progress)
    parts = [layer for layer in rendering.layers if layer.name != "beauty"]
    ghosts = spread_layers([layer for layer in parts if layer.name.startswith("ghosts")], size)
    rest = spread_layers([layer for layer in parts if not layer.name.startswith("ghosts")], size)
    scattered = [layer for layer in parts if not layer.name.startswith(("ghosts", "starburst"))]
    haze = spread_layers(scattered, size) if scattered else None
    remarks = rendering.remarks
    if hasty and pointlike(project) is not project:
        remarks = (*remarks, POINTS)
    if grade == "final" and _slow_rings(stage.replace(quality=project.quality)):
        remarks = (*remarks, NO_RINGS)
    return DrawnPicture(project, grade, ghosts, rest, time.perf_counter() - started, remarks, haze=haze)


def moving_stage(project: Project, scale: float, levels: Levels) -> Project:
    """Return the project for pictures of a drag."""
    stage = staged(project, "moving", scale)
    return stage.replace(art=_levelled(stage.art, levels))


def common_gain(shown: Project, project: Project) -> float | None:
    """Return the factor by which all lights of a project are brighter than in a shown one; None if more differs."""
    if len(shown.lights) != len(project.lights) or not shown.lights[0].intensity > 0.0:
        return None
    gain = project.lights[0].intensity / shown.lights[0].intensity
    if not gain > 0.0:
        return None
    for one, other in zip(shown.lights, project.lights, strict=True):
        # products of rounded numbers
        alike = abs(one.intensity * gain - other.intensity) <= 1e-9 * other.intensity
        if not alike or one.replace(intensity=other.intensity) != other:
            return None
    return gain if pictured(shown.replace(lights=project.lights)) == pictured(project) else None


def spread_layers(layers: Sequence[Layer], size_px: tuple[int, int]) -> Pixels:
    """Add layers into one image of the picture's size."""
    sheet = np.zeros((size_px[1], size_px[0], 3), dtype=np.float32)
    for layer in layers:
        x, y, width, height = layer.window
        sheet[y : y + height, x : x + width] += layer.pixels
    return sheet


def _levelled(art: Art, levels: Levels) -> Art:
    """Add gains of ghosts to the overrides."""
    if not levels:
        return art
    rules = tuple(Rule(select=",".join(names), gain=gain) for gain, names in levels)
    own = () if art.physical else art.rules
    return art.replace(physical=False, rules=(*own, *rules), gain={} if art.physical else art.gain)


def exposure_of(picture: DrawnPicture, match: Match | None = None) -> float:
    """Return an exposure that shows the ghosts of a picture and clips few pixels."""
    known = match or Match()
    return auto_exposure(chosen_light(picture, known), ghosts=ghosts_of(picture, known))


def is_as_large(picture: DrawnPicture, room: tuple[int, int]) -> bool:
    """Return whether a picture has all pixels possible for this room on the page (`rest_size`)."""
    height, width = picture.ghosts.shape[:2]
    return (width, height) >= rest_size(picture.project, room)


def has_no_ghosts(picture: DrawnPicture) -> bool:
    """Return whether a picture has no ghost from which an exposure could be determined."""
    return not bool(picture.ghosts.max(initial=0.0) > 0.0)


def chosen_light(picture: DrawnPicture, match: Match) -> Pixels:
    """Return the whole picture, with a draft's ghosts matched to final ones."""
    return np.asarray(ghosts_of(picture, match) + picture.rest)


def ghosts_of(picture: DrawnPicture, match: Match) -> Pixels:
    """Return the ghosts alone, matched as in `chosen_light`."""
    gain = ghost_gain(picture, match)
    return picture.ghosts if gain == EVEN else np.asarray(picture.ghosts * np.array(gain, dtype=np.float32))


def ghost_gain(picture: DrawnPicture, match: Match) -> tuple[float, float, float]:
    """Return the gain that matches the ghosts of a picture, R, G, B."""
    if picture.grey:
        return (match.grey, match.grey, match.grey)
    return match.gain if picture.grade in ("moving", "draft") else EVEN


def lens_name(project: Project) -> str:
    """Return the name of a project's lens, unchanged by edits; for a measured flare, its path."""
    return str(project.lens) if is_measured(project) else _prescription(project).name


def _prescription(project: Project) -> Lens:
    lens = project.lens
    return _loaded(lens, lens_path(lens).stat().st_mtime_ns) if isinstance(lens, str) else lens


def same_ghosts(one: Project, other: Project) -> bool:
    """Return whether ghosts of the same name correspond in two projects: their lenses have the same rows."""
    if one.lens == other.lens:
        return True
    try:
        ours, theirs = _prescription(one), _prescription(other)
    except FlarewrightError:
        # an unreadable lens has no ghosts
        return False
    return ours.name == theirs.name and [row.kind for row in ours.rows] == [row.kind for row in theirs.rows]


def pictured(project: Project) -> Project:
    """Return the part of a project that determines its picture: without targets, paths and curves.

    Of a plate only whether the lights have its unit counts, which decides how the flare is exposed.
    """
    return still(project).replace(design=None, plate=_ANY_LIT if project.lit_by_plate else None)


def same_scene(one: Project, other: Project) -> bool:
    """Return whether two projects differ only in lights, overrides and design, so that they have the same ghosts."""
    kept = other.replace(lights=one.lights, art=one.art, design=one.design, quality=one.quality)
    return bool(kept == one)
