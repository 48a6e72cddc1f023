"""Render one shot through the same lens with different coatings, and print the ghost light of each.

Usage: python compare_coatings.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import flarewright as fw

COATINGS = {
    "bare": fw.Everywhere(coating=fw.Bare()),
    "single": fw.Everywhere(coating=fw.QuarterWave(center_wavelength_nm=550)),
    # two quarter waves that extinguish the reflection of glass of index 1.52 at 550 nm
    "double": fw.Everywhere(
        coating=fw.Stack(layers=(fw.Film(index=1.38, thickness_nm=99.6), fw.Film(index=1.70, thickness_nm=80.9)))
    ),
    "staggered": fw.Preset(name="staggered"),
    "1970s": fw.Everywhere(coating=fw.Standard(name="early-multicoat")),
    "modern": fw.Everywhere(coating=fw.Standard(name="modern-broadband")),
}


def main(folder: Path) -> None:
    """Write one EXR for each coating into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    project = fw.Project(
        lens="canon-28-80",
        f_number=8.0,
        iris=fw.Iris(blades=6),
        lights=[fw.Light(field_deg=(10.0, 6.0))],
        camera=fw.Camera(size_px=(320, 180)),
        quality=fw.Quality(mode="draft", wavelengths=7),
    )
    for name, coating in COATINGS.items():
        rendering = fw.render(project.replace(coating=coating))
        fw.write_exr(folder / f"{name}.exr", rendering.layers, (320, 180), metadata={"coating": name})
        ghosts = next(layer for layer in rendering.layers if layer.name == "ghosts")
        red, green, blue = ghosts.pixels.sum(axis=(0, 1)) / (320 * 180)
        through = rendering.summary["lights"][0]["transmittance"]
        print(f"{name:9s}: lens passes {through:.1%}; mean ghost light {red:.2e} {green:.2e} {blue:.2e}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
