"""Statistics of the parameters of whole ghosts of real prescriptions, from traced rays.

    python -m benchmarks.measure.terms LENS ... [--f-number 5.6]

`measure.fitting.ghost_fit.priors` gives the expected size of each parameter before a fit; this program measures it.
It traces rays of every two-reflection path at constellations from the axis to the corner. It solves (x, y) = s f + p g
for f and g by least squares, where p is the position of a ray in the iris (for a path with several passes, at the pass
where its rim is tightest), and fits the light that reaches the sensor for the intensity. A path counts where its rays
fill the iris at four constellations or more: for a path that rims cut to a small part, the parameters of the whole
pupil are undetermined.

It also prints the residual of each form of the map that a ghost can have: f and g polynomials of first or second order,
alone or divided by 1 + b v + c w; and the differences of blue and red from green, by size
(`measure.fitting.colour_prior`).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from synthetic_camera import Setup, poses

from benchmarks.measure.shoot import setup_of
from benchmarks.measure.truth import project_of, rays_of
from flarewright.measure.core.parameter_vector import field, ten_terms
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

Floats = NDArray[np.float64]

TERMS = ("1", "u", "v", "w", "uu", "uv", "vv", "uw", "vw", "ww")
# step between constellations (of a hundred), and rays across half the accepted pupil and along it
_EVERY, _RAYS = 12, (24, 24)
# largest difference of the mean of u from that of a filled iris, and of the mean of p from the centre
_FILLED, _CENTRED = 0.08, 0.12
_LEAST = 4
# ridge, part of the squares, that keeps undetermined parameters at 0
_RIDGE = 1e-6
_PERCENTILES = (50, 75, 90, 95)
# limits of size classes for the colour differences, pixels in a picture 720 pixels wide
_SIZES = (0.0, 6.0, 20.0, 60.0, 150.0, np.inf)
# forms of the map: number of terms of f and g each, and which of u, v, w are in the divisor
_FORMS = {
    "first order": (4, ()), "second order": (10, ()), "first order over v, w": (4, (2, 3)),
    "second order over v, w": (10, (2, 3)), "second order over u, v, w": (10, (1, 2, 3)),
}  # fmt: skip
# rounds of reweighting a ray's error by its divisor
_ROUNDS = 4


@dataclass(frozen=True)
class _Rays:
    """Rays of a whole ghost at all its constellations: p, shape (N, 2), s, places (N, 2), and light (N,)."""

    p: Floats
    s: Floats
    places: Floats
    light: Floats

    @property
    def ten(self) -> Floats:
        """The ten terms, shape (N, 10)."""
        return ten_terms((self.p**2).sum(axis=1), self.p[:, 1] * self.s, self.s**2).T

    def maps(self, ten: Floats) -> tuple[Floats, Floats]:
        """Return the columns of the terms of f and of g, across the light's direction and along it, (N, 2 K) each."""
        return (
            np.concatenate([np.zeros_like(ten), self.p[:, :1] * ten], axis=1),
            np.concatenate([self.s[:, None] * ten, self.p[:, 1:] * ten], axis=1),
        )


@dataclass(frozen=True)
class _Seen:
    """Rays of one path at one constellation: s, p at each pass of the iris, shape (N, passes, 2), places, and light."""

    s: float
    pupil: Floats
    places: Floats
    light: Floats


def whole_ghosts(setup: Setup, colour: float = 0.5) -> dict[str, _Rays]:
    """Trace the rays of a lens' whole ghosts; `colour` is 0 for the shortest wavelength and 1 for the longest."""
    seen: dict[str, list[_Seen]] = {}
    largest, per_mm = max(setup.angles_deg), setup.size_px[0] / setup.sensor_width_mm
    for pose in poses(setup)[_EVERY // 3 :: _EVERY]:
        settled = resolve_project(project_of(setup, pose, "passes"))
        shot = make_shots(settled, make_opening(settled, None))[0]
        for path in ghost_paths(settled.lens):
            rays = rays_of(shot, path, _RAYS, colour)
            if rays is not None and rays.passes.any():
                open_ = rays.passes
                seen.setdefault(path.name, []).append(
                    _Seen(field(pose.constellation_deg, largest), rays.stops[open_] / shot.opening.radius,
                          per_mm * np.stack([rays.x, rays.y], axis=1)[open_], rays.weight[open_])
                )  # fmt: skip
    found = {name: _gathered(each) for name, each in seen.items()}
    return {name: rays for name, rays in found.items() if rays is not None}


def _gathered(seen: list[_Seen]) -> _Rays | None:
    # the light is along y; rays are in the half with x > 0
    reach = [[np.quantile(np.hypot(*each.pupil[:, k].T), 0.98) for k in range(each.pupil.shape[1])] for each in seen]
    at = int(np.argmax(np.mean(reach, axis=0)))
    whole = [each for each in seen if _fills(each.pupil[:, at])]
    if len(whole) < _LEAST:
        return None
    return _Rays(
        np.concatenate([each.pupil[:, at] for each in whole]),
        np.concatenate([np.full(len(each.pupil), each.s) for each in whole]),
        np.concatenate([each.places for each in whole]), np.concatenate([each.light for each in whole]),
    )  # fmt: skip


def terms_of(rays: _Rays) -> Floats:
    """Return f, g (pixels) and intensity (parts of the mean light) of a ghost, shape (30,)."""
    map_ = _least_squares(np.concatenate(rays.maps(rays.ten)), rays.places.T.ravel())
    return np.concatenate([map_, _least_squares(rays.ten, rays.light / rays.light.mean())])


def mapped_by(rays: _Rays, terms: int, below: tuple[int, ...]) -> tuple[float, Floats]:
    """Return the root mean square residual of a form of the map, pixels, and the coefficients of its divisor.

    Forms as in `_FORMS`; least squares of numerator minus place times divisor, weighted by the last divisor.
    """
    divides = rays.ten[:, list(below)]
    basis = np.concatenate([
        np.concatenate([part, -rays.places[:, m : m + 1] * divides], axis=1)
        for m, part in enumerate(rays.maps(rays.ten[:, :terms]))
    ])  # fmt: skip
    weight, value = np.ones(len(basis)), np.ones(len(divides))
    for _ in range(_ROUNDS if below else 1):
        numbers = np.linalg.lstsq(basis * weight[:, None], rays.places.T.ravel() * weight, rcond=1e-12)[0]
        value = 1.0 + divides @ numbers[2 * terms :]
        weight = np.tile(1.0 / np.maximum(np.abs(value), 1e-3), 2)
    off = (basis @ numbers - rays.places.T.ravel()).reshape(2, -1) / value
    return float(np.sqrt((off**2).sum(axis=0).mean())), numbers[2 * terms :]


def _fills(p: Floats) -> bool:
    return abs(float((p**2).sum(axis=1).mean()) - 0.5) < _FILLED and abs(float(p[:, 1].mean())) < _CENTRED


def _least_squares(basis: Floats, values: Floats) -> Floats:
    ridge = _RIDGE * len(basis) * np.eye(basis.shape[1])
    return np.asarray(np.linalg.solve(basis.T @ basis + ridge, basis.T @ values))


def spread(numbers: Floats, width: int) -> dict[str, Floats]:
    """Return the sizes of parameters, shape (paths,) each, in the units of `measure.fitting.ghost_fit.priors`.

    Parameters
    ----------
    numbers : ndarray, shape (paths, 30)
    width : int
        Width of the picture, pixels.
    """
    size = np.maximum(np.abs(numbers[:, 10]), 0.04 * width)
    reported: dict[str, Floats] = {}
    for letter, at in (("f", 0), ("g", 10)):
        for k, term in enumerate(TERMS):
            of_width = term in ("1", "w")
            reported[f"{letter} {term}, of {'width' if of_width else 'size'}"] = np.abs(numbers[:, at + k]) / (
                width if of_width else size
            )
    for k, term in enumerate(TERMS[1:], 1):
        reported[f"intensity {term}"] = np.abs(numbers[:, 20 + k] / numbers[:, 20])
    return reported


def differences(setup: Setup) -> Floats:
    """Return green's size and the differences of f and g of blue and red from green's, pixels, shape (N, 21)."""
    blue, green, red = ({name: terms_of(rays) for name, rays in whole_ghosts(setup, at).items()} for at in (0, 0.5, 1))
    reported = [
        np.concatenate([green[name][10:11], other[name][:20] - green[name][:20]])
        for other in (blue, red) for name in sorted(green.keys() & other.keys())
    ]  # fmt: skip
    return np.abs(np.array(reported).reshape(-1, 21))


def main() -> None:
    """Print the percentiles of each parameter over the paths of all lenses."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measure.terms", description=__doc__)
    parser.add_argument("lens", nargs="+")
    parser.add_argument("--f-number", type=float, default=5.6)
    given = parser.parse_args()
    setups = [setup_of(lens, 360, 100, given.f_number).steady for lens in given.lens]
    ghosts = [rays for setup in setups for rays in whole_ghosts(setup).values()]
    numbers = np.array([terms_of(rays) for rays in ghosts])
    print(f"{len(numbers)} whole ghosts of {len(setups)} lenses at f/{given.f_number:g}; percentiles {_PERCENTILES}")
    for name, values in spread(numbers, 360).items():
        print(f"{name:24}", "  ".join(f"{value:7.3f}" for value in np.percentile(values, _PERCENTILES)))
    for name, (terms, below) in _FORMS.items():
        off, divides = zip(*(mapped_by(rays, terms, below) for rays in ghosts), strict=True)
        reported = {f"{name}, px": np.array(off)}
        reported |= {f"  by {TERMS[k]}": np.abs([each[n] for each in divides]) for n, k in enumerate(below)}
        for row, values in reported.items():
            print(f"{row:32}", "  ".join(f"{value:7.3f}" for value in np.percentile(values, _PERCENTILES)))

    apart = np.concatenate([differences(setup) for setup in setups])
    # scale to a picture 720 pixels wide
    apart *= 720.0 / setups[0].size_px[0]
    for least, most in pairwise(_SIZES):
        some = apart[(apart[:, 0] >= least) & (apart[:, 0] < most)]
        if len(some):
            print(f"colours of {len(some)} ghosts of {least:g} to {most:g} px")
        for k in range(20 if len(some) else 0):
            name = f"  {'fg'[k // 10]} {TERMS[k % 10]}, px"
            print(f"{name:24}", "  ".join(f"{value:7.3f}" for value in np.percentile(some[:, 1 + k], _PERCENTILES)))


if __name__ == "__main__":
    main()
