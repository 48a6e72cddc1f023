"""The rays that represent a ghost's colour, and faint ghosts drawn in one colour."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.tracing.ray_interpolation import rays_between
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X, WEIGHT
from flarewright.model import Camera, Everywhere, Light, Lines, Project, Quality, QuarterWave
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.bundle import Bundle
from flarewright.optics.rays.pack import pack_lens, resolve_coatings
from flarewright.render.ghosts.traced_ghosts import draw_final, find_final
from flarewright.render.image.canvas import blank, merge
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.path_color import direct_flux, direct_spectrum, spread_rays, traced_spectrum, visible_rays
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

FILM = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
SIZE = (160, 90)


def shot_of(lens: str, field: tuple[float, float], *, light: Light | None = None, **quality):
    project = Project(
        lens=lens,
        lights=(light or Light(field_deg=field),),
        camera=Camera(size_px=SIZE),
        quality=Quality(**quality),
        coating=FILM,
    )
    settled = resolve_project(project)
    return project, make_shots(settled, make_opening(settled, None))[0]


def grid(fine: int) -> Bundle:
    """Return two squares side by side, the right one finely divided; all rays pass and land in the centre."""
    pupil, triangles = [], []

    def square(x: float, y: float, side: float) -> None:
        first = len(pupil)
        pupil.extend([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
        triangles.extend([(first, first + 1, first + 2), (first, first + 2, first + 3)])

    square(0.0, 0.0, 1.0)
    for k in range(fine):
        for m in range(fine):
            square(1.0 + k / fine, m / fine, 1.0 / fine)
    data = np.zeros((len(pupil), STOP_X + 2))
    data[:, ALIVE], data[:, REL] = 1.0, 0.5
    path = direct_path(load_lens("tessar-brendel"))
    return Bundle(path, np.array(pupil), np.array(triangles), {0: data}, 1)


def passes(rays: np.ndarray) -> np.ndarray:
    return rays[:, ALIVE] > 0.0


def test_rays_are_chosen_by_area():
    bundle = grid(12)
    chosen, _ = spread_rays(bundle, (0,), (passes,), 40)
    assert len(chosen) == 40
    # half of the area holds 576 of 580 nodes
    assert 0.4 <= (bundle.pupil[chosen, 0] > 1.0).mean() <= 0.6


def test_only_rays_that_pass_are_chosen():
    bundle = grid(12)
    bundle.traced[0][bundle.pupil[:, 1] > 0.5, ALIVE] = 0.0
    chosen, _ = spread_rays(bundle, (0,), (passes,), 40)
    assert (bundle.pupil[chosen, 1] <= 0.5).all()
    bundle.traced[0][:, ALIVE] = 0.0
    assert spread_rays(bundle, (0,), (passes,), 40)[0].size == 0


def test_rays_whose_mirror_image_passes_count_as_well():
    """The left square passes in one half, the right one in both: two thirds of the light pass the right one."""
    bundle = grid(1)
    left = bundle.pupil[:, 0] < 1.0
    left[np.flatnonzero(bundle.pupil[:, 0] == 1.0)[:2]] = True

    def mirrored(rays: np.ndarray) -> np.ndarray:
        return passes(rays) & ~left

    chosen, halves = spread_rays(bundle, (0,), (passes, mirrored), 60)
    assert left[chosen].sum() == pytest.approx(20, abs=2)
    assert not left[chosen[halves == 1]].any()
    assert (halves == 1).sum() == pytest.approx(20, abs=2)


def test_a_ray_that_passes_at_one_of_the_wavelengths_can_be_chosen():
    """Only rays that pass at all of them would leave out the rim, and with it the difference of the wavelengths."""
    bundle = grid(12)
    other = bundle.traced[0].copy()
    bundle.traced[0][bundle.pupil[:, 1] > 0.5, ALIVE] = 0.0
    other[bundle.pupil[:, 1] < 0.25, ALIVE] = 0.0
    both = Bundle(bundle.path, bundle.pupil, bundle.triangles, {0: bundle.traced[0], 1: other}, 1)
    chosen, _ = spread_rays(both, (0, 1), (passes,), 400)
    y = bundle.pupil[chosen, 1]
    assert (y > 0.5).any()
    assert (y < 0.25).any()


@pytest.mark.parametrize("slope", [0.0, 0.3, 2.0])
def test_the_mirror_image_of_a_bundle_is_seen_where_its_rays_land(slope):
    """Against the same rays with the other sign of x, tested as rays of their own."""
    _, shot = shot_of("tessar-brendel", (8.0, 8.0 * slope))
    rng = np.random.default_rng(3)
    rays = np.zeros((400, STOP_X + 2))
    rays[:, ALIVE], rays[:, REL] = 1.0, 0.5
    rays[:, :2] = rng.uniform(-30.0, 30.0, (400, 2))
    rays[:, STOP_X:] = rng.uniform(-1.0, 1.0, (400, 2)) * shot.opening.radius
    other = rays.copy()
    other[:, [0, STOP_X]] *= -1.0
    own, image = visible_rays(shot, shot.to_pixels, 2)
    assert image(rays).tolist() == own(other).tolist()
    assert 20 < image(rays).sum() < 380


def test_a_bundle_without_a_triangle_has_no_rays():
    """A path that passes less than its grid resolves."""
    bundle = grid(2)
    empty = Bundle(bundle.path, bundle.pupil, bundle.triangles[:0], bundle.traced, 1)
    _, shot = shot_of("tessar-brendel", (8.0, 5.0))
    assert spread_rays(empty, (0,), visible_rays(shot, shot.to_pixels, 1), 12)[0].size == 0
    assert traced_spectrum(shot, bundle.path, empty, shot.to_pixels) is None


def test_rays_beside_the_picture_are_not_seen():
    _, shot = shot_of("tessar-brendel", (8.0, 5.0))
    rays = np.zeros((3, STOP_X + 2))
    rays[:, ALIVE], rays[:, REL] = 1.0, 0.5
    rays[1, 0] = 100.0
    rays[2, STOP_X] = 2.0 * shot.opening.radius
    (seen,) = visible_rays(shot, shot.to_pixels, 1)
    assert seen(rays).tolist() == [True, False, False]


def test_a_faint_ghost_keeps_its_flux_where_only_its_rim_is_in_the_picture():
    """1/1000 of this ghost is visible, at different angles: the mean colour of the ghost is not that part's."""
    project, shot = shot_of("nikkor-85-f1.4", (5.0, 0.0), wavelengths=15)
    item = find_final(shot, ghost_path(load_lens("nikkor-85-f1.4"), 16, 15))
    sums = []
    for visibility in (float("inf"), 1e-3, 1e-4):
        canvas = blank(SIZE)
        draw_final(item, project.quality, canvas, visibility)
        sums.append(merge(canvas.planes, SIZE).sum(axis=(0, 1), dtype=np.float64))
    for few in sums[1:]:
        assert np.abs(few - sums[0]).max() < 0.05 * np.abs(sums[0]).max()


def test_colours_are_integrated_unless_wavelengths_stand_for_themselves():
    for count in (1, 3, 7):
        assert shot_of("tessar-brendel", (8.0, 5.0), wavelengths=count)[1].curves is not None
    alone = shot_of("tessar-brendel", (8.0, 5.0), wavelengths=7, bridge=False)[1]
    assert alone.curves is None
    assert traced_spectrum(alone, None, None, None) is None
    lines = Light(field_deg=(8.0, 5.0), spectrum=Lines(lines=((480.0, 1.0), (589.3, 2.0))))
    assert shot_of("tessar-brendel", (8.0, 5.0), light=lines)[1].curves is None


def test_interpolated_rays_keep_the_mean_and_follow_both_wavelengths():
    """Between a dark wavelength and a bright one, a ray's weight relative to the mean is interpolated."""
    short, long = np.zeros((2, STOP_X + 2)), np.zeros((2, STOP_X + 2))
    short[:, ALIVE] = long[:, ALIVE] = 1.0
    short[:, WEIGHT], long[:, WEIGHT] = [0.5e-3, 1.5e-3], [1.2, 0.8]
    data = rays_between(short, long, 0.5, 1e-3, 1.0)
    np.testing.assert_allclose(data[:, WEIGHT], 0.5005 * np.array([0.85, 1.15]))
    np.testing.assert_allclose(rays_between(short, long, 0.5, 1.0, 1.0)[:, WEIGHT], 0.5 * (short + long)[:, WEIGHT])
    short[0, ALIVE] = 0.0
    np.testing.assert_array_equal(rays_between(short, long, 0.25, 1.0, 1.0)[:, ALIVE], [0.0, 1.0])


def test_the_direct_light_follows_its_films():
    """At the traced wavelengths and between them, the lens passes the product of 1 - R of its surfaces."""
    lens = load_lens("tessar-brendel")
    _, shot = shot_of("tessar-brendel", (0.0, 0.0), wavelengths=5)
    nodes = shot.packed.wavelengths_nm
    fine = np.array([*nodes, 0.5 * (nodes[1] + nodes[2])])
    (flux,) = direct_flux([shot], lens, [direct_spectrum(shot, lens).carried], fine)
    exact = pack_lens(lens, first_order(lens), resolve_coatings(lens, FILM), fine)
    expected = np.prod(1.0 - exact.reflectance[:, :, -1], axis=1)
    np.testing.assert_allclose(flux, expected, rtol=2e-4)
    assert flux[-1] > 1.003 * flux[1:3].mean()
