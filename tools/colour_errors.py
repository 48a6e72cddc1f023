"""Colour errors of few traced wavelengths compared with exact lines, for many lights.

    python tools/colour_errors.py ghosts [--mode draft] [--scenes known]   # one row a lens, one column a light
    python tools/colour_errors.py pictures   # whole pictures in daylight; needs colour-science (.[dev])
    python tools/colour_errors.py sums       # all ghosts of a Flektogon at f/8, by number of wavelengths and quality

The tables of docs/colour.md. Ghosts with more than a thousandth of the brightest one's light are compared by their sums
per channel in pictures of 240 x 135 pixels.

Exact are the sums of lines, each traced alone with the films' reflectance at its wavelength. A lamp of lines has just
these. A continuous light has the midpoints of equal cells from 360 to 830 nm: the flux of every ghost is computed once
at all lines and then weighed by each light. Drafts have 940 cells of 0.5 nm, because their light ends abruptly; ghosts
that seem more than 2 % off are compared again with eight times as many. Final quality has cells of 5 nm, and of 1.5 nm
where a light of one colour shines.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flarewright.colorimetry import VISIBLE_NM
from flarewright.kernels.paraxial.ghosts import RIM
from flarewright.kernels.raster.bundle import draw_bundle, node_densities
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
    Preset,
    Project,
    Quality,
    QuarterWave,
    Standard,
)
from flarewright.model.project.light import Spectrum, Tabulated
from flarewright.optics.colour.cie1931 import cie_1931
from flarewright.optics.colour.rgb import xyz_to_rgb_matrix
from flarewright.optics.colour.spectrum import spectral_power
from flarewright.optics.lens.paths import LightPath, ghost_paths
from flarewright.optics.rays.bundle import Refinement, trace_bundle, trace_grid
from flarewright.optics.rays.pack import facing, resolve_coatings
from flarewright.optics.rays.torn_cells import cut_failed_triangles
from flarewright.render.ghosts.draft_colors import draft_colors
from flarewright.render.ghosts.matrix_flux import matrix_fluxes
from flarewright.render.ghosts.paraxial_ghosts import draw_draft
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.image.canvas import blank, merge
from flarewright.render.render import render
from flarewright.render.scene.between_wavelengths import lens_between
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shot import Shot
from flarewright.render.scene.shots import make_shots

Floats = NDArray[np.float64]
Scene = tuple[str, CoatingChoice, tuple[float, float], float]

OFF, SIZE_PX = 0.02, (240, 135)
LIGHT_NM = (360.0, 830.0)
DRAFT_CELLS, MORE, FINAL_CELLS = 940, 8, 94


def quarter(nm: float) -> Everywhere:
    """Return a quarter wave on each surface."""
    return Everywhere(coating=QuarterWave(center_wavelength_nm=nm))


BROADBAND, EARLY, SINGLE = (
    Everywhere(coating=Standard(name=name)) for name in ("modern-broadband", "early-multicoat", "single-1950s")
)
STAGGERED = Preset(name="staggered")
# the method was chosen on the first five lists
SCENES: dict[str, tuple[Scene, ...]] = {
    "known": (
        ("flektogon-35", BROADBAND, (10.0, 5.0), 8.0),
        ("canon-70-200", BROADBAND, (6.0, 3.0), 5.6),
        ("nikon-28-75", BROADBAND, (12.0, -6.0), 8.0),
        ("angenieux-50-f1.1", BROADBAND, (4.0, 4.0), 4.0),
        ("triplet-pestrecov", EARLY, (8.0, 4.0), 5.6),
        ("biotar-50-f1.4", EARLY, (9.0, 6.0), 4.0),
        ("heliar-tronnier", SINGLE, (8.0, 4.0), 5.6),
        ("nikkor-85-f1.4", quarter(550.0), (5.0, 2.0), 4.0),
        ("takumar-50-f1.4", AsLens(), (-9.0, 5.0), 4.0),
    ),
    "second": (
        ("canon-70-200-wide", BROADBAND, (10.0, 5.0), 4.0),
        ("canon-70-200-tele", BROADBAND, (3.0, 1.5), 5.6),
        ("canon-28-80", BROADBAND, (8.0, -4.0), 5.6),
        ("nikon-28-75", EARLY, (-14.0, 7.0), 5.6),
        ("nikon-28-75", BROADBAND, (18.0, 3.0), 4.0),
        ("fisheye-nikkor-10.5", BROADBAND, (30.0, 15.0), 4.0),
        ("speed-panchro-50", STAGGERED, (8.0, 5.0), 4.0),
        ("nikkor-180-ed", BROADBAND, (3.0, 2.0), 4.0),
        ("flektogon-35", EARLY, (15.0, -8.0), 5.6),
        ("nikkor-85-f1.4", BROADBAND, (7.0, -3.0), 2.8),
        ("canon-70-200-wide", quarter(500.0), (-6.0, 8.0), 8.0),
        ("angenieux-50-f1.1", STAGGERED, (8.0, -3.0), 2.8),
    ),
    # these and the following were written down before any of them was looked at
    "new": (
        ("canon-70-200-tele", BROADBAND, (-2.0, 3.5), 4.0),
        ("canon-70-200-wide", EARLY, (-13.0, 2.0), 5.6),
        ("canon-28-80", EARLY, (14.0, 9.0), 8.0),
        ("nikon-28-75", BROADBAND, (-7.0, 11.0), 2.8),
        ("fisheye-nikkor-10.5", EARLY, (-42.0, 8.0), 5.6),
        ("nikkor-85-f1.4", BROADBAND, (-4.0, 6.5), 5.6),
        ("double-gauss-tronnier", BROADBAND, (12.0, 6.0), 2.8),
        ("petzval-kodak", quarter(600.0), (5.0, 3.0), 2.8),
        ("tessar-brendel", BROADBAND, (-11.0, 5.0), 4.0),
        ("biotar-50-f1.4", BROADBAND, (13.0, -4.0), 2.0),
        ("flektogon-35", STAGGERED, (-20.0, 6.0), 4.0),
        ("takumar-50-f1.4", BROADBAND, (6.0, 10.0), 2.8),
    ),
    "fourth": (
        ("canon-70-200", EARLY, (-4.0, 5.0), 8.0),
        ("canon-70-200-tele", quarter(580.0), (1.5, -3.0), 4.0),
        ("canon-28-80", STAGGERED, (-12.0, 4.0), 4.0),
        ("nikon-28-75", quarter(450.0), (5.0, -13.0), 5.6),
        ("fisheye-nikkor-10.5", SINGLE, (20.0, -35.0), 4.0),
        ("nikkor-85-f1.4", EARLY, (9.0, 1.0), 2.0),
        ("nikkor-180-ed", EARLY, (-4.0, -1.0), 5.6),
        ("speed-panchro-50", BROADBAND, (-10.0, 6.0), 2.8),
        ("double-gauss-tronnier", EARLY, (-6.0, -9.0), 4.0),
        ("takumar-50-f1.4", EARLY, (12.0, -3.0), 2.0),
        ("angenieux-50-f1.1", EARLY, (-7.0, 6.0), 2.0),
        ("biotar-50-f1.4", quarter(520.0), (-5.0, 10.0), 2.8),
    ),
    "fifth": (
        ("canon-70-200-wide", STAGGERED, (7.0, -9.0), 5.6),
        ("canon-70-200-tele", EARLY, (4.0, 0.5), 8.0),
        ("canon-28-80", BROADBAND, (-16.0, -5.0), 4.0),
        ("nikon-28-75", STAGGERED, (9.0, 9.0), 4.0),
        ("fisheye-nikkor-10.5", quarter(530.0), (-15.0, 25.0), 5.6),
        ("nikkor-85-f1.4", STAGGERED, (-8.0, -4.0), 4.0),
        ("nikkor-180-ed", quarter(480.0), (2.0, 3.5), 2.8),
        ("speed-panchro-50", EARLY, (12.0, -7.0), 5.6),
        ("petzval-kodak", EARLY, (-6.0, 2.0), 4.0),
        ("takumar-50-f1.4", quarter(560.0), (-5.0, -12.0), 4.0),
        ("angenieux-50-f1.1", quarter(510.0), (10.0, 2.0), 4.0),
        ("tessar-brendel", EARLY, (14.0, 8.0), 5.6),
    ),
    "sixth": (
        ("canon-70-200", STAGGERED, (-7.0, -2.0), 4.0),
        ("canon-70-200-wide", quarter(560.0), (11.0, 3.0), 2.8),
        ("canon-28-80", quarter(490.0), (5.0, 10.0), 5.6),
        ("nikon-28-75", EARLY, (4.0, 15.0), 4.0),
        ("fisheye-nikkor-10.5", STAGGERED, (12.0, 50.0), 5.6),
        ("nikkor-85-f1.4", quarter(600.0), (-6.0, 1.5), 8.0),
        ("nikkor-180-ed", STAGGERED, (-2.5, 2.5), 4.0),
        ("speed-panchro-50", quarter(540.0), (-7.0, -9.0), 4.0),
        ("double-gauss-tronnier", STAGGERED, (10.0, -5.0), 5.6),
        ("biotar-50-f1.4", STAGGERED, (7.0, 8.0), 2.8),
        ("flektogon-35", quarter(470.0), (18.0, 10.0), 2.8),
        ("angenieux-50-f1.1", BROADBAND, (-9.0, -4.0), 1.4),
    ),
}


def glow(peaks: Sequence[tuple[float, float, float]], low: float, high: float, step: float) -> Tabulated:
    """Return bands (power, wavelength, full width at half maximum) as a table."""
    nm = np.arange(low, high + 0.5 * step, step)
    power = sum(most * np.exp2(-(((nm - middle) / (0.5 * width)) ** 2)) for most, middle, width in peaks)
    return Tabulated(wavelength_nm=tuple(nm.tolist()), power=tuple(power.tolist()))


# places of lines: NIST Atomic Spectra Database; their powers are chosen, like those of a high-pressure sodium lamp and
# of a mercury lamp
SODIUM = (
    (466.7, 0.02), (498.1, 0.08), (515.1, 0.03), (568.5, 0.18), (589.0, 1.0), (589.6, 0.9), (615.8, 0.12), (818.9, 0.8),
)  # fmt: skip
MERCURY = (
    (365.0, 0.6), (404.7, 0.4), (407.8, 0.05), (435.8, 0.8), (491.6, 0.02), (546.1, 1.0), (577.0, 0.45), (579.1, 0.45),
    (623.4, 0.02), (690.7, 0.02),
)  # fmt: skip
LIGHTS: dict[str, Spectrum] = {
    "D65": D65(),
    "2000 K": BlackBody(temperature_k=2000.0),
    "2856 K": BlackBody(temperature_k=2856.0),
    "9000 K": BlackBody(temperature_k=9000.0),
    "sodium": Lines(lines=SODIUM),
    "mercury": Lines(lines=MERCURY),
    "white LED": glow(((1.0, 452.0, 20.0), (0.55, 565.0, 120.0)), 400.0, 780.0, 2.5),
    "blue LED": glow(((1.0, 448.0, 15.0),), 430.0, 466.0, 1.0),
    "green LED": glow(((1.0, 525.0, 30.0),), 480.0, 570.0, 2.0),
    "red LED": glow(((1.0, 632.0, 18.0),), 605.0, 660.0, 1.0),
}


def project_of(scene: Scene, spectrum: Spectrum, count: int, mode: str, layers: str = "ghosts") -> Project:
    """Return a scene with a layer for each ghost."""
    lens, coating, field, f_number = scene
    return Project(
        lens=lens, coating=coating, f_number=f_number, lights=(Light(field_deg=field, spectrum=spectrum),),
        camera=Camera(size_px=SIZE_PX), quality=Quality(mode=mode, wavelengths=count, ringing="off"),
        output=Output(layers=layers, starburst=False),
    )  # fmt: skip


def shot_of(scene: Scene, spectrum: Spectrum, mode: str) -> tuple[Shot, tuple[LightPath, ...]]:
    """Return the shot of a scene at the default wavelengths, and its paths."""
    settled = resolve_project(project_of(scene, spectrum, 3 if mode == "draft" else 7, mode))
    (shot,) = make_shots(settled, make_opening(settled, None))
    return shot, tuple(ghost_paths(settled.lens))


def at_lines(scene: Scene, nm: Floats, mode: str) -> tuple[Shot, tuple[LightPath, ...]]:
    """Return the shot of a scene at any number of lines, with the films' reflectance at each."""
    settled = resolve_project(project_of(scene, D65(), 3, mode))
    (shot,) = make_shots(settled, make_opening(settled, None))
    coatings = resolve_coatings(settled.lens, settled.coating)
    packed, _ = lens_between(settled.lens, settled.order, coatings, settled.sensor, None, D65()).packed_at(nm)
    packed = facing(packed, shot.incidence.axes, shot.incidence.nearness)
    return replace(shot, packed=packed, curves=None, between=None), tuple(ghost_paths(settled.lens))


def draft_fluxes(shot: Shot, paths: Sequence[LightPath]) -> Floats:
    """Return the flux of the polygons that drafts draw, of each path at each line, (P, N)."""
    return shot.gain * matrix_fluxes(shot, paths, shot.packed.n_gap, shot.packed.reflectance, sides=RIM)[0]


def drawn(shot: Shot, path: LightPath, colors: Floats) -> Floats:
    """Draw one path of a draft; return its flux in each channel."""
    picture = np.zeros((SIZE_PX[1], SIZE_PX[0], 3))
    draw_draft(shot, [path], picture, colors)
    sum_rows(picture, picture)
    total: Floats = picture.sum(axis=(0, 1))
    return total


def final_fluxes(shot: Shot, paths: Sequence[LightPath], nm: Floats) -> Floats:
    """Trace rays at lines; return the flux of each path at each, (P, N)."""
    flux = np.zeros((len(paths), len(nm)))
    opening, tilt = shot.opening, shot.incidence.tilt
    scale, tolerance = float(max(shot.to_pixels[2:])), Quality().tolerance_px
    for k, path in enumerate(paths):
        item = find_final(shot, path)
        if item is None or not item.region.seen_flux > 0.0:
            continue
        fine = Refinement(scale, tolerance, item.view_radius)
        bundle = trace_grid(shot.packed, path, tilt, (opening.radius, opening.inner), item.region, fine)
        for w in range(len(nm)):
            whole, data = cut_failed_triangles(bundle, trace_bundle(shot.packed, w, bundle, tilt))
            canvas = blank(SIZE_PX)
            draw_bundle(
                data, whole.pupil, whole.triangles, node_densities(data, whole.pupil, whole.triangles),
                path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, shot.to_pixels, shot.gain,
                np.ones(3), canvas.plane(0), whole.halves,
            )  # fmt: skip
            flux[k, w] = merge(canvas.planes, SIZE_PX)[..., 0].sum(dtype=np.float64)
    return flux


def weights(spectrum: Spectrum, nm: Floats, widths: Floats) -> Floats:
    """Return the RGB of the light in each cell, for a luminance of 1; 0 for lines elsewhere."""
    if isinstance(spectrum, Lines):
        power = np.array([sum(p for w, p in spectrum.lines if w == one) for one in nm])
    else:
        power = spectral_power(spectrum, nm) * widths
    xyz = cie_1931(nm) * power[:, None]
    rgb: Floats = xyz / xyz[:, 1].sum() @ xyz_to_rgb_matrix("rec709").T
    return rgb


def cells(edges: Floats) -> tuple[Floats, Floats]:
    """Return middles and widths."""
    return 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)


class Judge:
    """Exact sums of all ghosts of a scene, under any light of `LIGHTS`."""

    def __init__(self, scene: Scene, mode: str) -> None:
        self.scene, self.mode = scene, mode
        if mode == "draft":
            edges = np.linspace(*LIGHT_NM, DRAFT_CELLS + 1)
        else:
            edges = np.linspace(*LIGHT_NM, FINAL_CELLS + 1)
            tables = [one for one in LIGHTS.values() if isinstance(one, Tabulated)]
            bands = [(one.wavelength_nm[0], one.wavelength_nm[-1]) for one in tables]
            more = [np.arange(low, high, 1.5) for low, high in bands if high - low < 100.0]
            edges = np.unique(np.concatenate([edges, *more]))
        self.nm, self.widths = cells(edges)
        lines = [one.lines for one in LIGHTS.values() if isinstance(one, Lines)]
        self.lines_nm = np.unique([nm for one in lines for nm, _ in one])
        self.flux = self.at(self.nm)
        self.line_flux = self.at(self.lines_nm)

    def at(self, nm: Floats, names: Sequence[str] | None = None) -> Floats:
        """Return the flux at lines, (P, N)."""
        shot, paths = at_lines(self.scene, nm, self.mode)
        few = [path for path in paths if names is None or path.name in names]
        return draft_fluxes(shot, few) if self.mode == "draft" else final_fluxes(shot, few, nm)

    def sums(self, spectrum: Spectrum) -> Floats:
        """Return the sums of all ghosts, (P, 3)."""
        if isinstance(spectrum, Lines):
            return self.line_flux @ weights(spectrum, self.lines_nm, np.ones_like(self.lines_nm))
        return self.flux @ weights(spectrum, self.nm, self.widths)

    def found(self, spectrum: Spectrum) -> tuple[list[str], Floats]:
        """Return the names and the sums of all ghosts at the default wavelengths."""
        shot, paths = shot_of(self.scene, spectrum, self.mode)
        names = [path.name for path in paths]
        if self.mode == "draft":
            colors = draft_colors(shot, paths)
            return names, np.array([drawn(shot, path, colors[[k]]) for k, path in enumerate(paths)])
        project = project_of(self.scene, spectrum, 7, self.mode)
        layers = {layer.name: layer.pixels.sum(axis=(0, 1), dtype=np.float64) for layer in render(project).layers}
        # flux per mm^2 of a pixel, as in layers
        area = shot.to_pixels[2] * shot.to_pixels[3]
        return names, np.array([layers.get(f"ghost.{name}", np.zeros(3)) / area for name in names])

    def errors(self, spectrum: Spectrum) -> dict[str, float]:
        """Return the errors of all ghosts that count, as parts of their largest channels."""
        exact = self.sums(spectrum)
        names, found = self.found(spectrum)
        most = np.abs(exact).max(axis=1)
        counted = [k for k in range(len(names)) if most[k] > 1e-3 * most.max()]
        off = {names[k]: float(np.abs(found[k] - exact[k]).max() / most[k]) for k in counted}
        again = [name for name, one in off.items() if one > OFF]
        if again and self.mode == "draft" and not isinstance(spectrum, Lines):
            nm, widths = cells(np.linspace(*LIGHT_NM, MORE * DRAFT_CELLS + 1))
            # only where the light is
            lit = spectral_power(spectrum, nm) > 0.0
            rgb = weights(spectrum, nm, widths)[lit]
            for name, one in zip([n for n in names if n in again], self.at(nm[lit], again) @ rgb, strict=True):
                off[name] = float(np.abs(found[names.index(name)] - one).max() / np.abs(one).max())
        return off


def ghosts(mode: str, scenes: Sequence[Scene], lights: Sequence[str]) -> None:
    """Print how many ghosts are compared, how many are more than 2 % off, and the worst."""
    print(f"{mode}: ghosts, those more than 2 % off, median, worst\n\n| lens, coating |", " | ".join(lights), "|")
    print("|---|" + "---|" * len(lights))
    total: dict[str, list[float]] = {name: [] for name in lights}
    names: list[str] = []
    for scene in scenes:
        judge, row = Judge(scene, mode), []
        for name in lights:
            off = judge.errors(LIGHTS[name])
            total[name] += off.values()
            names += [f"{scene[0]} {path}, {name}: {one:.1%}" for path, one in off.items() if one > OFF]
            row.append(summary(list(off.values())))
        print(f"| {scene[0]}, {coating_word(scene[1])} |", " | ".join(row), "|", flush=True)
    print("| all |", " | ".join(summary(one) for one in total.values()), "|")
    print("\nmore than 2 % off:", "; ".join(names) or "none")


def summary(off: list[float]) -> str:
    """Return a cell of the table."""
    return f"{len(off)}, {sum(one > OFF for one in off)}, {np.median(off):.2%}, {max(off):.2%}"


def coating_word(choice: CoatingChoice) -> str:
    """Return a coating as on the command line."""
    if isinstance(choice, Everywhere):
        coating: Any = choice.coating
        return coating.name if isinstance(coating, Standard) else f"quarter-wave:{coating.center_wavelength_nm:g}"
    return f"preset:{choice.name}" if isinstance(choice, Preset) else "bare"


def daylight_lines(nm: Floats, parts: int) -> Iterator[tuple[float, Lines]]:
    """Yield daylight at some wavelengths, in parts of at most 81: the luminance of each, and its lines."""
    power = spectral_power(D65(), nm)
    light = cie_1931(nm)[:, 1] * power
    for k in range(parts):
        lines = tuple(zip(nm[k::parts].tolist(), power[k::parts].tolist(), strict=True))
        yield float(light[k::parts].sum() / light.sum()), Lines(lines=lines)


def pictures(scenes: Sequence[Scene]) -> None:
    """Print CIEDE2000 of whole pictures in daylight, against 61 lines; drafts against 480."""
    import colour

    def lab(pixels: Floats) -> Floats:
        xyz = np.maximum(pixels @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T, 0.0)
        found: Floats = colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])
        return found

    def beauty(scene: Scene, spectrum: Spectrum, count: int, mode: str) -> Floats:
        layers = render(project_of(scene, spectrum, count, mode, "beauty")).layers
        return next(layer.pixels.astype(np.float64) for layer in layers if layer.name == "beauty")

    print("| lens, coating | quality, wavelengths | median | 99 % |\n|---|---|---|---|")
    for scene in scenes:
        for mode, count, lines, parts in (("final", 7, 61, 1), ("draft", 3, 480, 8)):
            nm = np.linspace(*VISIBLE_NM, lines) if mode == "final" else cells(np.linspace(*LIGHT_NM, lines + 1))[0]
            exact = np.zeros((SIZE_PX[1], SIZE_PX[0], 3))
            for part, some in daylight_lines(nm, parts):
                exact += part * beauty(scene, some, len(some.lines), mode)
            gain = 0.9 / float(np.quantile(exact.max(axis=2), 0.995))
            far = colour.delta_E(lab(gain * exact), lab(gain * beauty(scene, D65(), count, mode)), method="CIE 2000")
            word = f"{scene[0]}, {coating_word(scene[1])} | {mode}, {count}"
            print(f"| {word} | {np.median(far):.2f} | {np.quantile(far, 0.99):.2f} |", flush=True)


def sums() -> None:
    """Print the light of all ghosts of a Flektogon with broadband films in daylight, as parts of that of 61 lines."""

    def whole(spectrum: Spectrum, count: int, mode: str) -> Floats:
        project = project_of(SCENES["known"][0], spectrum, count, mode, "passes")
        if mode == "reference":
            project = project.replace(quality=Quality(mode="reference", reference_error=0.005))
        ghosts = [layer for layer in render(project).layers if layer.name == "ghosts"]
        found: Floats = ghosts[0].pixels.astype(np.float64).sum(axis=(0, 1))
        return found

    def of_lines(count: int) -> Floats:
        ((_, lines),) = daylight_lines(np.linspace(*VISIBLE_NM, count), 1)
        return whole(lines, count, "final")

    exact = of_lines(61)
    rows = [
        ("31 exact lines", of_lines(31)), *((f"{n} wavelengths", whole(D65(), n, "final")) for n in (3, 7, 15, 31)),
        ("draft, 3 wavelengths", whole(D65(), 3, "draft")), ("reference", whole(D65(), 7, "reference")),
    ]  # fmt: skip
    print("| method | red | green | blue |\n|---|---|---|---|")
    for name, found in rows:
        print(f"| {name} | " + " | ".join(f"{one:.3f}" for one in found / exact) + " |", flush=True)


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("ghosts", "pictures", "sums"), nargs="?", default="ghosts")
    parser.add_argument("--mode", choices=("draft", "final"), default="draft")
    parser.add_argument("--scenes", choices=tuple(SCENES), default="known")
    parser.add_argument("--lights", nargs="+", choices=tuple(LIGHTS), default=list(LIGHTS))
    parser.add_argument("--only", type=int, nargs="+", help="numbers of scenes in the list, from 0")
    given = parser.parse_args()
    scenes = SCENES[given.scenes] if given.only is None else [SCENES[given.scenes][k] for k in given.only]
    if given.what == "pictures":
        pictures(scenes)
    elif given.what == "sums":
        sums()
    else:
        ghosts(given.mode, scenes, given.lights)
    return 0


if __name__ == "__main__":
    sys.exit(main())
