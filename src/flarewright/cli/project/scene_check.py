"""`flarewright scene check`: check whether a scene file can be used."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...errors import ProjectError, naming
from ..common import errors_as_json, print_json
from ..shared_options import Json


def check(file: Annotated[Path, typer.Argument(metavar="FILE", help="A scene file.")], as_json: Json = False) -> None:
    """Check a scene, and list all errors; exit code 2 if it cannot be used."""
    from ...io.project.scene_file import read_scene
    from ...predict.tracks import camera_track, moments, sightings
    from ...sentences import count, summary
    from ...workflow.scene_check import camera_errors, light_errors

    with errors_as_json(file, as_json), naming(file):
        scene = read_scene(file)
        times, dates = moments(scene)
        tracks = [camera_track(one, times, f"cameras[{c}] ({one.name})") for c, one in enumerate(scene.cameras)]
        problems = light_errors(scene) + camera_errors(file, scene, sightings(scene, tracks, times, dates))
        if problems:
            raise ProjectError(summary(str(file), problems), tuple(problems))
    if as_json:
        facts = {"cameras": len(scene.cameras), "lights": len(scene.lights), "times": len(times)}
        print_json({"file": str(file), "usable": True, "scene": scene.name, **facts})
        return
    counted = ((scene.cameras, "camera"), (scene.lights, "light"), (times, "time"))
    print(f"{file}: usable, {', '.join(count(len(each), noun) for each, noun in counted)}")
