"""`flarewright predict SCENE.toml`: the flare of all lights in all cameras of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import ProjectError
from ..common import console, print_json, print_remark, print_remarks, progress_bar, remembered, write_text
from ..render.kept_glare import kept_glare

if TYPE_CHECKING:
    from ...model.project.scene import Scene
    from ...workflow.scene_prediction import NearbySearch, ScenePrediction
    from .options.record import PredictOptions


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


def predict_and_print(path: Path, options: PredictOptions, unnamed: str) -> None:
    """Predict a scene and print its ranking.

    Parameters
    ----------
    path : Path
    options : PredictOptions
    unnamed : str
        Text that identifies the command, for the place of its partial work without an output.
    """
    from ...io.project.scene_file import read_scene
    from ...render.warmup import compile_for_render
    from ...workflow.scene_prediction import predict_scene, refuse_dark

    scene = read_scene(path)
    # before partial work of an earlier command is read
    refuse_dark(scene, path)
    near, folder = _nearby(scene, options), Path() if options.output is None else options.output.parent
    # pictures are kept until the page is written
    with remembered(options.cache, options.output, unnamed) as memory:
        with progress_bar() as progress:
            found = predict_scene(
                scene, file=path, quality=options.quality or "final", near=near,
                shortest_shot_s=options.shortest_shot or 0.0, pictures=options.output is not None, glare=options.glare,
                glare_of=kept_glare,
                memory=memory, threads=options.threads, processes=options.processes, cluster=options.cluster,
                folder=folder, prepare=compile_for_render, progress=progress, announce=print_remark,
            )  # fmt: skip
        print_remarks(found.plan.remarks)
        if options.output is not None:
            write_text(options.output, found.page())
    if options.as_json:
        print_json({**found.as_data(), **({} if options.output is None else {"report": str(options.output)})})
        return
    _print(found)
    if options.output is not None:
        print_remarks([f"wrote {options.output}"])


def _nearby(scene: Scene, options: PredictOptions) -> NearbySearch | None:
    """Return the search for a position that `--near` asks for."""
    from ...sentences import did_you_mean
    from ...workflow.scene_prediction import NearbySearch

    if options.near is None:
        return None
    names = [camera.name for camera in scene.cameras]
    if options.near not in names:
        raise ProjectError(
            f"--near {options.near!r} is no camera of the scene{did_you_mean(options.near, names)}; it has {names}"
        )
    return NearbySearch(
        names.index(options.near), 5.0 if options.radius is None else options.radius, options.height or 0.0
    )


def _print(found: ScenePrediction) -> None:
    from rich.table import Table

    from ...predict.scene_data import found_words, time_words, unknown_share
    from ...render.plots.chart import number

    plan, scene = found.plan, found.plan.scene
    out = Table(title=f"{scene.name}: flare as luminance of the scene, cd/m²")
    for column in ("camera", "light"):
        out.add_column(column)
    for column in ("mean veil", "worst", "at", "degrees", "contrast left"):
        out.add_column(column, justify="right")
    for one in found.ranked[:20]:
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
    for shot in found.shots:
        camera, unknown = scene.cameras[shot.camera].name, unknown_share(plan, shot)
        doubt = f", its flare unknown in {unknown:.0%} of the times" if unknown else ""
        console().print(f"{time_words(plan, shot.first)} to {time_words(plan, shot.until)}: {camera}{doubt}")
    if found.found is not None:
        console().print(found_words(plan, found.found))
    for seen, veil in zip(scene.cameras, found.glare, strict=True):
        if veil is not None:
            console().print(f"{seen.name}: veiling glare index {veil.index:.3%} at {veil.wavelength_nm:g} nm")
