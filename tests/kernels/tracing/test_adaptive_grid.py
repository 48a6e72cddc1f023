"""The bundle's grid: no cracks, no overlaps, no lit region left out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flarewright.kernels.raster.bundle import measure_bundle
from flarewright.kernels.tracing.sequential import trace_nodes
from flarewright.model import Iris, Light, Project, Quality
from flarewright.optics.lens.paths import LightPath, ghost_path, ghost_paths
from flarewright.optics.pupil.iris import blade_edges
from flarewright.optics.rays.bundle import Refinement, trace_grid, trace_points
from flarewright.optics.rays.pupil_region import find_region, front_box, tracing_arguments
from flarewright.render.ghosts.traced_ghosts import draw_final, find_final
from flarewright.render.image.canvas import blank, merge
from flarewright.render.scene.art_rules import PLAIN
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shot import Shot
from flarewright.render.scene.shots import make_shots


def shot_of(lens: str, field_deg, f_number: float, wavelengths: int = 3) -> Shot:
    project = Project(
        lens=lens,
        f_number=f_number,
        iris=Iris(),
        lights=(Light(field_deg=field_deg),),
        quality={"wavelengths": wavelengths},
    )
    settled = resolve_project(project)
    return make_shots(settled, make_opening(settled, None))[0]


def mesh_of(
    shot: Shot, path: LightPath, tolerance: float = 0.25, scale: float = 10.0, rough: int = 0,
    view_radius: float = np.inf,
):  # fmt: skip
    region = find_region(shot.packed, path, shot.incidence.tilt, shot.opening.radius, shot.view_radius)
    if region is None:
        return None, None
    bundle = trace_grid(
        shot.packed, path, shot.incidence.tilt, (shot.opening.radius, shot.opening.inner), region,
        Refinement(scale, tolerance, view_radius, rough=rough),
    )  # fmt: skip
    return region, bundle


def signed_areas(pupil, triangles) -> np.ndarray:
    a, b, c = (pupil[triangles[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


MESHES = [
    ("heliar-tronnier", (8.0, 5.0), 3.5, (4, 1)),
    ("heliar-tronnier", (8.0, 5.0), 8.0, (8, 3)),
    ("tessar-brendel", (8.0, 5.0), 2.8, (7, 6)),
    ("tessar-brendel", (0.0, 0.0), 8.0, (5, 4)),
    ("canon-28-80", (15.0, 8.0), 2.8, (26, 24)),
    ("double-gauss-tronnier", (8.0, 5.0), 8.0, (10, 4)),
]


@cache
def meshed(lens: str, field, f_number: float, pair):
    """Return shot, path, region and grid of one of the meshes."""
    shot, path = shot_of(lens, field, f_number), ghost_path(load_lens(lens), *pair)
    return shot, path, *mesh_of(shot, path)


@pytest.mark.parametrize(("lens", "field", "f_number", "pair"), MESHES)
def test_the_grid_has_no_cracks(lens, field, f_number, pair):
    """Every inner edge belongs to two triangles that run along it in opposite directions; no node lies on an edge."""
    _, _, region, bundle = meshed(lens, field, f_number, pair)
    pupil, triangles = bundle.pupil, bundle.triangles
    assert len(triangles) > 32
    assert (signed_areas(pupil, triangles) > 0.0).all()
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    # encode an edge as one number
    along, against = (directed[:, k] * len(pupil) + directed[:, 1 - k] for k in (0, 1))
    assert np.diff(np.sort(along)).min() > 0
    border = directed[~np.isin(along, against, assume_unique=True)]
    # edges without a partner form the border of the kept cells: each node has as many incoming as outgoing edges
    outs, ins = (np.bincount(border[:, k], minlength=len(pupil)) for k in (0, 1))
    assert np.array_equal(ins, outs)
    # a T-junction would be a border node in the middle of a border edge that runs the other way
    ends, middles = (np.round(at, 9) @ [1.0, 1.0j] for at in (pupil[border[:, 0]], pupil[border].mean(axis=1)))
    assert not np.isin(middles, ends).any()
    assert region.box[0] - 1e-9 <= pupil[triangles, 0].min()
    assert pupil[triangles, 0].max() <= region.box[1] + 1e-9


@pytest.mark.parametrize(("lens", "field", "f_number", "pair"), MESHES)
def test_triangles_tile_the_kept_cells(lens, field, f_number, pair):
    """Any point of the box lies in one triangle, or in a cell that is left out and passes no light."""
    shot, path, region, bundle = meshed(lens, field, f_number, pair)
    rng = np.random.default_rng(1)
    low, high = region.box[[0, 2]], region.box[[1, 3]]
    points = rng.uniform(low, high, (600, 2))
    corners = bundle.pupil[bundle.triangles]
    # pair each triangle with the points between its left and right bounds
    points = points[np.argsort(points[:, 0])]
    first = np.searchsorted(points[:, 0], corners[..., 0].min(axis=1))
    count = np.searchsorted(points[:, 0], corners[..., 0].max(axis=1), side="right") - first
    near = corners[np.repeat(np.arange(len(corners)), count)]
    which = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
    edges, at = np.roll(near, -1, axis=1) - near, points[which][:, None] - near
    inside = ((edges[..., 0] * at[..., 1] - edges[..., 1] * at[..., 0]) >= 0.0).all(axis=1)
    hits = np.bincount(which[inside], minlength=len(points))
    assert hits.max() <= 1
    # the triangles have the area of the kept cells
    share = signed_areas(bundle.pupil, bundle.triangles).sum() / float((high - low).prod())
    assert hits.mean() == pytest.approx(share, abs=4.0 * np.sqrt(0.25 / len(points)))
    left_out = points[hits == 0]
    for w in range(len(shot.packed.wavelengths_nm)):
        data = trace_points(shot.packed, w, path, shot.incidence.tilt, left_out)
        at_stop = data[:, 5:].reshape(len(left_out), -1, 2)
        passing = (data[:, 4] > 0) & (data[:, 3] <= 1.0)
        passing &= (np.hypot(at_stop[..., 0], at_stop[..., 1]) <= shot.opening.radius).all(axis=1)
        assert passing.sum() <= 1


def test_a_finer_tolerance_makes_a_finer_grid_and_the_same_flux():
    shot = shot_of("heliar-tronnier", (8.0, 5.0), 3.5)
    path = ghost_path(load_lens("heliar-tronnier"), 4, 1)
    blades = blade_edges(Iris(), shot.packed.stop_semi)
    found = []
    for tolerance in (1.0, 0.25, 0.05):
        _, bundle = mesh_of(shot, path, tolerance)
        data = trace_points(shot.packed, 1, path, shot.incidence.tilt, bundle.pupil)
        sums = measure_bundle(data, bundle.pupil, bundle.triangles, 1, blades, shot.incidence.axes, 2)
        found.append((len(bundle.triangles), sums[0]))
    assert found[0][0] <= found[1][0] < found[2][0]
    assert found[0][1] == pytest.approx(found[2][1], rel=2e-3)
    assert found[1][1] == pytest.approx(found[2][1], rel=1e-3)


@pytest.mark.parametrize("rough", [1, 3])
def test_a_rough_rim_takes_fewer_rays_and_keeps_the_flux(rough):
    """Compared with fine grids: a single faint ghost may lose some flux, all faint ghosts together almost none."""
    shot = shot_of("canon-28-80", (15.0, 8.0), 8.0)
    blades = blade_edges(Iris(blades=6), shot.packed.stop_semi)
    flux, nodes = [], []
    for path in ghost_paths(load_lens("canon-28-80"), "same-side")[::9]:
        grids = [mesh_of(shot, path, tolerance, 10.0, r)[1] for tolerance, r in ((0.05, 0), (0.25, 0), (0.25, rough))]
        if grids[0] is None:
            continue
        crossings = path.stop_crossings
        flux.append(
            [
                measure_bundle(b.traced[1], b.pupil, b.triangles, crossings, blades, shot.incidence.axes, 2)[0]
                for b in grids
            ]
        )
        nodes.append([len(b.pupil) for b in grids])
    fine, _, coarse = np.array(flux).T
    share = np.array(nodes)[:, 2].sum() / np.array(nodes)[:, 1].sum()
    assert len(flux) > 12
    assert share < 0.75
    lit = fine > 1e-6 * fine.max()
    # such a ghost has less than 1.5 % of the picture's mean, so the error is less than 0.1 % of the mean
    assert coarse[lit] == pytest.approx(fine[lit], rel=0.05)
    assert np.median(np.abs(coarse[lit] / fine[lit] - 1.0)) < 2e-3
    assert coarse.sum() == pytest.approx(fine.sum(), rel=2e-3)


@pytest.mark.parametrize("count", [1, 7, 8, 9, 63, 64, 65, 127])
def test_a_ray_is_the_same_among_any_number(count):
    """The last set of lanes is shorter, a number of whole vectors, and must trace all its rays."""
    shot = shot_of("heliar-tronnier", (8.0, 5.0), 3.5)
    path = ghost_path(load_lens("heliar-tronnier"), 8, 3)
    points = np.random.default_rng(3).uniform(-12.0, 12.0, (130, 2))
    every = trace_points(shot.packed, 1, path, shot.incidence.tilt, points)
    some = trace_points(shot.packed, 1, path, shot.incidence.tilt, points[:count])
    alive = every[:count, 4] > 0.0
    assert np.array_equal(some[:, 4] > 0.0, alive)
    assert some[alive] == pytest.approx(every[:count][alive], rel=1e-12, abs=1e-12)


def dense_flux(shot: Shot, path: LightPath, w: int, n: int) -> tuple[float, float]:
    """Return the flux of a dense scan of half the front, and the part of it inside the pre-pass box."""
    packed, tilt = shot.packed, shot.incidence.tilt
    x0, x1, y0, y1 = front_box(packed, tilt)
    hx, hy = (x1 - x0) / n, (y1 - y0) / (2 * n)
    px, py = np.meshgrid(x0 + hx * (np.arange(n) + 0.5), y0 + hy * (np.arange(2 * n) + 0.5), indexing="ij")
    px, py = px.ravel(), py.ravel()
    data = np.empty((px.size, 5 + 2 * path.stop_crossings))
    trace_nodes(*tracing_arguments(packed, w, path, tilt), px, py, data)
    passing = (data[:, 4] > 0) & (data[:, 3] <= 1.0)
    for c in range(path.stop_crossings):
        passing &= np.hypot(data[:, 5 + 2 * c], data[:, 6 + 2 * c]) <= shot.opening.radius
    weight = np.where(passing, data[:, 2], 0.0) * hx * hy * 2.0 * shot.incidence.cosine
    entry = (
        None if path.entry is None else find_region(shot.packed, path.entry, shot.incidence.tilt, shot.opening.radius)
    )
    item = find_final(shot, path, PLAIN, entry)
    if item is None:
        return float(weight.sum()), 0.0
    region = item.region
    b = region.box
    inside = (px >= b[0]) & (px <= b[1]) & (py >= b[2]) & (py <= b[3])
    return float(weight.sum()), float(weight[inside].sum())


def missed(lens: str, field, f_number: float, which: str, n: int, wavelengths: int = 3) -> float:
    """Return the part of the light that dense scans find outside the pre-pass boxes, over all wavelengths.

    `which` selects the paths as `ghost_paths` does, or names one.
    """
    shot = shot_of(lens, field, f_number, wavelengths)
    total = kept = 0.0
    some = which if which in ("all", "same-side") else "all"
    for path in (path for path in ghost_paths(load_lens(lens), some) if which in (some, path.name)):
        for w in range(len(shot.packed.wavelengths_nm)):
            everything, inside = dense_flux(shot, path, w, n)
            total, kept = total + everything, kept + inside
    assert total > 0.0
    return 1.0 - kept / total


@pytest.mark.parametrize("f_number", [3.5, 8.0])
def test_the_prepass_misses_nothing(f_number):
    assert missed("heliar-tronnier", (12.0, 7.0), f_number, "all", 64) < 1e-4


FIELDS = [(3.0, 0.0), (8.0, 5.0), (20.0, 10.0), (33.0, 12.0)]


@pytest.mark.parametrize("which", ["3-1", pytest.param("all", marks=pytest.mark.slow)])
def test_the_prepass_misses_no_colour_of_a_large_region(which):
    """3-1 of this lens fills much of the front; its blue edge lies more than one pre-pass cell farther out."""
    assert missed("angenieux-50-f1.1", (8.0, 5.0), 4.0, which, 64) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("f_number", [2.8, 8.0, 16.0])
@pytest.mark.parametrize("field", FIELDS)
def test_the_prepass_misses_nothing_of_the_zoom(field, f_number):
    """Compare 351 paths of the Canon 28-80 with 256 x 256 rays each, at the wavelength of the pre-pass."""
    assert missed("canon-28-80", field, f_number, "all", 128, wavelengths=1) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("field", "f_number"),
    [
        ((33.0, 12.0), 2.8),
        ((20.0, 10.0), 8.0),
        ((33.0, 12.0), 8.0),
        ((20.0, 10.0), 16.0),
        ((33.0, 12.0), 16.0),
    ],
)
def test_the_prepass_misses_no_colour(field, f_number):
    assert missed("canon-28-80", field, f_number, "all", 128) < 1e-4


def test_a_sliver_between_two_critical_angles_is_found_and_drawn():
    """Path 25-21 of the zoom, far outside the picture: rays on either side of the sliver end at different surfaces."""
    shot = shot_of("canon-28-80", (33.0, 12.0), 16.0, 1)
    path = ghost_path(load_lens("canon-28-80"), 25, 21)
    region, bundle = mesh_of(shot, path)
    # the sliver is 0.07 mm high, pre-pass cells 1.03 mm; the main region begins at 31.77 mm
    assert 29.0 < region.box[2] < 30.186
    data = trace_points(shot.packed, 0, path, shot.incidence.tilt, bundle.pupil)
    lit = (data[:, 4] > 0.0) & (data[:, 3] <= 1.0) & (np.hypot(data[:, 5], data[:, 6]) <= shot.opening.radius)
    beside = bundle.pupil[lit & (bundle.pupil[:, 1] < 31.0)]
    assert len(beside) > 0
    assert 30.16 < beside[:, 1].min() < beside[:, 1].max() < 30.28


def test_what_lands_beside_the_picture_is_not_refined_on_either_side():
    """Mirrored ghosts that end in total reflection beyond the picture: fewer rays, the same picture."""
    # at the angle of the benchmarks, where such ghosts take a tenth of the time of all 171
    shot = shot_of("canon-28-80", (15.0, 8.0), 2.8)
    quality = Quality(wavelengths=3, bridge=False)
    for pair in ((22, 21), (23, 21), (25, 24)):
        item = find_final(shot, ghost_path(load_lens("canon-28-80"), *pair))
        pictures, nodes = [], []
        for view in (item.view_radius, np.inf):
            canvas = blank((240, 135))
            to_pixels = item.to_pixels * (240 / shot.size_px[0])
            draw_final(replace(item, view_radius=view, to_pixels=to_pixels), quality, canvas)
            pictures.append(merge(canvas.planes, canvas.size_px))
            nodes.append(len(mesh_of(shot, item.path, scale=to_pixels[2], view_radius=view)[1].pupil))
        seen, all_of_it = np.asarray(pictures, dtype=float)
        assert nodes[0] < 0.1 * nodes[1]
        assert seen.sum() == pytest.approx(all_of_it.sum(), rel=2e-4)
        # at a corner of the picture a coarse neighbouring cell may change one pixel; finer grids differ as much
        assert np.sqrt(np.mean((seen - all_of_it) ** 2)) < 2e-3 * all_of_it.mean()
        assert np.abs(seen - all_of_it).max() < 0.05 * all_of_it.max()
