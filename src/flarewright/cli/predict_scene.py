"""`flarewright predict SCENE.toml`: the flare of all lights in all cameras of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FlarewrightError, ProjectError, naming
from .common import console, print_json, progress_bar, remembered, tell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..model.scene import Scene
    from ..predict.plan import Plan, Ranked
    from ..predict.search import Found
    from ..predict.switching import Shot
    from ..predict.worst import Worst
    from ..render.glare import VeilingGlare


@dataclass(frozen=True)
class SceneWishes:
    """What the command line asks of a scene."""

    output: Path | None
    quality: str
    near: str | None
    radius_m: float
    height_m: float
    shortest_shot_s: float
    glare: bool
    threads: int | None
    as_json: bool
    cache: Path | None = None


def is_scene(subject: str) -> bool:
    """Whether a word on the command line names a scene file."""
    import tomllib

    path = Path(subject)
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        data = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError):
        return False
    return "rows" not in data and bool({"cameras", "lights"} & data.keys()) and "lens" not in data


def predict_scene(path: Path, wishes: SceneWishes) -> None:
    """Plan a scene and tell its ranking.

    Parameters
    ----------
    path : Path
    wishes : SceneWishes
    """
    from ..io.scene_file import read_scene
    from ..predict.plan import plan_scene, ranking
    from ..predict.scene_data import scene_data
    from ..predict.search import best_position
    from ..predict.worst import render_worst

    scene = read_scene(path)
    _refuse_dark(path, scene)
    camera = None if wishes.near is None else _camera_number(scene, wishes.near)
    maker = partial(_named, quality=wishes.quality, threads=wishes.threads)
    with naming(path):
        _compile(scene, wishes.threads)
    with progress_bar() as told, remembered(wishes.cache, wishes.output) as memory:
        with naming(path):
            plan = plan_scene(scene, partial(maker, shown=False), told, memory)
        ranked = ranking(plan)
        found = None
        if camera is not None:
            found = best_position(plan, camera, wishes.radius_m, wishes.height_m, told("position"))
        worst: list[Worst] = []
        if wishes.output is not None:
            worst = render_worst(plan, ranked, partial(maker, shown=True), told("pictures"))
    shots = _shots(plan, wishes.shortest_shot_s)
    glare = [_glare(plan, c, wishes.threads) if wishes.glare else None for c in range(len(scene.cameras))]
    tell(plan.remarks)
    if wishes.output is not None:
        from ..predict.scene_page import scene_page
        from .common import write_text

        write_text(wishes.output, scene_page(plan, ranked, shots, found, worst))
    if wishes.as_json:
        data = scene_data(plan, ranked, shots, found, worst, glare)
        print_json({**data, **({} if wishes.output is None else {"report": str(wishes.output)})})
        return
    _print(plan, ranked, shots, found)
    for one, veil in zip(scene.cameras, glare, strict=True):
        if veil is not None:
            console().print(f"{one.name}: veiling glare index {veil.index:.3%} at {veil.wavelength_nm:g} nm")
    if wishes.output is not None:
        tell([f"wrote {wishes.output}"])


def _camera_number(scene: Scene, name: str) -> int:
    from ..io.sentences import did_you_mean

    names = [camera.name for camera in scene.cameras]
    if name not in names:
        raise ProjectError(f"--near {name!r} is no camera of the scene{did_you_mean(name, names)}; it has {names}")
    return names.index(name)


def _refuse_dark(path: Path, scene: Scene) -> None:
    """Refuse lights without visible light, by their places, before anything is drawn."""
    from ..io.project_file import ProjectFileError
    from ..io.sentences import summary
    from .scene_cameras import light_mistakes

    problems = light_mistakes(scene)
    if problems:
        raise ProjectFileError(summary(str(path), problems), tuple(problems))


def _named(camera: Any, light: Any, diameter_deg: float, distance_m: float | None, **how: Any) -> Any:
    """Build a flare, and say of what camera a mistake is."""
    from .predict_flares import scene_flare

    try:
        return scene_flare(camera, light, diameter_deg, distance_m, **how)
    except FlarewrightError as error:
        raise ProjectError(f"camera {camera.name}: {error}") from None


def _compile(scene: Scene, threads: int | None) -> None:
    from ..render.first_run import compile_for_render
    from .predict_flares import camera_project

    for camera in scene.cameras:
        if camera.lens is not None:
            try:
                compile_for_render(camera_project(camera, scene.lights[0], 0.0), threads)
            except FlarewrightError as error:
                raise ProjectError(f"camera {camera.name}: {error}") from None
            return


def _shots(plan: Plan, shortest_s: float) -> Sequence[Shot]:
    """Find which camera when, for several cameras over time."""
    import numpy as np

    from ..predict.switching import shots_of

    return shots_of(np.stack([plan.veil(c) for c in range(len(plan.tracks))]), plan.times_s, shortest_s)


def _glare(plan: Plan, c: int, threads: int | None) -> VeilingGlare | None:
    from ..optics.paraxial import D_LINE_NM
    from ..render.glare import veiling_glare
    from .predict_flares import camera_project

    camera = plan.scene.cameras[c]
    if camera.lens is None:
        return None
    return veiling_glare(camera_project(camera, plan.scene.lights[0], 0.0), D_LINE_NM, threads=threads)


def _print(plan: Plan, ranked: Sequence[Ranked], shots: Sequence[Shot], found: Found | None) -> None:
    from rich.table import Table

    from ..predict.scene_data import found_words, time_words, unknown_share
    from ..render.chart import number

    scene = plan.scene
    out = Table(title=f"{scene.name}: flare as luminance of the scene, cd/m²")
    for column in ("camera", "light"):
        out.add_column(column)
    for column in ("mean veil", "worst", "at", "degrees", "contrast left"):
        out.add_column(column, justify="right")
    for one in ranked[:20]:
        names = scene.cameras[one.camera].name, scene.lights[one.light].name
        if one.worst is None or one.mean_veil_cd_m2 is None or one.worst_veil_cd_m2 is None:
            out.add_row(*names, "not known", *["-"] * 4)
            continue
        left = "-" if one.contrast_left is None else f"{one.contrast_left:.1%}"
        out.add_row(
            *names, number(one.mean_veil_cd_m2), number(one.worst_veil_cd_m2), time_words(plan, one.worst),
            f"{one.worst_constellation_deg:.1f}", left,
        )  # fmt: skip
    console().print(out)
    for shot in shots:
        camera, unknown = scene.cameras[shot.camera].name, unknown_share(plan, shot)
        doubt = f", its flare not known in {unknown:.0%} of the times" if unknown else ""
        console().print(f"{time_words(plan, shot.first)} to {time_words(plan, shot.until)}: {camera}{doubt}")
    if found is not None:
        console().print(found_words(plan, found))
