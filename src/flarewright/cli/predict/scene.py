"""`flarewright predict SCENE.toml`: the flare of all lights in all cameras of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import FlarewrightError, ProjectError, naming
from ..common import console, print_json, print_remark, print_remarks, progress_bar, remembered

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...model.project.scene import Scene
    from ...predict.plan import Plan, Ranked
    from ...predict.search import BestPosition
    from ...predict.switching import Shot
    from ...predict.worst import Worst
    from ...render.scattering.veiling_glare import VeilingGlare
    from .options.record import PredictOptions


@dataclass(frozen=True)
class SearchRoom:
    """Where another position of a camera is searched, and the shortest time between two switches of cameras."""

    radius_m: float
    height_m: float
    shortest_shot_s: float


def is_scene_file(subject: str) -> bool:
    """Return whether an argument names a scene file."""
    from ...errors import FileError
    from ...io.files.text_file import read_toml

    path = Path(subject)
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        data = read_toml(path, "a scene file")
    except FileError:
        return False
    return "rows" not in data and bool({"cameras", "lights"} & data.keys()) and "lens" not in data


def predict_scene(path: Path, options: PredictOptions, room: SearchRoom, unnamed: str) -> None:
    """Predict a scene and print its ranking.

    Parameters
    ----------
    path : Path
    options : PredictOptions
    room : SearchRoom
    unnamed : str
        Text that identifies the command, for the place of its partial work without an output.
    """
    from ...io.project.scene_file import read_scene
    from ...predict.plan import plan_scene, ranking
    from ...predict.scene_data import scene_data
    from ...predict.search import best_position
    from ...predict.worst import render_worst
    from ...workflow.flare_pictures import pictures_elsewhere

    scene = read_scene(path)
    _refuse_dark(path, scene)
    camera = None if options.near is None else _camera_number(scene, options.near)
    maker = partial(_named, quality=options.quality or "final", threads=options.threads)
    folder = Path() if options.output is None else options.output.parent
    # pictures are kept until the page is written
    with (
        pictures_elsewhere(options.cluster, options.processes, options.threads, folder, print_remark) as spread,
        remembered(options.cache, options.output, unnamed) as memory,
    ):
        with naming(path):
            _compile(scene, options.threads)
        with progress_bar() as reported:
            with naming(path):
                plan = plan_scene(scene, partial(maker, shown=False), reported, memory, spread)
            ranked = ranking(plan)
            found = None
            if camera is not None:
                found = best_position(plan, camera, room.radius_m, room.height_m, reported("position"), spread)
            worst: list[Worst] = []
            if options.output is not None:
                worst = render_worst(plan, ranked, partial(maker, shown=True), reported("pictures"), memory, spread)
        shots = _shots(plan, room.shortest_shot_s)
        glare = [_glare(plan, c, options.threads) if options.glare else None for c in range(len(scene.cameras))]
        print_remarks(plan.remarks)
        if options.output is not None:
            from ...predict.scene_page import scene_page
            from ..common import write_text

            write_text(options.output, scene_page(plan, ranked, shots, found, worst))
    if options.as_json:
        data = scene_data(plan, ranked, shots, found, worst, glare)
        print_json({**data, **({} if options.output is None else {"report": str(options.output)})})
        return
    _print(plan, ranked, shots, found)
    for one, veil in zip(scene.cameras, glare, strict=True):
        if veil is not None:
            console().print(f"{one.name}: veiling glare index {veil.index:.3%} at {veil.wavelength_nm:g} nm")
    if options.output is not None:
        print_remarks([f"wrote {options.output}"])


def _camera_number(scene: Scene, name: str) -> int:
    from ...io.files.sentences import did_you_mean

    names = [camera.name for camera in scene.cameras]
    if name not in names:
        raise ProjectError(f"--near {name!r} is no camera of the scene{did_you_mean(name, names)}; it has {names}")
    return names.index(name)


def _refuse_dark(path: Path, scene: Scene) -> None:
    """Raise an error for lights without visible light, before anything is rendered."""
    from ...io.files.sentences import summary
    from ...workflow.scene_check import light_errors

    problems = light_errors(scene)
    if problems:
        raise ProjectError(summary(str(path), problems), tuple(problems))


def _named(camera: Any, light: Any, diameter_deg: float, distance_m: float | None, **how: Any) -> Any:
    """Build a flare; errors name the camera."""
    from ...workflow.lens_flares import scene_flare

    try:
        return scene_flare(camera, light, diameter_deg, distance_m, **how)
    except FlarewrightError as error:
        raise ProjectError(f"camera {camera.name}: {error}") from None


def _compile(scene: Scene, threads: int | None) -> None:
    from ...render.warmup import compile_for_render
    from ...workflow.lens_flares import camera_project

    for camera in scene.cameras:
        if camera.lens is not None:
            try:
                compile_for_render(camera_project(camera, scene.lights[0], 0.0), threads)
            except FlarewrightError as error:
                raise ProjectError(f"camera {camera.name}: {error}") from None
            return


def _shots(plan: Plan, shortest_s: float) -> Sequence[Shot]:
    """Choose the camera over time, for several cameras."""
    import numpy as np

    from ...predict.switching import choose_cameras

    return choose_cameras(np.stack([plan.veil(c) for c in range(len(plan.tracks))]), plan.times_s, shortest_s)


def _glare(plan: Plan, c: int, threads: int | None) -> VeilingGlare | None:
    from ...optics.lens.paraxial import D_LINE_NM
    from ...render.scattering.veiling_glare import veiling_glare
    from ...workflow.lens_flares import camera_project

    camera = plan.scene.cameras[c]
    if camera.lens is None:
        return None
    return veiling_glare(camera_project(camera, plan.scene.lights[0], 0.0), D_LINE_NM, threads=threads)


def _print(plan: Plan, ranked: Sequence[Ranked], shots: Sequence[Shot], found: BestPosition | None) -> None:
    from rich.table import Table

    from ...predict.scene_data import found_words, time_words, unknown_share
    from ...render.plots.chart import number

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
        doubt = f", its flare unknown in {unknown:.0%} of the times" if unknown else ""
        console().print(f"{time_words(plan, shot.first)} to {time_words(plan, shot.until)}: {camera}{doubt}")
    if found is not None:
        console().print(found_words(plan, found))
