"""How far the colours of few traced wavelengths are from 61 exact lines, channel by channel.

    python tools/colour_errors.py            # the table of docs/colour.md; needs colour-science (.[dev])

Ghosts that carry more than a thousandth of the brightest are compared by their sums, whole pictures of 240 x 135 pixels
by CIEDE2000, exposed so that their brightest parts are nearly white.
"""

from __future__ import annotations

import sys

import colour
import numpy as np
from numpy.typing import NDArray

from flarewright.model import (
    D65,
    AsLens,
    Camera,
    CoatingChoice,
    Everywhere,
    Light,
    Lines,
    Output,
    Project,
    Quality,
    QuarterWave,
    Standard,
)
from flarewright.model.light import Spectrum
from flarewright.optics.spectrum import VISIBLE_NM, spectral_power
from flarewright.render.render import render

LINES_NM = np.linspace(*VISIBLE_NM, 61)
QUARTER = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
BROADBAND, EARLY, SINGLE = (
    Everywhere(coating=Standard(name=name)) for name in ("modern-broadband", "early-multicoat", "single-1950s")
)
SCENES: tuple[tuple[str, str, CoatingChoice, tuple[float, float], float], ...] = (
    ("flektogon-35", "modern-broadband", BROADBAND, (10.0, 5.0), 8.0),
    ("canon-70-200", "modern-broadband", BROADBAND, (6.0, 3.0), 5.6),
    ("nikon-28-75", "modern-broadband", BROADBAND, (12.0, -6.0), 8.0),
    ("angenieux-50-f1.1", "modern-broadband", BROADBAND, (4.0, 4.0), 4.0),
    ("triplet-pestrecov", "early-multicoat", EARLY, (8.0, 4.0), 5.6),
    ("biotar-50-f1.4", "early-multicoat", EARLY, (9.0, 6.0), 4.0),
    ("heliar-tronnier", "single-1950s", SINGLE, (8.0, 4.0), 5.6),
    ("nikkor-85-f1.4", "quarter-wave:550", QUARTER, (5.0, 2.0), 4.0),
    ("takumar-50-f1.4", "bare", AsLens(), (-9.0, 5.0), 4.0),
)

Floats = NDArray[np.float64]


def pictures(
    lens: str, coating: CoatingChoice, field: tuple[float, float], f_number: float, spectrum: Spectrum, count: int,
    mode: str,
) -> dict[str, Floats]:  # fmt: skip
    """Render every ghost as a layer of its own."""
    project = Project(
        lens=lens, coating=coating, f_number=f_number, lights=(Light(field_deg=field, spectrum=spectrum),),
        camera=Camera(size_px=(240, 135)), quality=Quality(mode=mode, wavelengths=count, ringing="off"),
        output=Output(layers="ghosts", starburst=False),
    )  # fmt: skip
    return {layer.name: layer.pixels.astype(np.float64) for layer in render(project).layers}


def seen(pixels: Floats, gain: float) -> Floats:
    """Return CIE Lab under D65."""
    xyz = np.maximum(gain * pixels @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T, 0.0)
    lab: Floats = colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])
    return lab


def main() -> int:
    """Print the table."""
    power = spectral_power(D65(), LINES_NM)
    lines = Lines(lines=tuple(zip(LINES_NM.tolist(), power.tolist(), strict=True)))
    print("| lens, coating | quality, wavelengths | ghosts | median | 95 % | worst | picture: median | 99 % |")
    print("|---|---|---|---|---|---|---|---|")
    for lens, told, *scene in SCENES:
        for mode, count in (("final", 7), ("draft", 3)):
            exact = pictures(lens, *scene, lines, len(LINES_NM), mode)  # type: ignore[arg-type]
            found = pictures(lens, *scene, D65(), count, mode)  # type: ignore[arg-type]
            sums = {name: rgb.sum(axis=(0, 1)) for name, rgb in exact.items() if name.startswith("ghost.")}
            least = 1e-3 * max(float(np.abs(rgb).max()) for rgb in sums.values())
            off = [
                float(np.abs(found[name].sum(axis=(0, 1)) - rgb).max() / np.abs(rgb).max())
                for name, rgb in sums.items()
                if np.abs(rgb).max() > least
            ]
            gain = 0.9 / float(np.quantile(exact["beauty"].max(axis=2), 0.995))
            far = colour.delta_E(seen(exact["beauty"], gain), seen(found["beauty"], gain), method="CIE 2000")
            print(
                f"| {lens}, {told} | {mode}, {count} | {len(off)} | {np.median(off):.2%} "
                f"| {np.quantile(off, 0.95):.2%} | {max(off):.2%} "
                f"| {np.median(far):.2f} | {np.quantile(far, 0.99):.2f} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
