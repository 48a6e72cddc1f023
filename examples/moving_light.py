"""Render a sequence: a light crosses the picture, one EXR per frame.

Usage: python moving_light.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import flarewright as fw

FRAMES = 5


def main(folder: Path) -> None:
    """Write flare.0001.exr and so on into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    project = fw.Project(
        lens="heliar-tronnier",
        f_number=5.6,
        lights=[fw.Light(field_deg=(0.0, 0.0), spectrum=fw.BlackBody(temperature_k=5600.0))],
        coating=fw.Preset(name="thesis"),
        camera=fw.Camera(size_px=(320, 180)),
        quality=fw.Quality(wavelengths=3),
    )
    for frame in range(FRAMES):
        part = frame / (FRAMES - 1)
        light = project.lights[0].replace(field_deg=(-8.0 + 16.0 * part, 4.0))
        rendering = fw.render(project.replace(lights=[light]))
        path = folder / f"flare.{frame + 1:04d}.exr"
        fw.write_exr(
            path,
            rendering.layers,
            project.camera.size_px,
            scale=fw.exr_scale(project),
            metadata={"frame": str(frame + 1)},
        )
        x, y = rendering.summary["lights"][0]["direct_position_mm"]
        print(f"{path.name}: light at {light.field_deg[0]:+.1f} degrees, its image at {x:+.2f}, {y:+.2f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
