"""Colour, channel by channel: few traced wavelengths against sixty-one exact lines over all visible light.

Luminance cannot judge this: coatings that reflect blue and red change it by a hundredth where they change those
channels twofold. Lines are traced one by one, each with the films' reflectance at its own wavelength, so they share
with the colours of few wavelengths the lens and its films, and no mean over a band.
"""

from __future__ import annotations

import colour
import numpy as np
import pytest

from flarewright.model import (
    D65,
    AsLens,
    BlackBody,
    Camera,
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
from flarewright.optics.cie1931 import cie_1931
from flarewright.optics.spectrum import VISIBLE_NM, spectral_power
from flarewright.render.render import render

LINES_NM = np.linspace(*VISIBLE_NM, 61)
# of a ghost's largest channel, and of which ghosts: those above this part of the brightest
GHOST, FAINTEST = 0.02, 1e-3
MEDIAN, WORST = 1.0, 3.0

CASES = {
    "triplet": ("triplet-pestrecov", Standard(name="early-multicoat"), (8.0, 4.0), 5.6),
    "heliar": ("heliar-tronnier", Standard(name="single-1950s"), (8.0, 4.0), 5.6),
    "tessar": ("tessar-brendel", Standard(name="modern-broadband"), (8.0, 4.0), 5.6),
}
MORE = {
    "takumar": ("takumar-50-f1.4", QuarterWave(center_wavelength_nm=550.0), (-9.0, 5.0), 4.0),
    "flektogon": ("flektogon-35", Standard(name="modern-broadband"), (10.0, 5.0), 8.0),
    "biotar": ("biotar-50-f1.4", Standard(name="early-multicoat"), (9.0, 6.0), 4.0),
    "nikkor": ("nikkor-85-f1.4", QuarterWave(center_wavelength_nm=550.0), (5.0, 2.0), 4.0),
    "angenieux": ("angenieux-50-f1.1", Standard(name="modern-broadband"), (4.0, 4.0), 4.0),
    "preset": ("heliar-tronnier", Preset(name="thesis"), (9.0, 5.0), 5.6),
    "bare": ("takumar-50-f1.4", AsLens(), (-9.0, 5.0), 4.0),
}
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in MORE]


def at_lines(spectrum):
    """Return a spectrum as lines, each of the power that the spectrum has there."""
    power = spectral_power(spectrum, LINES_NM)
    return Lines(lines=tuple(zip(LINES_NM.tolist(), power.tolist(), strict=True)))


def pictures(case, spectrum, wavelengths, mode="final", size=(96, 54), layers="ghosts", **quality):
    lens, coating, field, f_number = {**CASES, **MORE}[case]
    project = Project(
        lens=lens,
        coating=coating if isinstance(coating, (AsLens, Preset)) else Everywhere(coating=coating),
        f_number=f_number,
        lights=(Light(field_deg=field, spectrum=spectrum),),
        camera=Camera(size_px=size),
        quality=Quality(mode=mode, wavelengths=wavelengths, ringing="off", **quality),
        output=Output(layers=layers, starburst=False),
    )
    return {layer.name: layer.pixels.astype(np.float64) for layer in render(project).layers}


def off_by(case, spectrum, wavelengths, mode="final"):
    """Return how far each ghost that counts is off, of its largest channel."""
    exact = pictures(case, at_lines(spectrum), len(LINES_NM), mode)
    found = pictures(case, spectrum, wavelengths, mode)
    sums = {name: pixels.sum(axis=(0, 1)) for name, pixels in exact.items() if name.startswith("ghost.")}
    brightest = max(np.abs(rgb).max() for rgb in sums.values())
    counted = {name: rgb for name, rgb in sums.items() if np.abs(rgb).max() > FAINTEST * brightest}
    assert len(counted) >= 10
    return {name: np.abs(found[name].sum(axis=(0, 1)) - rgb).max() / np.abs(rgb).max() for name, rgb in counted.items()}


@pytest.mark.parametrize("spectrum", [D65(), BlackBody(temperature_k=2856.0)])
def test_the_range_holds_the_light(spectrum):
    nm = np.arange(360.0, 831.0)
    xyz = cie_1931(nm) * spectral_power(spectrum, nm)[:, None]
    within = (nm >= VISIBLE_NM[0]) & (nm <= VISIBLE_NM[1])
    assert (xyz[~within].sum(axis=0) < 2e-5 * xyz.sum(axis=0)).all()


@pytest.mark.parametrize("case", [*CASES, *SLOW])
def test_every_ghost_has_its_colour(case):
    wrong = {name: round(off, 3) for name, off in off_by(case, D65(), 7).items() if off > 1.05 * GHOST}
    assert wrong == {}


@pytest.mark.parametrize(
    ("spectrum", "wavelengths"),
    [(BlackBody(temperature_k=3200.0), 7), (BlackBody(temperature_k=9000.0), 7), (D65(), 5)],
)
def test_whatever_the_light(spectrum, wavelengths):
    assert max(off_by("triplet", spectrum, wavelengths).values()) < GHOST * 7.0 / wavelengths


@pytest.mark.parametrize("case", [*CASES, "takumar"])
def test_drafts_have_it_too(case):
    """Three wavelengths; a few ghosts whose size or flux changes with the wavelength are farther off."""
    off = list(off_by(case, D65(), 3, mode="draft").values())
    assert np.median(off) < 0.7 * GHOST
    assert np.quantile(off, 0.9) < 0.03 if case != "takumar" else np.quantile(off, 0.9) < 0.25


def lightness(pixels):
    """Return CIE Lab under D65."""
    xyz = np.maximum(pixels @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T, 0.0)
    return colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])


@pytest.mark.parametrize("case", ["triplet", "heliar", *SLOW])
def test_the_whole_picture_looks_alike(case):
    """CIEDE2000 of every pixel, exposed so that its brightest parts are nearly white."""
    size = (240, 135)
    exact = pictures(case, at_lines(D65()), len(LINES_NM), size=size, layers="beauty")["beauty"]
    found = pictures(case, D65(), 7, size=size, layers="beauty")["beauty"]
    gain = 0.9 / np.quantile(exact.max(axis=2), 0.995)
    far = colour.delta_E(lightness(exact * gain), lightness(found * gain), method="CIE 2000")
    assert np.median(far) < MEDIAN
    assert np.quantile(far, 0.99) < WORST


def z_of(case, seeds, samples):
    """Compare the reference's ghosts with the lines', each channel in its own standard errors."""
    size = (48, 27)
    exact = pictures(case, at_lines(D65()), len(LINES_NM), size=size, layers="passes")["ghosts"].sum(axis=(0, 1))
    runs = [
        pictures(case, D65(), 7, "reference", size, "passes", seed=seed, reference_samples=samples)["ghosts"]
        for seed in range(seeds)
    ]
    sums = np.array([run.sum(axis=(0, 1)) for run in runs])
    error = sums.std(axis=0, ddof=1) / np.sqrt(seeds)
    # a test that sees nothing proves nothing
    assert (error < 0.05 * np.abs(exact).max()).all()
    return (sums.mean(axis=0) - exact) / error


def test_the_reference_agrees_in_every_channel():
    assert np.abs(z_of("triplet", 5, 2 * 128**2)).max() < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("case", ["triplet", "tessar", "biotar"])
def test_the_reference_agrees_closely(case):
    assert np.abs(z_of(case, 8, 24 * 128**2)).max() < 4.0
