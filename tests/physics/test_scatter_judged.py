"""The scatter pass against a plain Monte Carlo that shares no code with it: blocks of 16 x 16 pixels, by variance."""

import numpy as np
import pytest
from scatter_rays import scattered_flux
from scipy import stats

from flarewright.model import Bare, Camera, Everywhere, Iris, Light, Lines, Project, Scatter
from flarewright.optics.color import luminance_weights
from flarewright.render.direct import direct_image
from flarewright.render.prepare import settle
from flarewright.render.scatter import render_scatter, scatter_of
from flarewright.render.shot import make_opening, make_shots

NM, SIZE, BATCHES, RAYS = 550.0, (96, 64), 16, 20_000
# what the pass states for itself (docs/scatter.md), of a block's flux
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
    ("lens", "f_number", "field", "model", "density"),
    [
        ("heliar-tronnier", 5.6, (8.0, 4.0), "harvey-shack", polish),
        pytest.param("double-gauss-tronnier", None, (-10.0, 5.0), "harvey-shack", polish, marks=pytest.mark.slow),
        pytest.param("heliar-tronnier", 5.6, (8.0, 4.0), "chaumond", page, marks=pytest.mark.slow),
        pytest.param("double-gauss-tronnier", 11.0, (-10.0, 5.0), "harvey-shack", polish, marks=pytest.mark.slow),
    ],
)
def test_blocks_agree(lens, f_number, field, model, density):
    told = Project(
        lens=lens, f_number=f_number, iris=Iris(), coating=Everywhere(coating=Bare()), camera=Camera(size_px=SIZE),
        lights=(Light(field_deg=field, spectrum=Lines(lines=((NM, 1.0),))),),
        scatter=Scatter(model=model, roughness_nm=2.0, share=1e-3),
    )  # fmt: skip
    settled = settle(told)
    shot = make_shots(settled, make_opening(settled, None))[0]
    image = direct_image(settled.lens, shot)
    found = render_scatter(settled, [shot], [image], scatter_of(settled, [shot])).pixels.astype(np.float64)
    area = 1.0 / float(shot.to_pixels[2] * shot.to_pixels[3])
    mine = blocks(found @ luminance_weights("rec709")) * area
    edges = [np.arange(0, side + 1, 16) for side in SIZE[::-1]]
    sums = []
    for seed in range(BATCHES):
        x, y, flux, _ = scattered_flux(
            settled.lens, settled.order, shot.incidence.tilt, shot.incidence.axes, NM, density, RAYS, seed
        )
        column, row = shot.to_pixels[0] + x * shot.to_pixels[2], shot.to_pixels[1] - y * shot.to_pixels[3]
        sums.append(np.histogram2d(row, column, bins=edges, weights=flux * shot.gain)[0])
    mean, variance = np.mean(sums, axis=0), np.var(sums, axis=0, ddof=1) / BATCHES
    z = (mine - mean) / np.sqrt(variance + (STATED * mine) ** 2)
    worst = 2.0 * z.size * stats.t.sf(np.abs(z).max(), BATCHES - 1)
    assert worst > 1e-3
    assert stats.chi2.sf((stats.norm.isf(stats.t.sf(z, BATCHES - 1)) ** 2).sum(), z.size) > 1e-4
    # and it can tell: a tenth more or less is no chance
    assert abs(mine.sum() / mean.sum() - 1.0) < 0.02 + 4.0 * np.sqrt(variance.sum()) / mean.sum() < 0.1
