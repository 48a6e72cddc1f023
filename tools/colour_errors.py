"""Colour errors of few traced wavelengths compared with exact lines: 61 in final quality, 480 in drafts.

    python tools/colour_errors.py            # the tables of docs/colour.md; needs colour-science (.[dev])

Ghosts with more than a thousandth of the brightest one's light are compared by their sums per channel, whole pictures
of 240 x 135 pixels by CIEDE2000, exposed so that their brightest parts are nearly white. Lines of final quality lie
7 nm apart, those of drafts 1 nm, because a draft's light ends abruptly. Drafts of ghosts that seem more than 2 % off
are compared again with 8 times as many lines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import Any

import colour
import numpy as np
from numpy.typing import NDArray

from flarewright.kernels.raster.polygons import sum_rows
from flarewright.model import (
    D65,
    AsLens,
    BlackBody,
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
from flarewright.model.project.light import Spectrum
from flarewright.optics.colour.cie1931 import cie_1931
from flarewright.optics.colour.spectrum import VISIBLE_NM, spectral_power
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts.paraxial_ghosts import draw_draft
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

LINES_NM = np.linspace(*VISIBLE_NM, 61)
# midpoints of equal cells over all that the eye sees: a candle's light beyond 780 nm, where films reflect most, counts;
# rendered in parts, because a project has at most 81 wavelengths
COMBS, MORE = 8, 8
TEMPERATURES_K = (2000.0, 2856.0, 9000.0)
OFF = 0.02
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


def project_of(
    lens: str, coating: CoatingChoice, field: tuple[float, float], f_number: float, spectrum: Spectrum, count: int,
    mode: str,
) -> Project:  # fmt: skip
    """Return a scene with a layer for each ghost."""
    return Project(
        lens=lens, coating=coating, f_number=f_number, lights=(Light(field_deg=field, spectrum=spectrum),),
        camera=Camera(size_px=(240, 135)), quality=Quality(mode=mode, wavelengths=count, ringing="off"),
        output=Output(layers="ghosts", starburst=False),
    )  # fmt: skip


def pictures(project: Project) -> dict[str, Floats]:
    """Render a scene; return the beauty, (H, W, 3), and the sum of each ghost, (3,)."""
    layers = {layer.name: layer.pixels.astype(np.float64) for layer in render(project).layers}
    return {name: pixels if name == "beauty" else pixels.sum(axis=(0, 1)) for name, pixels in layers.items()}


def lines(spectrum: Spectrum, nm: Floats) -> Lines:
    """Return lines with the power of a spectrum."""
    return Lines(lines=tuple(zip(nm.tolist(), spectral_power(spectrum, nm).tolist(), strict=True)))


def parts(spectrum: Spectrum, count: int) -> Iterator[tuple[float, Lines]]:
    """Split the light at the middles of equal cells into lines, with the part of its luminance that each set has."""
    nm = 360.0 + 470.0 * (np.arange(60 * count) + 0.5) / (60 * count)
    light = cie_1931(nm)[:, 1] * spectral_power(spectrum, nm)
    for k in range(count):
        yield light[k::count].sum() / light.sum(), lines(spectrum, nm[k::count])


def dense_drafts(scene: tuple[Any, ...], spectrum: Spectrum) -> dict[str, Floats]:
    """Render drafts at 480 lines."""
    total: dict[str, Floats] = {}
    for share, few in parts(spectrum, COMBS):
        for name, rgb in pictures(project_of(*scene, few, len(few.lines), "draft")).items():
            total[name] = total.get(name, 0.0) + share * rgb
    return total


def denser_drafts(scene: tuple[Any, ...], spectrum: Spectrum, names: Sequence[str]) -> dict[str, Floats]:
    """Draw some ghosts alone, at 3840 lines; return their sums."""
    total = {name: np.zeros(3) for name in names}
    if not total:
        return total
    for share, few in parts(spectrum, MORE * COMBS):
        project = resolve_project(project_of(*scene, few, len(few.lines), "draft"))
        (shot,) = make_shots(project, make_opening(project, None))
        for path in ghost_paths(project.lens):
            if (name := f"ghost.{path.name}") in total:
                picture = np.zeros((135, 240, 3))
                draw_draft(shot, [path], picture)
                sum_rows(picture, picture)
                # flux per mm^2 of a pixel, as in layers
                total[name] += share * shot.to_pixels[2] * shot.to_pixels[3] * picture.sum(axis=(0, 1))
    return total


def errors(exact: dict[str, Floats], found: dict[str, Floats]) -> dict[str, float]:
    """Return the errors of all ghosts that count, as parts of their largest channels."""
    sums = {name: rgb for name, rgb in exact.items() if name.startswith("ghost.")}
    least = 1e-3 * max(float(np.abs(rgb).max()) for rgb in sums.values())
    return {
        name: float(np.abs(found[name] - rgb).max() / np.abs(rgb).max())
        for name, rgb in sums.items()
        if np.abs(rgb).max() > least
    }


def compare_drafts(scene: tuple[Any, ...], spectrum: Spectrum) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return drafts at many lines and at three wavelengths."""
    exact, found = dense_drafts(scene, spectrum), pictures(project_of(*scene, spectrum, 3, "draft"))
    return exact | denser_drafts(scene, spectrum, off_by_more(errors(exact, found))), found


def off_by_more(off: dict[str, float]) -> list[str]:
    """Return the ghosts that are more than 2 % off."""
    return [name for name, one in off.items() if one > OFF]


def seen(pixels: Floats, gain: float) -> Floats:
    """Return CIE Lab under D65."""
    xyz = np.maximum(gain * pixels @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T, 0.0)
    lab: Floats = colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])
    return lab


def main() -> int:
    """Print the tables."""
    print("| lens, coating | quality, wavelengths | ghosts | median | 95 % | worst | picture: median | 99 % |")
    print("|---|---|---|---|---|---|---|---|")
    for lens, coating, *rest in SCENES:
        scene = lens, *rest
        for mode, count in (("final", 7), ("draft", 3)):
            if mode == "draft":
                exact, found = compare_drafts(scene, D65())
            else:
                exact = pictures(project_of(*scene, lines(D65(), LINES_NM), len(LINES_NM), mode))
                found = pictures(project_of(*scene, D65(), count, mode))
            off = list(errors(exact, found).values())
            gain = 0.9 / float(np.quantile(exact["beauty"].max(axis=2), 0.995))
            far = colour.delta_E(seen(exact["beauty"], gain), seen(found["beauty"], gain), method="CIE 2000")
            print(
                f"| {lens}, {coating} | {mode}, {count} | {len(off)} | {np.median(off):.2%} "
                f"| {np.quantile(off, 0.95):.2%} | {max(off):.2%} "
                f"| {np.median(far):.2f} | {np.quantile(far, 0.99):.2f} |",
                flush=True,
            )
    print("\nDrafts under black bodies: ghosts, those that are more than 2 % off, worst\n")
    print("| lens, coating |" + "".join(f" {kelvin:g} K |" for kelvin in TEMPERATURES_K))
    print("|---|" + "---|" * len(TEMPERATURES_K))
    for lens, coating, *rest in SCENES:
        scene, cells = (lens, *rest), []
        for kelvin in TEMPERATURES_K:
            off = errors(*compare_drafts(scene, BlackBody(temperature_k=kelvin)))
            cells.append(f" {len(off)}, {len(off_by_more(off))}, {max(off.values()):.2%} |")
        print(f"| {lens}, {coating} |" + "".join(cells), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
