"""Predict a scene, from its cameras and lights to the ranking, the shots and a better position of a camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FlarewrightError, ProjectError, naming
from ..optics.lens.dispersion import D_LINE_NM
from ..predict.plan import Plan, Ranked, plan_scene, ranking
from ..predict.scene_data import scene_data
from ..predict.scene_page import scene_page
from ..predict.search import BestPosition, best_position
from ..predict.switching import Shot, choose_cameras
from ..predict.worst import Worst, render_worst
from ..render.scattering.veiling_glare import VeilingGlare, veiling_glare
from ..sentences import summary
from .flare_pictures import pictures_elsewhere
from .lens_flares import camera_project, scene_flare
from .scene_check import light_errors

if TYPE_CHECKING:
    from ..model import Project
    from ..model.project.scene import Scene, SceneCamera, SceneLight
    from ..predict.flare import Flare, Frame
    from ..predict.pictures import Memory
    from ..typing import Progress, Report


@dataclass(frozen=True)
class NearbySearch:
    """Which camera gets a better position, and where it is searched.

    Attributes
    ----------
    camera : int
        Index in the scene.
    radius_m, height_m : float
        Largest horizontal and vertical distance.
    """

    camera: int
    radius_m: float = 5.0
    height_m: float = 0.0


@dataclass(frozen=True)
class ScenePrediction:
    """The flare of all lights in all cameras of a scene.

    Attributes
    ----------
    plan : Plan
    ranked : tuple of Ranked
        Pairs of camera and light, most flare first.
    shots : tuple of Shot
        The camera with least flare over time; empty for a single one.
    found : BestPosition or None
        Of the camera whose position was searched.
    worst : tuple of Worst
        Pictures of the worst times; empty without pictures.
    glare : tuple of VeilingGlare or None
        Of each camera; None where it was not wanted, or the lens is unknown.
    """

    plan: Plan
    ranked: tuple[Ranked, ...]
    shots: tuple[Shot, ...]
    found: BestPosition | None
    worst: tuple[Worst, ...]
    glare: tuple[VeilingGlare | None, ...]

    def as_data(self) -> dict[str, Any]:
        """Return the prediction as JSON data."""
        return scene_data(self.plan, self.ranked, self.shots, self.found, self.worst, self.glare)

    def page(self) -> str:
        """Return the report, a page of HTML."""
        return scene_page(self.plan, self.ranked, self.shots, self.found, self.worst)


def predict_scene(
    scene: Scene,
    *,
    file: Path | None = None,
    quality: str = "final",
    near: NearbySearch | None = None,
    shortest_shot_s: float = 0.0,
    pictures: bool = False,
    glare: bool = False,
    glare_of: Callable[..., VeilingGlare] = veiling_glare,
    memory: Memory | None = None,
    threads: int | None = None,
    processes: int | None = None,
    cluster: str | None = None,
    folder: Path = Path(),
    prepare: Callable[[Project, int | None], None] | None = None,
    progress: Callable[[str], Progress] = lambda _: lambda _part, _words: None,
    announce: Report | None = None,
) -> ScenePrediction:
    """Predict every light in every camera over time, and rank them.

    Parameters
    ----------
    scene : Scene
    file : Path, optional
        Its file, for errors.
    quality : {"draft", "final"}
        Quality of the renders behind the statistics.
    near : NearbySearch, optional
        Search a better position of a camera.
    shortest_shot_s : float
        Shortest time between two switches of cameras.
    pictures : bool
        Render the worst times, for the report.
    glare : bool
        Compute the veiling glare index of each camera.
    glare_of : callable
        Computes it, with the parameters of `veiling_glare`.
    memory : dict, optional
        Pictures drawn before; new ones are added.
    threads : int, optional
        Default: all cores; the prediction does not depend on it.
    processes, cluster, folder, announce
        As of `flare_pictures.pictures_elsewhere`; the prediction does not depend on them.
    prepare : callable, optional
        Called with a project and the number of threads before the work: the command line compiles kernels here.
    progress : callable
        Called with the name of a part of the work; returns the progress callback of that part.

    Raises
    ------
    FlarewrightError
        When a light is dark, a lens cannot be used, a light is at a camera's position, or there is no such cluster.
    """
    named = file or Path(scene.name)
    refuse_dark(scene, named)
    maker = partial(_flare, quality=quality, threads=threads)
    with pictures_elsewhere(cluster, processes, threads, folder, announce) as spread:
        with naming(named):
            if prepare is not None:
                _prepare(scene, threads, prepare)
            plan = plan_scene(scene, partial(maker, shown=False), progress, memory, spread)
        ranked = ranking(plan)
        found = None
        if near is not None:
            found = best_position(plan, near.camera, near.radius_m, near.height_m, progress("position"), spread)
        worst: list[Worst] = []
        if pictures:
            worst = render_worst(plan, ranked, partial(maker, shown=True), progress("pictures"), memory, spread)
    veils = np.stack([plan.veil(camera) for camera in range(len(plan.tracks))])
    shots = choose_cameras(veils, plan.times_s, shortest_shot_s)
    work = partial(glare_of, threads=threads)
    veiling = (_glare(scene, camera, work, progress) if glare else None for camera in scene.cameras)
    return ScenePrediction(plan, tuple(ranked), tuple(shots), found, tuple(worst), tuple(veiling))


def refuse_dark(scene: Scene, file: Path) -> None:
    """Raise ProjectError for lights without visible light, before anything is rendered."""
    problems = light_errors(scene)
    if problems:
        raise ProjectError(summary(str(file), problems), tuple(problems))


def _flare(
    camera: SceneCamera, light: SceneLight, diameter_deg: float, distance_m: float | None, *, quality: str, shown: bool,
    threads: int | None,
) -> tuple[Flare, Frame]:  # fmt: skip
    """Build a flare; errors name the camera."""
    try:
        return scene_flare(camera, light, diameter_deg, distance_m, quality=quality, shown=shown, threads=threads)
    except FlarewrightError as error:
        raise ProjectError(f"camera {camera.name}: {error}") from None


def _prepare(scene: Scene, threads: int | None, prepare: Callable[[Project, int | None], None]) -> None:
    camera = next((each for each in scene.cameras if each.lens is not None), None)
    if camera is None:
        return
    try:
        prepare(camera_project(camera, scene.lights[0], 0.0), threads)
    except FlarewrightError as error:
        raise ProjectError(f"camera {camera.name}: {error}") from None


def _glare(
    scene: Scene, camera: SceneCamera, work: Callable[..., VeilingGlare], progress: Callable[[str], Progress]
) -> VeilingGlare | None:
    if camera.lens is None:
        return None
    shown = progress(f"veiling glare of {camera.name}")
    return work(camera_project(camera, scene.lights[0], 0.0), D_LINE_NM, progress=shown)
