"""Pictures for the viewport, all of them by `render`: small ones while something moves, final ones when it rests."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from math import sqrt

import numpy as np

from ..errors import FlarewrightError
from ..io.library import lens_path
from ..measure.rendering import is_measured, render_any
from ..model import Art, Layer, Lens, Output, Project, Quality, Rule
from ..render.display import auto_exposure
from ..render.edge_rings import untabled
from ..render.ghosts_final import SCREEN_PX
from ..render.prepare import load_lens
from ..render.working import working_ghosts
from .draft_match import EVEN, Levels, Match
from .picture import Floats, Grade, Picture
from .view import View

# the viewport's picture fits into this
WIDEST, HIGHEST = 960, 540
# where it rests it is as large as a page shows it, and has no more pixels than this
MOST_PX = 1920 * 1080
DRAFT_WAVELENGTHS = 3
# and the most of a picture that is final for the screen; coatings tell the colours between them
SOON_WAVELENGTHS = 7
SOON_TOLERANCE_PX = SCREEN_PX
# and of one that is wanted sooner still
HASTY_TOLERANCE_PX = 2.0
NO_RINGS = (
    "the screen leaves out rings inside ghosts, which are slow through an image, dirt or cylinders and for spectral "
    "lines; files have them"
)


def view_size(project: Project, scale: float = 1.0) -> tuple[int, int]:
    """Return the size of the viewport's picture: that of the project, made to fit."""
    width, height = project.camera.size_px
    zoom = min(WIDEST / width, HIGHEST / height) * scale
    return max(16, round(width * zoom)), max(16, round(height * zoom))


def rest_size(project: Project, room: tuple[int, int]) -> tuple[int, int]:
    """Return the size of a picture that rests: as large as it is seen, as its file and `MOST_PX` allow.

    Parameters
    ----------
    project : Project
    room : tuple of int
        Pixels of the screen that its frame covers.

    Returns
    -------
    tuple of int
        No less than `view_size`, which is what a moving hand is shown.
    """
    width, height = project.camera.size_px
    zoom = min(room[0] / width, room[1] / height, sqrt(MOST_PX / (width * height)), 1.0)
    return max(view_size(project), (round(width * zoom), round(height * zoom)))


def staged(
    project: Project, grade: Grade, scale: float = 1.0, room: tuple[int, int] | None = None, hasty: bool = False
) -> Project:
    """Return the project as the viewport draws it: its frame at another size, its quality as far as is needed.

    Parameters
    ----------
    project : Project
    grade : {"moving", "draft", "soon", "final", "working"}
    scale : float
        Of the picture's sides.
    room : tuple of int, optional
        As of `rest_size`, of a picture that rests.
    hasty : bool
        A picture that is traced soon may be coarser in steps, rims and rings, so that it takes less time.

    Returns
    -------
    Project
    """
    if isinstance(project.lens, str) and not is_measured(project):
        project = project.replace(lens=_loaded(project.lens, lens_path(project.lens).stat().st_mtime_ns))
    size = view_size(project, scale) if room is None else rest_size(project, room)
    camera = project.camera.replace(size_px=size, sensor_mm=project.camera.sensor)
    own = project.quality
    if grade in ("soon", "final"):
        # reference quality is for files: it never ends
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
    found: Project = project.replace(camera=camera, quality=quality, output=output)
    return found


def _slow_rings(project: Project) -> bool:
    """Tell whether a project's rings are out of reach of a screen; its lens is at hand."""
    if is_measured(project):
        return False
    assert isinstance(project.lens, Lens)
    iris = project.iris or project.lens.iris
    image = (iris is not None and iris.mask is not None) or (project.dirt.in_ghosts and not project.dirt.clean)
    return project.quality.ringing != "off" and untabled(project.lens, project.lights, image=image) is not None


@lru_cache(maxsize=8)
def _loaded(name: str, changed_ns: int) -> Lens:
    """Read a lens once, and anew when its file has changed."""
    del changed_ns
    return load_lens(name)


def take(
    project: Project,
    grade: Grade,
    look: View,
    *,
    scale: float = 1.0,
    room: tuple[int, int] | None = None,
    hasty: bool = False,
    levels: Levels = (),
    progress: Callable[[float, str], None] | None = None,
) -> Picture:
    """Render a picture for the viewport.

    Parameters
    ----------
    project : Project
    grade : {"moving", "draft", "soon", "final", "working"}
        "working" draws what `look` asks for by `working_ghosts`.
    look : View
    scale, room, hasty
        As of `staged`.
    levels : Levels
        `Match.levels` of a draft.
    progress : callable, optional
        What it raises ends the render.

    Returns
    -------
    Picture

    Raises
    ------
    FlarewrightError
        When the project cannot be rendered.
    """
    begun = time.perf_counter()
    stage = staged(project, grade, scale, room, hasty)
    size = stage.camera.size_px
    if look.grey or look.unclipped:
        layer = working_ghosts(stage, grey=look.grey, unclipped=look.unclipped)
        light = spread([layer], size)
        seconds = time.perf_counter() - begun
        return Picture(project, "working", light, np.zeros_like(light), seconds, grey=look.grey)
    rendering = render_any(stage.replace(art=_levelled(stage.art, levels)), progress=progress)
    parts = [layer for layer in rendering.layers if layer.name != "beauty"]
    ghosts = spread([layer for layer in parts if layer.name.startswith("ghosts")], size)
    rest = spread([layer for layer in parts if not layer.name.startswith("ghosts")], size)
    told = rendering.remarks
    if grade == "final" and _slow_rings(stage.replace(quality=project.quality)):
        told = (*told, NO_RINGS)
    return Picture(project, grade, ghosts, rest, time.perf_counter() - begun, told)


def moving_stage(project: Project, scale: float, levels: Levels) -> Project:
    """Return the project as pictures of a moving hand are drawn."""
    stage = staged(project, "moving", scale)
    found: Project = stage.replace(art=_levelled(stage.art, levels))
    return found


def spread(layers: Sequence[Layer], size_px: tuple[int, int]) -> Floats:
    """Add layers on a sheet of the picture's size."""
    sheet = np.zeros((size_px[1], size_px[0], 3), dtype=np.float32)
    for layer in layers:
        x, y, width, height = layer.window
        sheet[y : y + height, x : x + width] += layer.pixels
    return sheet


def _levelled(art: Art, levels: Levels) -> Art:
    """Add the gains to what is done by hand."""
    if not levels:
        return art
    rules = tuple(Rule(select=",".join(names), gain=gain) for gain, names in levels)
    own = () if art.physical else art.rules
    kept: Art = art.replace(physical=False, rules=(*own, *rules), gain={} if art.physical else art.gain)
    return kept


def exposure_of(picture: Picture, match: Match | None = None) -> float:
    """Find an exposure that shows the ghosts of a picture, and burns out little of it."""
    known = match or Match()
    return auto_exposure(light_of(picture, known), ghosts=ghosts_of(picture, known))


def is_as_large(picture: Picture, room: tuple[int, int]) -> bool:
    """Tell whether a picture has all the pixels that it could have where a page has so much room (`rest_size`)."""
    height, width = picture.ghosts.shape[:2]
    return (width, height) >= rest_size(picture.project, room)


def is_dark(picture: Picture) -> bool:
    """Tell whether a picture has no ghost that an exposure could be found for."""
    return not bool(picture.ghosts.max(initial=0.0) > 0.0)


def light_of(picture: Picture, match: Match) -> Floats:
    """Return the whole picture, a draft's ghosts matched to what final ones would be."""
    return np.asarray(ghosts_of(picture, match) + picture.rest)


def ghosts_of(picture: Picture, match: Match) -> Floats:
    """Return the ghosts alone, matched as in `light_of`."""
    gain = ghost_gain(picture, match)
    return picture.ghosts if gain == EVEN else np.asarray(picture.ghosts * np.array(gain, dtype=np.float32))


def ghost_gain(picture: Picture, match: Match) -> tuple[float, float, float]:
    """Return what matches the ghosts of a picture, R, G, B."""
    if picture.grey:
        return (match.grey, match.grey, match.grey)
    return match.gain if picture.grade in ("moving", "draft") else EVEN


def lens_name(project: Project) -> str:
    """Return the name of a project's lens, which stays while it is edited; of a measured flare, where it lies."""
    return str(project.lens) if is_measured(project) else _prescription(project).name


def _prescription(project: Project) -> Lens:
    lens = project.lens
    return _loaded(lens, lens_path(lens).stat().st_mtime_ns) if isinstance(lens, str) else lens


def same_ghosts(one: Project, other: Project) -> bool:
    """Tell whether a ghost of one project is the one of the same name in another: their lenses have the same rows."""
    if one.lens == other.lens:
        return True
    try:
        ours, theirs = _prescription(one), _prescription(other)
    except FlarewrightError:
        # a lens that cannot be read has none
        return False
    return ours.name == theirs.name and [row.kind for row in ours.rows] == [row.kind for row in theirs.rows]


def pictured(project: Project) -> Project:
    """Return what of a project its picture shows: neither what is wished for, nor the paths of its lights."""
    lights = tuple(light.replace(keyframes=()) if light.keyframes else light for light in project.lights)
    found: Project = project.replace(lights=lights, design=None)
    return found


def same_scene(one: Project, other: Project) -> bool:
    """Tell whether two projects differ by their lights, art and design alone, so that they have the same ghosts."""
    kept = other.replace(lights=one.lights, art=one.art, design=one.design, quality=one.quality)
    return bool(kept == one)
