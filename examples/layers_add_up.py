"""Render one layer per ghost and add them: light adds, so the difference is rounding only.

Usage: python layers_add_up.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import flarewright as fw
from flarewright.render.image.compose import beauty


def main(folder: Path) -> None:
    """Write ghosts.exr into a folder and check the sums of its layers."""
    folder.mkdir(parents=True, exist_ok=True)
    size = (320, 180)
    project = fw.Project(
        lens="triplet-pestrecov",
        f_number=5.6,
        iris=fw.Iris(blades=6),
        lights=[fw.Light(field_deg=(6.0, 3.0))],
        camera=fw.Camera(size_px=size),
        quality=fw.Quality(wavelengths=3),
        output=fw.Output(layers="ghosts"),
    )
    rendering = fw.render(project)
    fw.write_exr(folder / "ghosts.exr", rendering.layers, size, pixel_type="float", metadata={})
    layers = {layer.name: layer for layer in rendering.layers}
    singles = [layer for name, layer in layers.items() if name.startswith("ghost.")]
    # a single ghost's pixels cover its window only; beauty() puts every layer in its place
    for name, parts in (("ghosts", singles), ("beauty", [layers["starburst"], layers["ghosts"]])):
        total = beauty(parts, size).pixels
        whole = beauty([layers[name]], size).pixels
        off = float(np.abs(total - whole).max() / np.abs(whole).max())
        print(f"{len(parts)} layers add up to {name!r} within {off:.1e} of its brightest pixel")
        if off > 1e-5:
            sys.exit(f"the layers do not add up to {name!r}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
