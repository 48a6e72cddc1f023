"""A dense search of the pupil, independent of the program's, and what the program misses of each ghost.

The program bounds a path's light in the pupil by scans (`optics.rays.pupil_region`) and follows it by an adaptive
grid. This search uses neither: it halves cells of the whole entrance with random rays in them, wherever rays of a cell
end differently or come near a rim or the stop. The program's kernel traces the rays, which `test_rays_against_oracle`
compares with the oracle; `confirm` integrates the light that was found with the oracle.

`python tests/physics/islands.py LENS ...` searches lenses at five angles, bare and coated, and prints a line for every
path that differs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt
from pathlib import Path

import numpy as np
import oracle

from flarewright.errors import FlarewrightError
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y
from flarewright.model import Bare, Coating, CoatingChoice, Everywhere, Iris, Lens, QuarterWave
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import LightPath, ghost_paths
from flarewright.optics.pupil.iris import blade_edges
from flarewright.optics.rays import ghost_table
from flarewright.optics.rays.bundle import Bundle, Incidence, incidence, trace_bundle, trace_points
from flarewright.optics.rays.image_height import image_heights
from flarewright.optics.rays.pack import PackedLens, facing, pack_lens, resolve_coatings
from flarewright.optics.rays.pupil_region import find_region, front_box
from flarewright.render.scene.resolve import load_lens
from flarewright.typing import Floats, Indices, Mask

# limits on flux, rms radius and missed light, and the least ghost relative to the strongest
FLUX, SIZE, MISSED, FLOOR = 0.01, 0.02, 0.01, 1e-4
# image heights of the lights in half diagonals of the picture; the last is near the corner
HEIGHTS = (0.1, 0.25, 0.5, 0.75, 0.97)
HALF_DIAGONAL = hypot(36.0, 24.0) / 2.0
COATINGS = {"bare": Everywhere(coating=Bare()), "coated": Everywhere(coating=QuarterWave(center_wavelength_nm=532.0))}

# halvings of cells that rays end in at different surfaces, and of all others
ENDS, LEVELS = 3, 12
# columns and rows of a cell's quarters
QUARTERS = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
# cells along the entrance, half as many across its half; the border is halved until its cells hold this part of the
# light, full cells until this many rays pass: at first, and where the first search finds a difference
FIRST, SECOND = (64, 0.1, 800), (128, 0.03, 4000)
# most rays of a path
MOST = 400_000
# level at which a path too faint to matter is dropped, and how much its light may still grow
EARLY, GROWTH = 3, 4.0


@dataclass(frozen=True)
class Found:
    """Light of one path by the dense search; rectangles of the pupil, meridional frame, x >= 0, mm."""

    flux: float
    rms: float
    rays: Floats
    """Passing rays, shape (N, 3): place in the pupil, and the light that it represents."""
    cells: Floats
    """x, y, width, height of all rectangles that may hold light, shape (M, 4)."""


@dataclass(frozen=True)
class Difference:
    """What the program shows of a ghost, and what there is; flux in mm^2, sizes in mm."""

    lens: str
    field_deg: tuple[float, float]
    coating: str
    path: tuple[int, ...]
    flux: float
    true_flux: float
    rms: float
    true_rms: float
    missed: float
    """The part of the true flux outside the program's grid."""
    doubt: tuple[float, float] = (0.0, 0.0)
    """Four standard errors of the true flux and rms radius, relative; inf for a size that is not finite."""

    def is_bad(self, part: float = 1.0) -> bool:
        """Return whether flux, size or missed light differ by more than `part` of their limits."""
        fluxes, sizes = abs(self.flux / self.true_flux - 1.0), abs(self.rms / self.true_rms - 1.0)
        wrong = fluxes > part * FLUX + self.doubt[0] or sizes > part * SIZE + self.doubt[1]
        return wrong or self.missed > part * MISSED

    def __str__(self) -> str:
        path = "-".join(map(str, self.path))
        x, y = self.field_deg
        return (
            f"{self.lens}  {x:.2f},{y:.2f}  {self.coating}  {path}  flux {self.true_flux:.3e} "
            f"{self.flux / self.true_flux - 1.0:+.1%} (+-{self.doubt[0]:.1%})  rms {self.true_rms:.4f} "
            f"{self.rms / self.true_rms - 1.0:+.1%} (+-{self.doubt[1]:.1%})  missed {self.missed:.1%}"
        )


@dataclass(frozen=True)
class Setup:
    """A lens with coatings facing a light."""

    lens: Lens
    packed: PackedLens
    light: Incidence
    coatings: Sequence[Coating | None]


def setup(lens: Lens, field_deg: tuple[float, float], coating: CoatingChoice) -> Setup:
    order = first_order(lens)
    coatings = resolve_coatings(lens, coating)
    packed = pack_lens(lens, order, coatings, np.array([D_LINE_NM]))
    light = incidence(field_deg)
    return Setup(lens, facing(packed, light.axes, light.nearness), light, coatings)


def dense_search(
    made: Setup, path: LightPath, effort: tuple[int, float, int] = SECOND, least: float = 0.0
) -> Found | None:
    """Search the whole entrance for a path's light; None when no ray passes, or much less than `least` mm^2."""
    packed, rng, (ny, most_border, least_rays) = made.packed, np.random.default_rng(path.mirrors), effort
    x0, x1, y0, y1 = front_box(packed, made.light.tilt)
    grid = np.array([ny // packed.halves, ny])
    origin, size = np.array([x0, y0]), np.array([x1 - x0, y1 - y0]) / grid
    cells = np.stack(np.meshgrid(np.arange(grid[0]), np.arange(grid[1]), indexing="ij"), axis=2).reshape(-1, 2)
    spent = 0
    full: list[tuple[Floats, Floats]] = []
    settled: list[Indices] = []
    for level in range(LEVELS + 1):
        record, far = _four_rays(made, path, rng, origin, size, cells)
        # an arc of light may continue where no ray of a coarser cell has met it
        while len(more := _unsearched(cells, record, settled, grid)) and spent + 4 * (len(cells) + len(more)) < MOST:
            also, also_far = _four_rays(made, path, rng, origin, size, more)
            cells, record, far = (np.concatenate(pair) for pair in ((cells, more), (record, also), (far, also_far)))
        spent += 4 * len(cells)
        count = (record[:, :, 2] > 0.0).sum(axis=1)
        near = (count > 0) | _may_pass(far, level)
        # light that enters a cell's corner may miss its four rays
        near |= _beside(cells, count > 0)
        border = near & (count < 4)
        whole = count == 4
        held = sum(float(part[:, :, 2].sum()) for part, _ in full)
        here = float(record[:, :, 2].sum())
        inside = sum(len(part) for part, _ in full) * 4 + 4 * int(whole.sum())
        if here + held <= 0.0 and not near.any():
            return None
        # cells in which all rays pass need no halving, unless there are few
        done = whole & (inside >= least_rays)
        again = (whole & ~done) | border
        on_border = float(record[border, :, 2].sum())
        enough = here + held > 0.0 and on_border < most_border * (here + held) and not (whole & ~done).any()
        if level == EARLY and packed.halves * (here + held) * GROWTH < least:
            return None
        last = (enough and level > ENDS + 1) or level == LEVELS or spent + 16 * int(again.sum()) > MOST
        if last:
            done = done | again
        else:
            # the rays that chose full cells would overestimate them
            record[done], _ = _four_rays(made, path, rng, origin, size, cells[done])
            spent += 4 * int(done.sum())
        full.append((record[done], np.column_stack([origin + size * cells, np.broadcast_to(size, cells.shape)])[done]))
        if last or not again.any():
            break
        settled.append(cells[done])
        cells = (2 * cells[again][:, None] + QUARTERS).reshape(-1, 2)
        size, grid = 0.5 * size, 2 * grid
    rays = np.concatenate([part.reshape(-1, 5) for part, _ in full])
    rays = rays[rays[:, 2] > 0.0]
    if not len(rays):
        return None
    flux = packed.halves * float(rays[:, 2].sum())
    part = rays[:, 2] / rays[:, 2].sum()
    middle = np.array([0.0 if packed.halves == 2 else part @ rays[:, 3], part @ rays[:, 4]])
    away = np.hypot(*(rays[:, 3:5] - middle).T)
    rms = sqrt(float(part @ away**2))
    return Found(flux * made.light.cosine, rms, rays[:, :3], np.concatenate([cells for _, cells in full]))


def _four_rays(
    made: Setup, path: LightPath, rng: np.random.Generator, origin: Floats, size: Floats, cells: Indices
) -> tuple[Floats, Floats]:
    """Trace a random ray in each quarter of cells, given by columns and rows, shape (N, 2).

    Returns the rays' places in the pupil, light, and places on the sensor, shape (N, 4, 5); and how far out they come:
    the largest r / semi-diameter of rims and stop, and the surface where they end, -1 for none, shape (N, 4, 2).
    """
    packed = made.packed
    places = (origin + size * (cells[:, None] + 0.5 * (QUARTERS + rng.random((len(cells), 4, 2))))).reshape(-1, 2)
    rays = trace_points(packed, 0, path, made.light.tilt, places)
    far = rays[:, REL].copy()
    for crossing in range(path.stop_crossings):
        at = STOP_X + 2 * crossing
        far = np.maximum(far, np.hypot(rays[:, at], rays[:, at + 1]) / packed.stop_semi)
    alive = rays[:, ALIVE] > 0.0
    light = np.where(alive & (far <= 1.0), rays[:, WEIGHT], 0.0) * size.prod() / 4.0
    record = np.column_stack([places, light, rays[:, X], rays[:, Y]])
    outside = np.column_stack([np.where(alive, far, np.inf), np.where(alive, -1.0, rays[:, X])])
    return record.reshape(-1, 4, 5), outside.reshape(-1, 4, 2)


def _may_pass(rays: Floats, level: int) -> Mask:
    """Return which cells may pass light although all four rays fail; `rays` as `far` of `_four_rays`."""
    far, ends = rays[:, :, 0], rays[:, :, 1]
    alive = np.isfinite(far)
    least, most = far.min(axis=1), np.where(alive, far, 0.0).max(axis=1)
    some, every = alive.any(axis=1), alive.all(axis=1)
    with np.errstate(invalid="ignore"):
        close = every & (least - 1.5 * (most - least) <= 1.0)
    ended = ~some & (ends.min(axis=1) < ends.max(axis=1)) & (level < ENDS)
    return np.asarray(close | (some & ~every & (least < (3.0 if level < ENDS else 1.5))) | ended)


def _keys(cells: Indices) -> Indices:
    """Return a number for each cell, given by columns and rows, shape (N, 2)."""
    return np.asarray(cells[:, 0] * 2**24 + cells[:, 1])


def _around(cells: Indices) -> Indices:
    """Return cells and their eight neighbours, some of them repeatedly."""
    shifts = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)])
    return np.asarray((cells[:, None] + shifts).reshape(-1, 2))


def _beside(cells: Indices, lit: Mask) -> Mask:
    """Return which cells touch a lit one."""
    return np.isin(_keys(cells), _keys(_around(cells[lit])))


def _unsearched(cells: Indices, record: Floats, settled: Sequence[Indices], grid: Indices) -> Indices:
    """Return the neighbours of lit cells that are not searched; `settled` holds the full cells of coarser levels."""
    around = _around(cells[(record[:, :, 2] > 0.0).any(axis=1)])
    around = around[((around >= 0) & (around < grid)).all(axis=1)]
    # numbers sort faster than rows of two
    around = around[np.unique(_keys(around), return_index=True)[1]]
    known = np.isin(_keys(around), _keys(cells))
    for k, full in enumerate(settled):
        known |= np.isin(_keys(around >> (len(settled) - k)), _keys(full))
    return np.asarray(around[~known])


def covered(bundle: Bundle, places: Floats) -> Mask:
    """Return which places of the pupil lie in a cell of a bundle's grid."""
    middles = bundle.triangles[:, 0]
    corners = bundle.pupil[bundle.triangles]
    first = np.flatnonzero(np.append(True, middles[1:] != middles[:-1]))
    low = np.minimum.reduceat(corners.min(axis=1), first)
    high = np.maximum.reduceat(corners.max(axis=1), first)
    inside = np.zeros(len(places), dtype=bool)
    sizes = np.round(np.log2((high - low)[:, 0] / (high - low)[:, 0].max())).astype(int)
    origin = bundle.pupil.min(axis=0)
    for level in np.unique(sizes):
        step = (high - low)[sizes == level].mean(axis=0)
        cells = np.round((low[sizes == level] - origin) / step).astype(np.int64)
        at = np.floor((places - origin) / step).astype(np.int64)
        inside |= np.isin(at[:, 0] * 2**24 + at[:, 1], cells[:, 0] * 2**24 + cells[:, 1])
    return inside


def measured(made: Setup, path: LightPath) -> tuple[float, float, Bundle | None]:
    """Return flux and rms radius of a path as in the program's ghost table, and its grid."""
    packed, light = made.packed, made.light
    region = find_region(packed, path, light.tilt, packed.stop_semi)
    if region is None:
        return 0.0, 0.0, None
    bundle = ghost_table._grid(packed, path, light, region, 1e-6)
    rough = ghost_table._rough_size(
        ghost_table._sample(packed, bundle, light, bundle.pupil[bundle.triangles]), bundle.halves
    )
    bundle = ghost_table._grid(packed, path, light, region, ghost_table.RESOLUTION / max(rough, 1e-4))
    data = trace_bundle(packed, 0, bundle, light.tilt)
    sums = ghost_table._integrate(packed, bundle, data, light, blade_edges(Iris(), packed.stop_semi))
    if sums[0] <= 0.0:
        return 0.0, 0.0, bundle
    x, y = sums[1:3] / sums[0]
    return float(sums[0] * light.cosine), sqrt(max(sums[3] / sums[0] - x * x - y * y, 0.0)), bundle


def confirm(made: Setup, path: LightPath, found: Found) -> oracle.Estimate | None:
    """Integrate what the search found with the oracle; None for aspheric terms, which the oracle does not have."""
    if any(row.kind != "stop" and row.terms for row in made.lens.rows):
        return None
    system = oracle.from_lens(made.lens)
    films = [[oracle.films_of(c, *n) for c, n in zip(made.coatings, _media(system), strict=True)]]
    x, y, dx, dy = found.cells.T
    if made.packed.halves == 2:
        x, y, dx, dy = np.append(x, -x - dx), np.append(y, y), np.append(dx, dx), np.append(dy, dy)
    field = (0.0, -np.degrees(made.light.tilt))
    region = oracle.refine(system, path.mirrors, field, oracle.Region(x, y, dx, dy), D_LINE_NM, films)
    answer = oracle.estimate(system, path.mirrors, field, film_sets=films, samples=40_000, replicas=6, region=region)
    return None if answer is None else answer[0]


def _media(system: oracle.System) -> Iterator[tuple[float, float]]:
    front = 1.0
    for row in system.rows:
        yield front, row.index
        front = row.index


def differences(lens: Lens, field_deg: tuple[float, float], coating: str, name: str = "") -> list[Difference]:
    """Compare every ghost above FLOOR of the strongest; those that differ are confirmed by the oracle."""
    made = setup(lens, field_deg, COATINGS[coating])
    ours = {path: measured(made, path) for path in ghost_paths(lens)}
    best = max((flux for flux, _, _ in ours.values()), default=0.0)
    out = []
    for path, (flux, rms, bundle) in ours.items():
        for effort in (FIRST, SECOND):
            found = dense_search(made, path, effort, FLOOR * best)
            if found is None or found.flux < FLOOR * best:
                break
            light = found.rays[:, 2]
            inside = 0.0 if bundle is None else float(light @ covered(bundle, found.rays[:, :2]) / light.sum())
            row = Difference(name, field_deg, coating, path.mirrors, flux, found.flux, rms, found.rms, 1.0 - inside)
            # the second search has errors of a few tenths of a per cent
            if not row.is_bad(0.8):
                break
        else:
            truth = confirm(made, path, found)
            if truth is not None:
                sizes = 4.0 * truth.rms_radius_se / truth.rms_radius_mm if truth.size_exists else float("inf")
                row = replace(
                    row, true_flux=truth.throughput_mm2, true_rms=truth.rms_radius_mm,
                    doubt=(4.0 * truth.relative_se, sizes),
                )  # fmt: skip
            if row.is_bad():
                out.append(row)
    return out


def lights(lens: Lens) -> list[tuple[float, float]]:
    """Return the field angles of lights whose images lie at HEIGHTS in the picture, the last near its corner."""
    angles = np.arange(1.0, 89.0, 0.5)
    heights = image_heights(lens, first_order(lens), angles)
    seen = np.flatnonzero(~(np.isfinite(heights) & (np.append(0.0, heights[:-1]) < heights)))
    last = int(seen[0]) if len(seen) else len(angles)
    x, y = np.append(0.0, heights[:last]), np.append(0.0, angles[:last])
    return [(0.0, float(np.interp(part * HALF_DIAGONAL, x, y))) for part in HEIGHTS]


def main() -> int:
    """Search the given lenses; the exit code is 1 when a path differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lens", nargs="+", help="lens files, or names of shipped lenses")
    parser.add_argument("--light", help="field angles X,Y instead of five image heights")
    parser.add_argument("--coating", choices=sorted(COATINGS), help="default: both, in turns")
    asked = parser.parse_args()
    bad = 0
    for text in asked.lens:
        name = Path(text).stem
        try:
            lens = load_lens(text)
        except FlarewrightError as error:
            print(f"{name}  not read: {error}", flush=True)
            continue
        fields = [tuple(map(float, asked.light.split(",")))] if asked.light else lights(lens)
        for k, field in enumerate(fields):
            coating = asked.coating or list(COATINGS)[k % 2]
            for row in differences(lens, (field[0], field[1]), coating, name[:24]):
                print(row, flush=True)
                bad += 1
        print(f"{name}  {len(fields)} lights searched, {len(ghost_paths(lens))} ghosts", flush=True)
    print(f"{bad} ghosts differ", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
