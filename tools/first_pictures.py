"""What a first picture of each shipped lens looks like, in numbers: how colourful it is, and how it is exposed.

    python tools/first_pictures.py           # as the library shows it: the lens as photographed
    python tools/first_pictures.py --ideal   # bare glass, wide open, a point light, straight blades

Figures of docs/colour.md. The spread is the largest minus the smallest mean channel of the picture, in codes of 255;
the hue is that of the mean, degrees from red over green to blue.
"""

from __future__ import annotations

import argparse
import colorsys
import sys

import numpy as np

from flarewright.io.lens.library import library_names
from flarewright.model import Bare, Everywhere, Project
from flarewright.render.gallery import card_project, lens_card
from flarewright.render.image.display import layers_exposure, view
from flarewright.render.render import render

SIZE_PX = (480, 270)


def plain(project: Project) -> Project:
    """Return the same light through the lens as science wants it."""
    (light,) = project.lights
    return Project(
        lens=project.lens, lights=(light.replace(diameter_deg=0.0),), camera=project.camera, zoom=project.zoom,
        coating=Everywhere(coating=Bare()),
    )  # fmt: skip


def main() -> int:
    """Print a row for each lens, and the median."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ideal", action="store_true")
    ideal = parser.parse_args().ideal
    print("| lens | mean R, G, B | spread | hue | exposure, stops | white |\n|---|---|---|---|---|---|")
    spreads = []
    for name in library_names():
        project = card_project(lens_card(name), SIZE_PX)
        layers = render(plain(project) if ideal else project).layers
        stops = layers_exposure(layers)
        codes = view(layers[0].pixels, stops)
        mean = codes.mean(axis=(0, 1))
        spreads.append(float(np.ptp(mean)))
        hue = 360.0 * colorsys.rgb_to_hsv(*mean.tolist())[0]
        white = (codes.min(axis=2) == 255).mean()
        means = ", ".join(f"{one:.0f}" for one in mean)
        print(f"| {name} | {means} | {spreads[-1]:.0f} | {hue:.0f} | {stops:.1f} | {white:.2%} |", flush=True)
    print(f"| median | | {np.median(spreads):.0f} | | | |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
