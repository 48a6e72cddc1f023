"""Known features of flare photographs, in whole pictures through the public API.

Blades make n or 2n spikes. Ghosts have the shape of the iris, some upside down, and shrink as it closes. The ghosts of
a coated lens change their colour with the light's angle, those of a bare lens do not.
"""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.model import Bare, Camera, Everywhere, Film, Iris, Light, Lines, Output, Project, Quality, Stop
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order, gap_indices, path_matrices
from flarewright.optics.lens.paths import ghost_path, ghost_paths
from flarewright.optics.rays.single_rays import trace_polylines
from flarewright.render.analysis import ghosts
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

# --- spikes


@pytest.mark.parametrize(
    ("blades", "spikes"),
    # `test_pattern.py` counts the spikes of six blades
    [(5, 10), *(pytest.param(*more, marks=pytest.mark.slow) for more in ((6, 6), (7, 14), (8, 8)))],
)
def test_blades_make_n_spikes_or_2n(blades, spikes):
    """Two stops below wide open; opposite spikes of an even number of blades coincide."""
    size, pitch = (480, 480), 0.03
    project = Project(
        lens="heliar-tronnier", f_number=7.0, iris=Iris(blades=blades, rotation_deg=4.0),
        lights=(Light(field_deg=(0.0, 0.0)),), camera=Camera(size_px=size, sensor_mm=(size[0] * pitch,) * 2),
        # the starburst does not depend on the ghosts
        quality=Quality(mode="draft", paths="same-side", wavelengths=7), output=Output(layers="passes"),
    )  # fmt: skip
    star = next(layer for layer in render(project).layers if layer.name == "starburst")
    x, y, w, h = star.window
    whole = np.zeros((size[1], size[0]))
    whole[y : y + h, x : x + w] = star.pixels[..., 1]
    turn = np.linspace(0.0, 2.0 * np.pi, 1440, endpoint=False)
    ring = sum(
        whole[(240 - r * np.sin(turn)).astype(int), (240 + r * np.cos(turn)).astype(int)] * r**2
        for r in range(150, 230, 4)
    )
    bright = ring > 0.25 * ring.max()
    assert np.count_nonzero(bright & ~np.roll(bright, 1)) == spikes
    # between the spikes it is dark
    assert np.median(ring) < 0.02 * ring.max()


# --- the iris's shape


def polygon_moments(blades):
    """Return mean r^2 and mean z^n over a regular polygon of area pi whose first edge faces right, by quadrature."""
    node, weight = np.polynomial.legendre.leggauss(40)
    a = node * np.pi / blades
    apothem = np.sqrt(np.pi / (blades * np.tan(np.pi / blades)))
    r, each = apothem / np.cos(a), weight / (weight * (apothem / np.cos(a)) ** 2 / 2.0).sum()
    square = (each * r**4 / 4.0).sum()
    return square, (each * np.cos(blades * a) * r ** (blades + 2) / (blades + 2)).sum()


def shape_of(layer, camera):
    """Return the moments of a ghost about its centroid: mean r^2, and a function for mean z^n, upright, mm."""
    E = layer.pixels.sum(axis=2, dtype=np.float64)
    pitch = camera.sensor[0] / camera.size_px[0]
    row, column = np.mgrid[: E.shape[0], : E.shape[1]]
    z = pitch * (column - 1j * row)
    E /= E.sum()
    z = z - (E * z).sum()
    return float((E * np.abs(z) ** 2).sum()), lambda n: complex((E * z**n).sum())


@pytest.mark.parametrize(
    ("blades", "f_number", "which"),
    [
        (5, 16.0, "same-side"),
        pytest.param(6, 16.0, "same-side", marks=pytest.mark.slow),
        *(pytest.param(*rest, "all", marks=pytest.mark.slow) for rest in ((5, 16.0), (6, 16.0), (7, 11.0))),
    ],
)
def test_ghosts_take_the_iriss_shape_and_size(blades, f_number, which):
    """A distant light fills the stop evenly, and to first order a ghost is the stop, magnified by total / Ma."""
    lens = load_lens("canon-28-80")
    project = Project(
        lens=lens, f_number=f_number, iris=Iris(blades=blades, rotation_deg=10.0),
        lights=(Light(field_deg=(0.3, 0.2), spectrum=Lines(lines=((D_LINE_NM, 1.0),))),),
        camera=Camera(size_px=(500, 500), sensor_mm=(25.0, 25.0)),
        # diffraction rounds corners; this test is about rays
        quality=Quality(wavelengths=1, bridge=False, ringing="off", paths=which),
        output=Output(layers="ghosts", starburst=False, brightest=20 if which == "same-side" else 40),
    )  # fmt: skip
    order = first_order(lens, f_number)
    sensor_z = sum(row.thickness for row in lens.rows[:-1]) + order.sensor_distance
    paths = {path.name: path for path in ghost_paths(lens)}
    square, edge = polygon_moments(blades)
    seen = {-1: 0, 1: 0}
    for layer in render(project).layers:
        if not layer.name.startswith("ghost."):
            continue
        to_stop, total = path_matrices(lens, paths[str(layer.about["path"])], D_LINE_NM, sensor_z)
        scales = sorted((total[0, 0] / Ma[0, 0] for Ma in to_stop), key=abs)
        radius = abs(scales[0]) * order.stop_semi_diameter
        # ghosts within the picture that are larger than a dot and cut at one crossing of the stop only
        if not 0.6 < radius < 7.0 or (len(scales) > 1 and abs(scales[1]) < 1.3 * abs(scales[0])):
            continue
        found, moment = shape_of(layer, project.camera)
        assert np.sqrt(found) == pytest.approx(radius * np.sqrt(square), rel=0.06), layer.name
        # the harmonic of the blades equals that of the polygon; there are no others
        ideal = abs(edge) * (found / square) ** (blades / 2)
        assert abs(moment(blades)) == pytest.approx(ideal, rel=0.1), layer.name
        for n in set(range(3, 9)) - {blades}:
            assert abs(moment(n)) < 0.05 * found ** (n / 2), (layer.name, n)
        # first edge up, rotated; showing the picture upright undoes the rotation by the lens
        sign = -1 if scales[0] > 0.0 else 1
        facing = blades * np.radians(90.0 + 10.0) + (np.pi if sign**blades < 0 else 0.0)
        # the harmonic is negative at an edge, where the polygon is nearest
        off = np.angle(moment(blades) * np.exp(-1j * facing) / np.sign(edge))
        assert abs(off) < 0.1, layer.name
        seen[sign] += 1
    # some have the orientation of the iris, some are upside down
    assert min(seen.values()) >= 3, seen


# --- colours of coatings

BLUE_NM, RED_NM = 450.0, 650.0
FILM = Film(index=1.38, thickness_nm=550.0 / 4.0 / 1.38)


def airy(n0, n1, n2, thickness_nm, cosine, wavelength_nm):
    """Return R of one film, mean of both polarisations, by Airy's sum (Hecht, section 9.6.1)."""
    s = n0 * np.sqrt(1.0 - cosine**2)
    c0, c1, c2 = (np.sqrt(1.0 - (s / n) ** 2) for n in (n0, n1, n2))
    turn = np.exp(4j * np.pi * n1 * thickness_nm * c1 / wavelength_nm)
    both = []
    for a, b, c in ((n0 * c0, n1 * c1, n2 * c2), (n0 / c0, n1 / c1, n2 / c2)):
        first, second = (a - b) / (a + b), (b - c) / (b + c)
        both.append(abs((first + second * turn) / (1.0 + first * second * turn)) ** 2)
    return 0.5 * sum(both)


def along_the_chief_ray(lens, ghost, field_deg, wavelength_nm, film):
    """Multiply R and T along the ray of a ghost through the centre of the stop; also return its steepest angle."""
    path = ghost_path(lens, *ghost)
    # a dense fan over the front; the ray closest to the centre of the stop is the chief ray
    y = np.linspace(-60.0, 60.0, 6001)
    hits = trace_polylines(lens, ghost, np.zeros_like(y), y, np.radians(field_deg), wavelength_nm=wavelength_nm)
    at_stop = [1 + k for k, row in enumerate(path.rows) if isinstance(lens.rows[row], Stop)]
    off = np.abs(hits[:, at_stop, 1]).max(axis=1)
    ray = hits[np.nanargmin(off)]
    n = gap_indices(lens, wavelength_nm)
    legs = np.diff(ray, axis=0)
    z = np.concatenate([[0.0], np.cumsum([row.thickness for row in lens.rows[:-1]])])
    passed, steepest, forward, mirrors = 1.0, 0.0, True, 0
    legs[0] = 0.0, np.sin(np.radians(field_deg)), np.cos(np.radians(field_deg))
    for k, row in enumerate(path.rows):
        surface = lens.rows[row]
        if isinstance(surface, Stop):
            continue
        before = legs[k] / np.linalg.norm(legs[k])
        normal = np.array([0.0, 0.0, 1.0]) - surface.curvature * (ray[k + 1] - [0.0, 0.0, z[row]])
        cosine = abs(before @ normal) / np.linalg.norm(normal)
        n0, n2 = (n[row], n[row + 1]) if forward else (n[row + 1], n[row])
        coated = film and 1.0 in (n0, n2)
        R = airy(n0, film.index if coated else n0, n2, film.thickness_nm if coated else 0.0, cosine, wavelength_nm)
        if mirrors < 2 and row == ghost[mirrors]:
            # the angle in air, by Snell
            air = np.degrees(np.arcsin(min(1.0, n0 * np.sqrt(1.0 - cosine**2))))
            passed, steepest, forward, mirrors = passed * R, max(steepest, air), not forward, mirrors + 1
        else:
            passed *= 1.0 - R
    return passed, steepest


def red_over_blue(field_deg, film, wanted):
    """Return red over blue from `flarewright ghosts`, by path, for the wanted paths."""
    some = tuple(ghost_path(load_lens("flektogon-35"), *path) for path in wanted)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flarewright.optics.rays.ghost_table.ghost_paths", lambda *_, **__: some)
        return _red_over_blue(field_deg, film, wanted)


def _red_over_blue(field_deg, film, wanted):
    choice = Everywhere(coating=Bare() if film is None else film)
    blue, red = (
        {(g.first_reflection, g.second_reflection): g.throughput_mm2 for g in table.ghosts}
        for table in (
            ghosts("flektogon-35", (0.0, field_deg), f_number=22.0, coating=choice, wavelength_nm=nm)
            for nm in (BLUE_NM, RED_NM)
        )
    )
    return {path: red[path] / blue[path] for path in wanted}


@pytest.mark.slow
def test_colours_of_a_coated_lens_shift_with_the_angle():
    """A film is effectively thinner for an oblique ray: its minimum moves to blue and it reflects more red.

    Compared with R and T multiplied along each ghost's chief ray; the stop is small enough for that.
    """
    lens = load_lens("flektogon-35")
    paths = [(10, 9), (9, 8), (12, 10), (4, 3), (1, 0)]
    near, far = (red_over_blue(field, FILM, paths) for field in (3.0, 25.0))
    for path in paths:
        for field, reported in ((3.0, near), (25.0, far)):
            (blue, _), (red, steepest) = (along_the_chief_ray(lens, path, -field, nm, FILM) for nm in (BLUE_NM, RED_NM))
            assert reported[path] == pytest.approx(red / blue, rel=0.05), (path, field)
        # the steeper the ray, the redder: 8 times at 37 degrees
        assert far[path] > near[path]
        if steepest > 35.0:
            assert far[path] > 5.0 * near[path]
    bare = [red_over_blue(field, None, paths) for field in (3.0, 25.0)]
    for path in paths:
        # dispersion only
        assert bare[0][path] == pytest.approx(0.92, abs=0.08)
        assert bare[1][path] == pytest.approx(bare[0][path], rel=0.05)


@pytest.mark.parametrize(
    ("size", "how"),
    [
        ((120, 80), {"ringing": "off"}),
        pytest.param((240, 160), {}, marks=pytest.mark.slow),
    ],
)
def test_in_the_picture_too(size, how, monkeypatch):
    """One ghost of a wide lens, light at 3 and at 25 degrees: violet turns to orange; grey stays grey."""

    if how:
        alone = ghost_path(load_lens("flektogon-35"), 10, 9)
        monkeypatch.setattr("flarewright.render.render.ghost_paths", lambda *_, **__: (alone,))

    def shade(field_deg, coating):
        project = Project(
            lens="flektogon-35", f_number=16.0, lights=(Light(field_deg=(field_deg, 0.0)),),
            coating=Everywhere(coating=coating), camera=Camera(size_px=size, sensor_mm=(72.0, 48.0)),
            quality=Quality(wavelengths=9, **how),
            output=Output(layers="ghosts", starburst=False, brightest=80, colorspace="acescg"),
        )  # fmt: skip
        layer = next(layer for layer in render(project).layers if layer.name == "ghost.10-9")
        light = layer.pixels.sum(axis=(0, 1), dtype=np.float64)
        return light / light.sum()

    near, far = (shade(field, FILM) for field in (3.0, 25.0))
    assert near[2] > 3.0 * near[0] > 9.0 * near[1]
    assert far[0] > 1.5 * far[2]
    assert far[0] > 2.0 * far[1] > 2.0 * near[1]
    bare = [shade(field, Bare()) for field in (3.0, 25.0)]
    assert bare[1] == pytest.approx(bare[0], rel=0.01)
    assert bare[0] == pytest.approx([1.0 / 3.0] * 3, abs=0.02)
