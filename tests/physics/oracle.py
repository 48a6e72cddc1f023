"""The oracle: a plain Monte Carlo tracer for two-reflection ghosts in NumPy, double precision.

It tests `flarewright`, so it shares no code with `flarewright.kernels` or `flarewright.optics`; from
`flarewright.model` it reads data only. Where there is a choice, it uses another method than the fast code:

- spheres by their centre (physics.md, "Sequential tracing"), conics by the quadratic of their implicit form;
- films by the recursive Airy sum, not by characteristic matrices;
- regions by nested regular grids, integrals by jittered strata in replicas, so that every number has a standard error.

Conventions are those of physics.md: mm, light along +z, vertices on the axis, rows counted from 0 with the stop as a
row. Positions on the sensor are in the upright picture, (-x, -y) of the sensor's coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Films = tuple[tuple[float, float], ...]
"""Films on a surface from the front to the back: (index, thickness in nm)."""
Path = tuple[int, ...] | None
"""(first mirror j, second mirror i < j), or None for the direct image."""

FAR = 40.0
"""Rays farther out than this many semi-diameters are dropped while regions are searched."""


@dataclass(frozen=True)
class OracleRow:
    """A surface and the gap behind it; `index` is the refractive index of that gap at the wavelength."""

    curvature: float
    thickness: float
    index: float
    semi_diameter: float
    conic: float = 0.0
    films: Films = ()
    is_stop: bool = False


@dataclass(frozen=True)
class System:
    """Rows from front to back, and the distance of the sensor behind the last vertex."""

    rows: tuple[OracleRow, ...]
    sensor_distance: float

    @property
    def stop(self) -> int:
        return next(k for k, row in enumerate(self.rows) if row.is_stop)

    @property
    def vertices(self) -> list[float]:
        z = [0.0]
        for row in self.rows[:-1]:
            z.append(z[-1] + row.thickness)
        return z

    @property
    def sensor_z(self) -> float:
        return self.vertices[-1] + self.sensor_distance

    def with_films(self, films: Sequence[Films]) -> System:
        return replace(self, rows=tuple(replace(r, films=tuple(f)) for r, f in zip(self.rows, films, strict=True)))

    def scaled(self, factor: float) -> System:
        """Return the same lens `factor` times as large (films keep their thickness)."""
        rows = tuple(
            replace(
                r,
                curvature=r.curvature / factor,
                thickness=r.thickness * factor,
                semi_diameter=r.semi_diameter * factor,
            )
            for r in self.rows
        )
        return System(rows, self.sensor_distance * factor)


# --- paths -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Step:
    """One intersection of a ray with a surface."""

    row: int
    mirror: bool
    forward: bool
    """Whether the light travels along +z before the intersection."""
    n_from: float
    n_to: float
    """Index on the far side of the surface, also for mirrors."""
    films: Films
    """In the order in which light meets them."""


def mirrors(system: System) -> list[int]:
    """Return the rows that reflect: not the stop, and not surfaces with equal indices on both sides and no film."""
    return [k for k, row in enumerate(system.rows) if not row.is_stop]


def ghost_paths(system: System, same_side: bool = False) -> list[tuple[int, int]]:
    """Return all (j, i) with i < j, or those with both mirrors on one side of the stop."""
    m, s = mirrors(system), system.stop
    return [(j, i) for j in m for i in m if i < j and (not same_side or (i < s) == (j < s))]


def steps(system: System, path: Path) -> list[Step]:
    """Return the surfaces of a path in order."""
    rows = system.rows
    behind = [row.index for row in rows]
    front = [1.0, *behind[:-1]]

    def step(k: int, mirror: bool, forward: bool) -> Step:
        films = rows[k].films
        if forward:
            return Step(k, mirror, True, front[k], behind[k], films)
        return Step(k, mirror, False, behind[k], front[k], films[::-1])

    last = len(rows)
    if path is None:
        return [step(k, False, True) for k in range(last)]
    walked: list[Step] = []
    at, forward = 0, True
    for mirror in path:
        way = range(at, mirror) if forward else range(at, mirror, -1)
        walked += [*(step(k, False, forward) for k in way), step(mirror, True, forward)]
        forward = not forward
        at = mirror + (1 if forward else -1)
    return [*walked, *(step(k, False, True) for k in range(at, last))]


# --- films -----------------------------------------------------------------------------------------------------


def reflectance_sp(
    n_from: float, films: Films, n_to: float, cos_from: Array, wavelength_nm: float
) -> tuple[Array, Array]:
    """Return R for s and p by adding the films' reflections from the far side inward (Airy, recursively)."""
    n = [n_from, *(f[0] for f in films), n_to]
    d = [f[1] for f in films]
    cos_from = np.clip(np.asarray(cos_from, dtype=float), 0.0, 1.0)
    tangential = n_from**2 * (1.0 - cos_from**2)
    # Beyond the critical angle the cosine is +i |..|, so that waves decay on the far side.
    cosines = [np.sqrt((1.0 - tangential / m**2).astype(complex)) for m in n]
    cosines[0] = cos_from.astype(complex)
    # the phase of a double pass through a film is equal for both polarisations
    turns = [np.exp(4j * np.pi / wavelength_nm * m * e * c) for m, e, c in zip(n[1:], d, cosines[1:], strict=False)]
    out = []
    with np.errstate(divide="ignore", invalid="ignore"):
        for s in (True, False):
            echo: Any = None
            for k in range(len(n) - 2, -1, -1):
                a, b = (n[k] * cosines[k], n[k + 1] * cosines[k + 1])
                if not s:
                    a, b = (n[k + 1] * cosines[k], n[k] * cosines[k + 1])
                r = (a - b) / (a + b)
                if echo is not None:
                    behind = echo * turns[k]
                    r = (r + behind) / (1.0 + r * behind)
                echo = r
            out.append(echo.real**2 + echo.imag**2)
    return out[0], out[1]


def reflectance(n_from: float, films: Films, n_to: float, cos_from: Array, wavelength_nm: float) -> Array:
    """Return the unpolarised reflectance, the mean of s and p; 1 beyond the critical angle."""
    if not films:
        if n_from == n_to:
            return np.zeros_like(cos_from)
        # Real arithmetic for bare surfaces, for speed.
        c0 = np.clip(cos_from, 0.0, 1.0)
        s2 = (n_from / n_to) ** 2 * (1.0 - c0**2)
        c1 = np.sqrt(np.clip(1.0 - s2, 0.0, None))
        with np.errstate(divide="ignore", invalid="ignore"):
            rs = (n_from * c0 - n_to * c1) / (n_from * c0 + n_to * c1)
            rp = (n_to * c0 - n_from * c1) / (n_to * c0 + n_from * c1)
        return np.where(s2 >= 1.0, 1.0, 0.5 * (rs**2 + rp**2))
    rs, rp = reflectance_sp(n_from, films, n_to, cos_from, wavelength_nm)
    return 0.5 * (rs + rp)


# --- rays ------------------------------------------------------------------------------------------------------


@dataclass
class Rays:
    """Results of a bundle; dead rays hold NaN."""

    x: Array
    y: Array
    """Position on the sensor, upright picture."""
    weight: Array
    """Product of R and T, one row per set of films."""
    rel_radius: Array
    stop_x: Array
    stop_y: Array
    """Position at the last crossing of the stop, in lens coordinates."""
    alive: NDArray[np.bool_]
    direction: Array
    """Direction at the sensor, shape (3, n)."""


def _dot(a: Array, b: Array) -> Array:
    """Return the inner products of two rows of three-vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _hit_sphere(o: Array, d: Array, z: float, curvature: float) -> tuple[Array, Array]:
    """Return step and inner product as in physics.md: t = -D.d - sgn(R d_z) sqrt(...)."""
    R = 1.0 / curvature
    D = o - np.array([[0.0], [0.0], [z + R]])
    b = _dot(D, d)
    under = b * b - _dot(D, D) + R * R
    t = -b - np.sign(R * d[2]) * np.sqrt(under)
    normal = (D + t * d) / R
    return t, normal


def _hit_conic(o: Array, d: Array, z: float, c: float, k: float) -> tuple[Array, Array]:
    """Intersect c (x^2 + y^2 + (1 + k) z^2) - 2 z = 0 on the side of its vertex."""
    p = o - np.array([[0.0], [0.0], [z]])
    A = c * (d[0] ** 2 + d[1] ** 2 + (1.0 + k) * d[2] ** 2)
    B = c * (p[0] * d[0] + p[1] * d[1] + (1.0 + k) * p[2] * d[2]) - d[2]
    C = c * (p[0] ** 2 + p[1] ** 2 + (1.0 + k) * p[2] ** 2) - 2.0 * p[2]
    root = np.sign(d[2]) * np.sqrt(B * B - A * C)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(np.sign(root) == np.sign(-B), C / (root - B), (-B - root) / A)
    q = p + t * d
    gradient = np.stack([c * q[0], c * q[1], c * (1.0 + k) * q[2] - 1.0])
    return t, -gradient / np.sqrt(_dot(gradient, gradient))


def _hit(o: Array, d: Array, z: float, row: OracleRow) -> tuple[Array, Array]:
    if row.is_stop or row.curvature == 0.0:
        t = (z - o[2]) / d[2]
        return t, np.broadcast_to(np.array([[0.0], [0.0], [-1.0]]), o.shape)
    if row.conic == 0.0 and abs(row.curvature) > 1e-6:
        return _hit_sphere(o, d, z, row.curvature)
    return _hit_conic(o, d, z, row.curvature, row.conic)


def direction(field_deg: tuple[float, float]) -> Array:
    """Return the unit vector of light from field angles (X, Y)."""
    tx, ty = np.tan(np.radians(field_deg))
    v = np.array([-tx, -ty, 1.0])
    return v / np.sqrt(v @ v)


def trace(
    system: System,
    path: Path,
    x: Array,
    y: Array,
    field_deg: tuple[float, float],
    wavelength_nm: float = 587.56,
    *,
    film_sets: Sequence[Sequence[Films]] | None = None,
    weigh: bool = True,
    drop_beyond: float = np.inf,
    first: int = 0,
) -> Rays:
    """Trace rays that cross the plane z = 0 at (x, y).

    Parameters
    ----------
    x, y : ndarray, shape (n,)
    film_sets : list of films per row, optional
        Several coatings of the same glass at once; default: that of the system.
    weigh : bool
        Whether to compute R and T.
    drop_beyond : float
        Rays farther out than this many semi-diameters are dropped (as dead).
    first : int
        Skip rows before this one: the light starts inside the lens (tests of reversibility).
    """
    n = len(x)
    sets = [tuple(row.films for row in system.rows)] if film_sets is None else [tuple(s) for s in film_sets]
    z = system.vertices
    d0 = direction(field_deg)
    keep = np.arange(n)
    o = np.stack([np.asarray(x, float), np.asarray(y, float), np.zeros(n)])
    d = np.repeat(d0[:, None], n, axis=1)
    w = np.ones((len(sets), n))
    rel = np.zeros(n)
    sx = np.full(n, np.nan)
    sy = np.full(n, np.nan)

    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for step in steps(system, path)[first:]:
            row = system.rows[step.row]
            # Intersection.
            t, normal = _hit(o, d, z[step.row], row)
            o = o + t * d
            radius = np.hypot(o[0], o[1])
            rel = np.maximum(rel, radius / row.semi_diameter)
            if row.is_stop:
                sx, sy = o[0].copy(), o[1].copy()
            # New direction; the normal is oriented against the ray.
            against = np.where(_dot(normal, d) > 0.0, -1.0, 1.0)
            normal = normal * against
            c = -_dot(normal, d)
            ok = np.isfinite(t) & np.isfinite(c) & (rel <= drop_beyond)
            if step.mirror:
                d = d + 2.0 * c * normal
            else:
                eta = step.n_from / step.n_to
                k = 1.0 - eta * eta * (1.0 - c * c)
                ok &= k >= 0.0
                if eta != 1.0:
                    d = eta * d + (eta * c - np.sqrt(np.where(k >= 0.0, k, np.nan))) * normal
            ends_forward = step.forward != step.mirror
            ok &= d[2] > 0.0 if ends_forward else d[2] < 0.0
            # Losses.
            if weigh and not row.is_stop:
                # sets with the same coating on this surface share its R
                known: dict[Films, Array] = {}
                for s, films in enumerate(sets):
                    met = films[step.row] if step.forward else films[step.row][::-1]
                    if not step.mirror and not met and step.n_from == step.n_to:
                        continue
                    if met not in known:
                        known[met] = reflectance(step.n_from, met, step.n_to, c, wavelength_nm)
                    w[s] *= known[met] if step.mirror else 1.0 - known[met]
            if not ok.all():
                keep, rel, sx, sy = keep[ok], rel[ok], sx[ok], sy[ok]
                o, d, w = o[:, ok], d[:, ok], w[:, ok]
    t = (system.sensor_z - o[2]) / d[2]
    o = o + t * d

    def full(values: Array) -> Array:
        out = np.full((*values.shape[:-1], n), np.nan)
        out[..., keep] = values
        return out

    alive = np.zeros(n, bool)
    alive[keep] = True
    return Rays(full(-o[0]), full(-o[1]), full(w), full(rel), full(sx), full(sy), alive, full(d))


# --- regions ---------------------------------------------------------------------------------------------------


def entrance_box(system: System, field_deg: tuple[float, float]) -> tuple[float, float, float, float]:
    """Return (x0, x1, y0, y1) on z = 0 around all rays that can hit the first surface within its semi-diameter."""
    row = system.rows[0]
    h = row.semi_diameter
    sags = [0.0]
    if row.curvature != 0.0:
        R = 1.0 / row.curvature
        if h < abs(R) and row.conic == 0.0:
            sags.append(R - np.sign(R) * np.sqrt(R * R - h * h))
            if h > 0.8 * abs(R):  # beyond the equator too
                sags.append(2.0 * R)
        else:
            sags.append(2.0 * h * np.sign(R))
    tx, ty = np.tan(np.radians(field_deg))
    # A hit at (x, y, sag) crossed z = 0 at (x + sag tan X, y + sag tan Y).
    xs, ys = [s * tx for s in sags], [s * ty for s in sags]
    m = 1.02 * h
    return min(xs) - m, max(xs) + m, min(ys) - m, max(ys) + m


@dataclass(frozen=True)
class Region:
    """Rectangles that contain all accepted rays of a path."""

    x: Array
    y: Array
    """Lower corners."""
    dx: Array
    dy: Array

    def take(self, which: NDArray[Any]) -> Region:
        return Region(self.x[which], self.y[which], self.dx[which], self.dy[which])

    def split(self, m: int) -> Region:
        """Return the m x m parts of every rectangle, ordered by rectangle."""
        ix, iy = (a.ravel() for a in np.meshgrid(np.arange(m), np.arange(m), indexing="ij"))
        dx, dy = self.dx / m, self.dy / m
        x, y = self.x[:, None] + ix * dx[:, None], self.y[:, None] + iy * dy[:, None]
        return Region(x.ravel(), y.ravel(), np.repeat(dx, m * m), np.repeat(dy, m * m))

    def jitter(self, rng: np.random.Generator) -> tuple[Array, Array]:
        n = len(self.x)
        return self.x + self.dx * rng.random(n), self.y + self.dy * rng.random(n)

    @staticmethod
    def joined(parts: Sequence[Region]) -> Region:
        return Region(*(np.concatenate([getattr(p, a) for p in parts]) for a in ("x", "y", "dx", "dy")))


def _spread(a: NDArray[Any], op: Any) -> NDArray[Any]:
    """Apply `op` (maximum, minimum, or) over the 3 x 3 neighbourhood of each element."""
    for axis in (0, 1):
        b = a.copy()
        lo: list[slice] = [slice(None)] * 2
        hi: list[slice] = [slice(None)] * 2
        lo[axis], hi[axis] = slice(None, -1), slice(1, None)
        b[tuple(lo)] = op(b[tuple(lo)], a[tuple(hi)])
        b[tuple(hi)] = op(b[tuple(hi)], a[tuple(lo)])
        a = b
    return a


def find_region(
    system: System, path: Path, field_deg: tuple[float, float], grid: int = 96, levels: int = 6
) -> Region | None:
    """Find the accepted part of the entrance plane by nested grids; None if no ray comes close.

    A cell is kept if its least relative radius minus the largest change along a nearby edge is below 1. So a spot
    smaller than a cell is detected by the slopes around it.
    """
    x0, x1, y0, y1 = entrance_box(system, field_deg)
    for _ in range(levels):
        gx, gy = np.linspace(x0, x1, grid + 1), np.linspace(y0, y1, grid + 1)
        X, Y = np.meshgrid(gx, gy, indexing="ij")
        rays = trace(system, path, X.ravel(), Y.ravel(), field_deg, weigh=False, drop_beyond=FAR)
        f = np.where(rays.alive, rays.rel_radius, np.inf).reshape(X.shape)
        with np.errstate(invalid="ignore"):
            ex = np.abs(np.diff(f, axis=0))
            ey = np.abs(np.diff(f, axis=1))
        ex[~np.isfinite(ex)] = 0.0
        ey[~np.isfinite(ey)] = 0.0
        change = np.maximum(np.maximum(ex[:, :-1], ex[:, 1:]), np.maximum(ey[:-1], ey[1:]))
        least = np.minimum(np.minimum(f[:-1, :-1], f[1:, :-1]), np.minimum(f[:-1, 1:], f[1:, 1:]))
        # The minimum of a cone in a cell lies at most one diagonal of slopes below its corners.
        cells = _spread(least, np.minimum) - 1.5 * _spread(change, np.maximum) <= 1.0
        if not cells.any():
            return None
        cells_near = _spread(cells, np.logical_or)
        dx, dy = gx[1] - gx[0], gy[1] - gy[0]
        ii, jj = np.nonzero(cells_near)
        nx0, nx1 = gx[ii.min()], gx[ii.max() + 1]
        ny0, ny1 = gy[jj.min()], gy[jj.max() + 1]
        done = (nx1 - nx0) * (ny1 - ny0) > 0.5 * (x1 - x0) * (y1 - y0)
        region = Region(gx[ii], gy[jj], np.full(len(ii), dx), np.full(len(ii), dy))
        if done:
            return region
        x0, x1, y0, y1 = nx0, nx1, ny0, ny1
    return region


# --- integrals -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Estimate:
    """Flux, position and size of a path, each with its standard error."""

    path: Path
    throughput_mm2: float
    throughput_se: float
    centroid_mm: Array
    centroid_se: Array
    rms_radius_mm: float
    rms_radius_se: float
    accepted: int
    """Number of rays that count, over all replicas."""
    least_dz: float
    """Least z component of the direction at the sensor, of the rays that count and carry light."""

    @property
    def size_exists(self) -> bool:
        """Whether centroid and size are finite.

        When light leaves a curved last surface parallel to the sensor (d_z passes through 0 while T does not),
        positions vary as 1 / d_z with uniformly distributed d_z: the second moment on an unbounded plane is infinite
        and the first diverges logarithmically.
        """
        return self.least_dz > 1e-3

    @property
    def relative_se(self) -> float:
        return self.throughput_se / self.throughput_mm2


def refine(
    system: System,
    path: Path,
    field_deg: tuple[float, float],
    region: Region,
    wavelength_nm: float = 587.56,
    film_sets: Sequence[Sequence[Films]] | None = None,
    share: float = 2e-4,
    rounds: int = 14,
) -> Region:
    """Split rectangles until none causes more than `share` of the uncertainty of flux or of size.

    This is needed where a few steep rays land far away and dominate the size. The final samples are drawn
    independently, so the refinement causes no bias.
    """
    rng = np.random.default_rng([77, *(path or (999, 999))])
    done: list[Region] = []
    todo = region
    scale: tuple[Array, Array, Array, Array] | None = None
    for _ in range(rounds):
        quarters = todo.split(2)
        x, y = quarters.jitter(rng)
        rays = trace(system, path, x, y, field_deg, wavelength_nm, film_sets=film_sets, drop_beyond=1.0)
        w = np.where(rays.alive, rays.weight, 0.0) * quarters.dx * quarters.dy
        px, py = np.nan_to_num(rays.x), np.nan_to_num(rays.y)
        if scale is None:
            total = w.sum(axis=1, keepdims=True)
            if not np.all(total > 0.0):
                return region
            cx, cy = ((w * p).sum(axis=1, keepdims=True) / total for p in (px, py))
            second = (w * ((px - cx) ** 2 + (py - cy) ** 2)).sum(axis=1, keepdims=True)
            scale = total, cx, cy, second
        total, cx, cy, second = scale
        parts = []
        for v in (w / total, w * ((px - cx) ** 2 + (py - cy) ** 2) / second):
            parts.append(v.reshape(len(v), -1, 4).std(axis=2).max(axis=0) * 4.0)
        doubt = np.maximum(parts[0], parts[1])
        bad = doubt > share
        done.append(todo.take(~bad))
        if not bad.any():
            return Region.joined(done)
        todo = todo.take(bad).split(2)
    return Region.joined([*done, todo])


def estimate(
    system: System,
    path: Path,
    field_deg: tuple[float, float],
    wavelength_nm: float = 587.56,
    *,
    film_sets: Sequence[Sequence[Films]] | None = None,
    samples: int = 6000,
    replicas: int = 8,
    seed: int = 1,
    region: Region | None = None,
) -> list[Estimate] | None:
    """Integrate one path, once per set of films; None if no ray counts."""
    if region is None:
        region = find_region(system, path, field_deg)
        if region is None:
            return None
        region = refine(system, path, field_deg, region, wavelength_nm, film_sets)
    strata = region.split(max(1, round(np.sqrt(samples / len(region.x)))))
    cell = strata.dx * strata.dy
    rng = np.random.default_rng([seed, *(path or (999, 999))])
    cos_theta = float(direction(field_deg)[2])
    sets = 1 if film_sets is None else len(film_sets)
    flux = np.zeros((sets, replicas))
    centre = np.zeros((sets, replicas, 2))
    size = np.zeros((sets, replicas))
    accepted = 0
    least_dz = 1.0
    for k in range(replicas):
        x, y = strata.jitter(rng)
        rays = trace(system, path, x, y, field_deg, wavelength_nm, film_sets=film_sets, drop_beyond=1.0)
        a = rays.alive
        accepted += int(a.sum())
        if not a.any():
            centre[:, k] = size[:, k] = np.nan
            continue
        lit = a & (np.nan_to_num(rays.weight).max(axis=0) > 1e-9 * np.nanmax(rays.weight))
        least_dz = min(least_dz, float(rays.direction[2, lit].min()))
        for s in range(sets):
            w, px, py = rays.weight[s, a] * cell[a], rays.x[a], rays.y[a]
            total = w.sum()
            cx, cy = (w * px).sum() / total, (w * py).sum() / total
            flux[s, k] = total * cos_theta
            centre[s, k] = cx, cy
            size[s, k] = np.sqrt((w * ((px - cx) ** 2 + (py - cy) ** 2)).sum() / total)
    if not accepted:
        return None
    root = np.sqrt(replicas)

    def mean_se(v: Array) -> tuple[Any, Any]:
        return np.nanmean(v, axis=0), np.nanstd(v, axis=0, ddof=1) / root

    out = []
    for s in range(sets):
        f, f_se = mean_se(flux[s])
        c, c_se = mean_se(centre[s])
        r, r_se = mean_se(size[s])
        out.append(Estimate(path, float(f), float(f_se), c, c_se, float(r), float(r_se), accepted, least_dz))
    return out


def table(
    system: System,
    field_deg: tuple[float, float],
    wavelength_nm: float = 587.56,
    *,
    film_sets: Sequence[Sequence[Films]] | None = None,
    paths: Iterable[Path] | None = None,
    floor: float = 1e-4,
    samples: int = 6000,
    replicas: int = 8,
    seed: int = 1,
    grid: int = 96,
) -> list[dict[Path, Estimate]]:
    """Integrate the direct path and every ghost above `floor` of the strongest, as found by a rough first round.

    Regions are searched with `grid` cells per side; each cell costs one ray per replica. Returns one table per set of
    films.
    """
    wanted = [None, *ghost_paths(system)] if paths is None else list(paths)
    sets = 1 if film_sets is None else len(film_sets)
    regions = {p: r for p in wanted if (r := find_region(system, p, field_deg, grid)) is not None}

    def run(path: Path, region: Region, n: int, k: int) -> list[Estimate] | None:
        return estimate(
            system, path, field_deg, wavelength_nm,
            film_sets=film_sets, samples=n, replicas=k, seed=seed, region=region,
        )  # fmt: skip

    rough = {p: e for p, r in regions.items() if (e := run(p, r, 1500, 2)) is not None}
    best = [max((e[s].throughput_mm2 for p, e in rough.items() if p is not None), default=0.0) for s in range(sets)]
    out: list[dict[Path, Estimate]] = [{} for _ in range(sets)]
    for p, first in rough.items():
        over = [p is None or first[s].throughput_mm2 > 0.7 * floor * best[s] for s in range(sets)]
        if not any(over):
            continue
        region = refine(system, p, field_deg, regions[p], wavelength_nm, film_sets)
        fine = run(p, region, samples, replicas)
        if fine is None:
            continue
        for s in range(sets):
            if p is None or fine[s].throughput_mm2 > floor * best[s]:
                out[s][p] = fine[s]
    return out


# --- paraxial --------------------------------------------------------------------------------------------------


def _matrices(system: System, path: Path, to_stop: bool = False) -> Iterator[Array]:
    """Yield the ray transfer matrices of a path in the order of the light (physics.md)."""
    z = system.vertices
    at = 0.0
    for step in steps(system, path):
        row = system.rows[step.row]
        yield np.array([[1.0, abs(z[step.row] - at)], [0.0, 1.0]])
        at = z[step.row]
        if to_stop and row.is_stop:
            return
        c = row.curvature if step.forward else -row.curvature
        if step.mirror:
            yield np.array([[1.0, 0.0], [2.0 * c, 1.0]])
        else:
            yield np.array([[1.0, 0.0], [(step.n_from - step.n_to) / step.n_to * c, step.n_from / step.n_to]])
    yield np.array([[1.0, system.sensor_z - at], [0.0, 1.0]])


def flare_matrix(system: System, path: Path, to_stop: bool = False) -> Array:
    """Return [[A, B], [C, D]] from the first vertex to the sensor (or to the first crossing of the stop)."""
    m = np.eye(2)
    for part in _matrices(system, path, to_stop):
        m = part @ m
    return m


def efl_bfl(system: System) -> tuple[float, float]:
    """Return focal length and back focal length."""
    m = flare_matrix(replace(system, sensor_distance=0.0), None)
    return -1.0 / m[1, 0], -m[0, 0] / m[1, 0]


def focused(system: System) -> System:
    """Return the system with the sensor at the paraxial focus."""
    return replace(system, sensor_distance=efl_bfl(system)[1])


def stopped(system: System, f_number: float) -> System:
    """Return the system with the stop of an f-number: the entrance pupil has the diameter efl / N."""
    half = abs(flare_matrix(system, None, to_stop=True)[0, 0] * efl_bfl(system)[0] / (2.0 * f_number))
    rows = tuple(replace(r, semi_diameter=half) if r.is_stop else r for r in system.rows)
    return replace(system, rows=rows)


# --- from the program's data -----------------------------------------------------------------------------------


def films_of(coating: Any, n_front: float, n_behind: float) -> Films:
    """Return the films, front to back, of a `flarewright.model.Coating` (or None) between two media."""
    kind = "none" if coating is None else coating.kind
    if kind == "none":
        return ()
    if kind == "film":
        return ((coating.index, coating.thickness_nm),)
    if kind == "stack":
        films = tuple((f.index, f.thickness_nm) for f in coating.layers)
        return films if n_front <= n_behind else films[::-1]
    assert kind == "quarter-wave"
    ideal = float(np.sqrt(n_front * n_behind))
    n = {"real": max(ideal, 1.38), "ideal": ideal}.get(coating.index, coating.index)
    return ((float(n), coating.center_wavelength_nm / (4.0 * float(n)) + coating.thickness_offset_nm),)


def from_lens(lens: Any, f_number: float | None = None, sensor_distance: float | None = None) -> System:
    """Convert a frozen `flarewright.model.Lens` at the d line, with its coatings; all semi-diameters must be known."""
    rows = []
    front = 1.0
    for row in lens.rows:
        if row.kind == "stop":
            rows.append(OracleRow(0.0, row.thickness, front, 1.0, is_stop=True))
            continue
        behind = 1.0 if row.medium is None else row.medium.n_d
        films = films_of(row.coating, front, behind)
        rows.append(OracleRow(row.curvature, row.thickness, behind, row.semi_diameter, row.conic, films))
        front = behind
    system = System(tuple(rows), 0.0)
    system = stopped(system, f_number or lens.f_number)
    distance = sensor_distance or lens.sensor_distance
    return focused(system) if distance is None else replace(system, sensor_distance=distance)


def glass_air_films(system: System, coating: Any) -> list[Films]:
    """Coat all surfaces between glass and air; cemented ones stay bare."""
    out: list[Films] = []
    front = 1.0
    for row in system.rows:
        glass_air = not row.is_stop and (front == 1.0) != (row.index == 1.0)
        out.append(films_of(coating, front, row.index) if glass_air else ())
        front = row.index
    return out
