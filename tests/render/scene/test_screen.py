"""A picture for a screen lacks only detail that eight bits hardly show."""

from functools import cache

import numpy as np
import pytest

from flarewright.editor.session.files import project_for_lens
from flarewright.kernels.raster.bundle import measure_bundle
from flarewright.model import Camera, Everywhere, Output, Standard
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.bundle import Refinement, trace_bundle, trace_grid
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.image.display import auto_exposure, view
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots


@cache
def exact_and_seen(lens):
    """Return the layers of a file's picture, and of a screen's."""
    size_px = (240, 135) if lens == "triplet-pestrecov" else (480, 270)
    # films that do not change when the library's choice does
    films = Everywhere(coating=Standard(name="single-1950s"))
    project = project_for_lens(lens).replace(
        camera=Camera(size_px=size_px), output=Output(layers="passes"), coating=films
    )
    if lens == "triplet-pestrecov":
        project = project.replace(quality=project.quality.replace(paths="same-side"))
    return [
        {layer.name: layer.pixels for layer in render(each).layers}
        for each in (project, project.replace(quality=project.quality.replace(screen=True)))
    ]


@pytest.mark.parametrize(
    "lens",
    [
        "triplet-pestrecov",
        *(pytest.param(lens, marks=pytest.mark.slow) for lens in ("tessar-brendel", "nikkor-85-f1.4")),
    ],
)
def test_what_a_screen_shows_is_the_whole_picture(lens):
    """All ghosts and all wavelengths: flux, colour and shapes stay, only detail below the screen's steps is lost."""
    exact, seen = (layers["ghosts"] for layers in exact_and_seen(lens))
    light = exact.sum(axis=(0, 1), dtype=np.float64)
    np.testing.assert_allclose(seen.sum(axis=(0, 1), dtype=np.float64), light, rtol=5e-3)
    assert np.abs(seen - exact).sum() < 0.015 * np.abs(exact).sum()
    exposure = auto_exposure(exact)
    apart = np.abs(view(seen, exposure, "srgb").astype(int) - view(exact, exposure, "srgb").astype(int))
    assert apart.mean() < 0.5
    assert np.percentile(apart, 99.0) <= 3
    # the picture is not identical
    assert apart.any()


def test_a_coarse_grid_holds_the_light_of_a_fine_one():
    """It has fewer nodes where a ghost is small or faint: edges are refined only where their error requires it."""
    settled = resolve_project(project_for_lens("tessar-brendel").replace(camera=Camera(size_px=(240, 135))))
    shot = make_shots(settled, make_opening(settled, None))[0]
    opening, tilt, scale = shot.opening, shot.incidence.tilt, float(shot.to_pixels[2])
    fluxes, counts = [], []
    for path in ghost_paths(settled.lens, "all"):
        item = find_final(shot, path)
        if item is None:
            continue
        for coarse in (False, True):
            bundle = trace_grid(
                shot.packed, path, tilt, (opening.radius, opening.inner), item.region,
                Refinement(scale, 1.0, rough=5, coarse=coarse),
            )  # fmt: skip
            traced = trace_bundle(shot.packed, 1, bundle, tilt), bundle.pupil, bundle.triangles
            sums = measure_bundle(*traced, path.stop_crossings, opening.blades, shot.incidence.axes, bundle.halves)
            fluxes.append(sums[0])
            counts.append(len(bundle.pupil))
    fine, rough = np.reshape(fluxes, (-1, 2)).T
    assert np.abs(rough - fine).max() < 2e-3 * fine.max()
    assert rough.sum() == pytest.approx(fine.sum(), rel=1e-3)
    fine_nodes, rough_nodes = np.reshape(counts, (-1, 2)).sum(axis=0)
    assert rough_nodes < 0.9 * fine_nodes


def test_a_starburst_for_a_screen_is_that_of_a_file():
    """Its centre clips at the exposure of ghosts, so drawing it less finely is invisible."""
    exact, seen = exact_and_seen("triplet-pestrecov")
    bursts = seen["starburst"], exact["starburst"]
    np.testing.assert_allclose(*(burst.sum(axis=(0, 1)) for burst in bursts), rtol=1e-3)
    exposure = auto_exposure(exact["ghosts"])
    for stops, most in ((exposure, 2), (exposure - 5.0, 6)):
        codes = [view(burst, stops, "srgb").astype(int) for burst in bursts]
        assert np.abs(codes[0] - codes[1]).max() <= most
