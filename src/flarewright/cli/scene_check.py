"""`flarewright scene check`: whether a scene file can be planned."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import naming
from .common import print_json, refused_as_json


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A scene file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a scene, and tell every mistake at once; exit code 2 when it cannot be planned."""
    from ..io.project_file import ProjectFileError
    from ..io.scene_file import read_scene
    from ..io.sentences import count, summary
    from ..predict.tracks import camera_track, moments, sightings
    from .scene_cameras import camera_mistakes, light_mistakes

    with refused_as_json(file, as_json), naming(file):
        scene = read_scene(file)
        times, dates = moments(scene)
        tracks = [camera_track(one, times, f"cameras[{c}] ({one.name})") for c, one in enumerate(scene.cameras)]
        problems = light_mistakes(scene) + camera_mistakes(file, scene, sightings(scene, tracks, times, dates))
        if problems:
            raise ProjectFileError(summary(str(file), problems), tuple(problems))
    if as_json:
        facts = {"cameras": len(scene.cameras), "lights": len(scene.lights), "times": len(times)}
        print_json({"file": str(file), "usable": True, "scene": scene.name, **facts})
        return
    told = ((scene.cameras, "camera"), (scene.lights, "light"), (times, "time"))
    print(f"{file}: usable, {', '.join(count(len(each), noun) for each, noun in told)}")
