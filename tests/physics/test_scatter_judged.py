"""The scatter pass against a plain Monte Carlo without shared code: blocks of 16 x 16 pixels, by variance."""

import numpy as np
import pytest
from scatter_rays import scattered_flux
from scipy import stats

from flarewright.model import (
    Bare,
    Camera,
    Everywhere,
    Iris,
    Lens,
    Light,
    Lines,
    Medium,
    Project,
    Scatter,
    Stop,
    Surface,
)
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.render.reference.batches import Sums, ray_source, run_batch
from flarewright.render.reference.energy_ledger import ledger_of
from flarewright.render.scattering.scatter_pass import render_scatter, scatter_of
from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import complete_lens, resolve_project
from flarewright.render.scene.shots import make_shots

NM, SIZE, BATCHES, MANY = 550.0, (96, 64), 16, 20_000
# stated error of the pass (docs/scatter.md), relative to a block's flux
STATED = 0.01


def polish(row, n_in, n_out):
    """Harvey and Shack: 2 nm rms, 10 um, slope 2.5."""
    if abs(n_in - n_out) < 1e-9:
        return None
    shoulder, m = 1e-3 * NM / (2.0 * np.pi * 10.0), 1.25

    def density(v, refracted, scattered, normal):
        def depth(cosine):
            return np.abs(n_out * cosine - np.sqrt(np.maximum(n_in**2 - n_out**2 * (1.0 - cosine**2), 0.0)))

        one, other = (depth((d * normal).sum(axis=1)) for d in (refracted, scattered))
        spread = (m - 1.0) / (np.pi * shoulder**2) * (1.0 + (v / shoulder) ** 2) ** -m
        return (2.0 * np.pi * 2.0 / NM) ** 2 * one * other * spread

    return density


def page(row, n_in, n_out):
    """Chaumond: a thousandth at every surface."""
    if abs(n_in - n_out) < 1e-9:
        return None

    def density(v, refracted, scattered, normal):
        c = (refracted * scattered).sum(axis=1)
        per_steradian = 1e-3 * (0.625 * (1.0 + c**2) + c) * 3.0 / (10.0 * np.pi)
        return per_steradian / (n_out**2 * np.maximum((scattered * normal).sum(axis=1), 1e-3))

    return density


def blocks(pixels):
    return pixels.reshape(SIZE[1] // 16, 16, SIZE[0] // 16, 16).sum(axis=(1, 3))


@pytest.mark.parametrize(
    ("lens", "f_number", "field", "model", "density", "rays"),
    [
        # the next test compares with random rays in little time
        pytest.param("heliar-tronnier", 5.6, (8.0, 4.0), "harvey-shack", polish, 2_000, marks=pytest.mark.slow),
        pytest.param("heliar-tronnier", 5.6, (8.0, 4.0), "harvey-shack", polish, MANY, marks=pytest.mark.slow),
        pytest.param("double-gauss-tronnier", None, (-10.0, 5.0), "harvey-shack", polish, MANY, marks=pytest.mark.slow),
        pytest.param("heliar-tronnier", 5.6, (8.0, 4.0), "chaumond", page, MANY, marks=pytest.mark.slow),
        pytest.param("double-gauss-tronnier", 11.0, (-10.0, 5.0), "harvey-shack", polish, MANY, marks=pytest.mark.slow),
    ],
)
def test_blocks_agree(lens, f_number, field, model, density, rays):
    reported = Project(
        lens=lens, f_number=f_number, iris=Iris(), coating=Everywhere(coating=Bare()), camera=Camera(size_px=SIZE),
        lights=(Light(field_deg=field, spectrum=Lines(lines=((NM, 1.0),))),),
        scatter=Scatter(model=model, roughness_nm=2.0, share=1e-3),
    )  # fmt: skip
    settled = resolve_project(reported)
    shot = make_shots(settled, make_opening(settled, None))[0]
    image = direct_image(settled.lens, shot)
    found = render_scatter(settled, [shot], [image], scatter_of(settled, [shot])).pixels.astype(np.float64)
    area = 1.0 / float(shot.to_pixels[2] * shot.to_pixels[3])
    mine = blocks(found @ luminance_weights("rec709")) * area
    edges = [np.arange(0, side + 1, 16) for side in SIZE[::-1]]
    sums = []
    for seed in range(BATCHES):
        x, y, flux, _ = scattered_flux(
            settled.lens, settled.order, shot.incidence.tilt, shot.incidence.axes, NM, density, rays, seed
        )
        column, row = shot.to_pixels[0] + x * shot.to_pixels[2], shot.to_pixels[1] - y * shot.to_pixels[3]
        sums.append(np.histogram2d(row, column, bins=edges, weights=flux * shot.gain)[0])
    mean, variance = np.mean(sums, axis=0), np.var(sums, axis=0, ddof=1) / BATCHES
    z = (mine - mean) / np.sqrt(variance + (STATED * mine) ** 2)
    worst = 2.0 * z.size * stats.t.sf(np.abs(z).max(), BATCHES - 1)
    assert worst > 1e-3
    assert stats.chi2.sf((stats.norm.isf(stats.t.sf(z, BATCHES - 1)) ** 2).sum(), z.size) > 1e-4
    # the test is sharp: a difference of 10 % would be significant
    assert abs(mine.sum() / mean.sum() - 1.0) < 0.02 + 4.0 * np.sqrt(variance.sum()) / mean.sum() < 0.1


def random_rays(project, batches=24, side=64):
    """Return sums of the reference renderer's random rays, at the wavelengths of final quality."""
    settled = resolve_project(project)
    shots = make_shots(settled, make_opening(settled, None))
    tables = scatter_of(settled, shots)
    source = ray_source(shots[0], 0, side=side, light=0, scatter=tables[0])
    sums = Sums(0, {}, {})
    for batch in range(batches):
        sums.add(run_batch([source], batch, picture=True))
    return sums, settled, shots, tables


@pytest.mark.parametrize("side", [32, pytest.param(64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("model", ["harvey-shack", pytest.param("abg", marks=pytest.mark.slow)])
def test_the_reference_agrees(model, side):
    reported = Project(
        lens="triplet-pestrecov", f_number=4.0, iris=Iris(blades=6), camera=Camera(size_px=SIZE),
        lights=(Light(field_deg=(8.0, 4.0), spectrum=Lines(lines=((NM, 1.0),))),), scatter=Scatter(model=model),
    )  # fmt: skip
    sums, settled, shots, tables = random_rays(reported, side=side)
    image = direct_image(settled.lens, shots[0])
    found = render_scatter(settled, shots, [image], tables).pixels.astype(np.float64)
    mine = blocks(found @ luminance_weights("rec709")) / float(shots[0].to_pixels[2] * shots[0].to_pixels[3])
    z = (mine - sums.mean("blocks")[2]) / np.sqrt(sums.variance("blocks")[2] + (STATED * mine) ** 2)
    assert 2.0 * z.size * stats.t.sf(np.abs(z).max(), sums.batches - 1) > 1e-3
    # the line of the ledger equals the layer's sum
    line = next(line for line in ledger_of(sums).lines if line.name == "scatter.in_picture")
    assert mine.sum() == pytest.approx(
        line.share * ledger_of(sums).entered_mm2, rel=STATED + 4.0 * line.standard_error / line.share
    )


def test_all_scattered_light_is_in_the_ledger():
    """Light on the unbounded plane plus light lost on the way equals the total of every surface times its light."""
    rows = (
        Surface(curvature=0.004, thickness=4.0, medium=Medium(n_d=1.6, v_d=60.0), semi_diameter=8.0),
        Surface(curvature=-0.004, thickness=4.0, semi_diameter=30.0),
        Stop(thickness=100.0),
    )
    lens = complete_lens(Lens(name="weak", f_number=12.0, rows=rows))
    polish = Scatter(model="harvey-shack", roughness_nm=10.0, correlation_um=20.0, slope=5.0)
    light = Light(field_deg=(0.0, 0.0), spectrum=Lines(lines=((587.56, 1.0),)))
    sums, *_ = random_rays(Project(lens=lens, lights=(light,), camera=Camera(size_px=SIZE), scatter=polish), side=32)
    ledger = ledger_of(sums)
    stray = [line for line in ledger.lines if line.name.startswith("scatter.")]
    total = 1.0 - np.exp(-((2.0 * np.pi * 0.6 * 10.0 / 587.56) ** 2))
    passed = 1.0 - (0.6 / 2.6) ** 2
    expected = total * passed + total * (1.0 - total) * passed**2
    error = np.sqrt(sum(line.standard_error**2 for line in stray))
    assert abs(sum(line.share for line in stray) - expected) < 4.0 * error + 0.005 * expected
    assert error < 0.01 * expected
    assert abs(ledger.total.share - 1.0) < 1e-3
