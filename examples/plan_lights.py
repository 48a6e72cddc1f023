"""Plan a scene in Python: which of two cameras has less flare while a lamp swings across.

Usage: python plan_lights.py
"""

from flarewright.model.project.scene import Scene
from flarewright.workflow import predict_scene

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
    found = predict_scene(scene, quality="draft")
    for one in found.ranked:
        camera, light = scene.cameras[one.camera].name, scene.lights[one.light].name
        print(f"{light} in {camera}: mean veil {one.mean_veil_cd_m2:.3g} cd/m2, worst {one.worst_veil_cd_m2:.3g}")
    times = found.plan.times_s
    for shot in found.shots:
        print(f"{times[shot.first]:g} to {times[shot.until]:g} s: {scene.cameras[shot.camera].name}")


if __name__ == "__main__":
    main()
