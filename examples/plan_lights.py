"""Plan a scene in Python: which of two cameras has less flare while a lamp swings across.

Usage: python plan_lights.py
"""

from functools import partial

import numpy as np

from flarewright.model.project.scene import Scene
from flarewright.predict.plan import plan_scene, ranking
from flarewright.predict.switching import choose_cameras
from flarewright.workflow.lens_flares import scene_flare

SCENE = {
    "luminance_cd_m2": (1.0, 500.0),
    "time": {"duration_s": 20.0, "step_s": 4.0},
    "cameras": [
        {"name": "left", "lens": "heliar-tronnier", "position_m": (-4.0, -12.0, 2.0), "aim_m": (0.0, 0.0, 2.0)},
        {"name": "right", "lens": "heliar-tronnier", "position_m": (4.0, -12.0, 2.0), "aim_m": (0.0, 0.0, 2.0)},
    ],
    "lights": [
        {
            "kind": "lamp",
            "name": "lamp",
            "position_m": (-5.0, 6.0, 4.0),
            "intensity_cd": 50000.0,
            "keyframes": [{"at_s": 20.0, "position_m": (5.0, 6.0, 4.0)}],
        }
    ],
}


def main() -> None:
    """Print the ranking and the order of shots."""
    scene = Scene.model_validate(SCENE)
    maker = partial(scene_flare, quality="draft", shown=False, threads=None)
    plan = plan_scene(scene, maker, lambda _name: lambda _part, _words: None)
    for one in ranking(plan):
        camera, light = scene.cameras[one.camera].name, scene.lights[one.light].name
        print(f"{light} in {camera}: mean veil {one.mean_veil_cd_m2:.3g} cd/m2, worst {one.worst_veil_cd_m2:.3g}")
    veils = [plan.veil(camera) for camera in range(len(scene.cameras))]
    for shot in choose_cameras(np.array(veils), plan.times_s, 0.0):
        first, until = plan.times_s[shot.first], plan.times_s[shot.until]
        print(f"{first:g} to {until:g} s: {scene.cameras[shot.camera].name}")


if __name__ == "__main__":
    main()
