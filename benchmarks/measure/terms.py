"""What ghosts of real prescriptions are like: the ten-term numbers of whole ghosts, by tracing their rays.

    python -m benchmarks.measure.terms LENS ... [--f-number 5.6]

`measure.fit.priors` says how large each number may be before a fit has looked at anything. Here it is looked up. Rays
of every two-reflection path are traced at constellations from the axis to the corner; (x, y) = s f + p g is solved for
f and g by least squares, p being where a ray passes the iris (of a path that passes it several times, where its rim is
tightest), and the part of its light that reaches the sensor for the intensity. A path counts where its rays fill the
iris, at four constellations and more: of one that rims cut to a rest, the numbers of the whole pupil are not told.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from benchmarks.measure.shoot import setup_of
from benchmarks.measure.truth import project_of, rays_of
from numpy.typing import NDArray
from synthetic_camera import Setup, poses

from flarewright.measure.numbers import field, ten_terms
from flarewright.optics.paths import ghost_paths
from flarewright.render.prepare import settle
from flarewright.render.shot import make_opening, make_shots

Floats = NDArray[np.float64]

TERMS = ("1", "u", "v", "w", "uu", "uv", "vv", "uw", "vw", "ww")
# every so many of a hundred constellations, rays across half the accepted pupil and along it
_EVERY, _RAYS = 12, (24, 24)
# how far the mean of u may be from that of a filled iris, and that of p from its middle
_FILLED, _CENTRED = 0.08, 0.12
_LEAST = 4
# of the squares, what keeps numbers that the rays do not tell at 0
_RIDGE = 1e-6
_PERCENTILES = (50, 75, 90, 95)


@dataclass(frozen=True)
class _Seen:
    """Rays of one path at one constellation: s, p at each pass of the iris, shape (N, passes, 2), places, and light."""

    s: float
    pupil: Floats
    places: Floats
    light: Floats


def terms_of(setup: Setup) -> dict[str, Floats]:
    """Return f, g and intensity of a lens' whole ghosts, shape (30,) each: pixels, and parts of the mean light."""
    seen: dict[str, list[_Seen]] = {}
    largest, per_mm = max(setup.angles_deg), setup.size_px[0] / setup.sensor_width_mm
    for pose in poses(setup)[_EVERY // 3 :: _EVERY]:
        settled = settle(project_of(setup, pose, "passes"))
        shot = make_shots(settled, make_opening(settled, None))[0]
        for path in ghost_paths(settled.lens):
            rays = rays_of(shot, path, _RAYS)
            if rays is not None and rays.passes.any():
                open_ = rays.passes
                seen.setdefault(path.name, []).append(
                    _Seen(field(pose.constellation_deg, largest), rays.stops[open_] / shot.opening.radius,
                          per_mm * np.stack([rays.x, rays.y], axis=1)[open_], rays.weight[open_])
                )  # fmt: skip
    found = {name: _solved(each) for name, each in seen.items()}
    return {name: numbers for name, numbers in found.items() if numbers is not None}


def _solved(seen: list[_Seen]) -> Floats | None:
    # light is along y; rays are of the half with x > 0
    reach = [[np.quantile(np.hypot(*each.pupil[:, k].T), 0.98) for k in range(each.pupil.shape[1])] for each in seen]
    at = int(np.argmax(np.mean(reach, axis=0)))
    whole = [each for each in seen if _fills(each.pupil[:, at])]
    if len(whole) < _LEAST:
        return None
    p = np.concatenate([each.pupil[:, at] for each in whole])
    s = np.concatenate([np.full(len(each.pupil), each.s) for each in whole])
    u, v, w = (p**2).sum(axis=1), p[:, 1] * s, s * s
    ten = ten_terms(u, v, w).T
    along = np.concatenate([s[:, None] * ten, p[:, 1:] * ten], axis=1)
    across = np.concatenate([np.zeros_like(ten), p[:, :1] * ten], axis=1)
    places = np.concatenate([each.places for each in whole])
    light = np.concatenate([each.light for each in whole])
    map_ = _least_squares(np.concatenate([along, across]), np.concatenate([places[:, 1], places[:, 0]]))
    return np.concatenate([map_, _least_squares(ten, light / light.mean())])


def _fills(p: Floats) -> bool:
    return abs(float((p**2).sum(axis=1).mean()) - 0.5) < _FILLED and abs(float(p[:, 1].mean())) < _CENTRED


def _least_squares(basis: Floats, values: Floats) -> Floats:
    ridge = _RIDGE * len(basis) * np.eye(basis.shape[1])
    return np.asarray(np.linalg.solve(basis.T @ basis + ridge, basis.T @ values))


def spread(numbers: Floats, width: int) -> dict[str, Floats]:
    """Return how large numbers are, shape (paths,) each, in the units of `measure.fit.priors`.

    Parameters
    ----------
    numbers : ndarray, shape (paths, 30)
    width : int
        Of the picture, pixels.
    """
    size = np.maximum(np.abs(numbers[:, 10]), 0.04 * width)
    told: dict[str, Floats] = {}
    for letter, at in (("f", 0), ("g", 10)):
        for k, term in enumerate(TERMS):
            of_width = term in ("1", "w")
            told[f"{letter} {term}, of {'width' if of_width else 'size'}"] = np.abs(numbers[:, at + k]) / (
                width if of_width else size
            )
    for k, term in enumerate(TERMS[1:], 1):
        told[f"intensity {term}"] = np.abs(numbers[:, 20 + k] / numbers[:, 20])
    return told


def main() -> None:
    """Print the percentiles of each number over the paths of all lenses."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measure.terms", description=__doc__)
    parser.add_argument("lens", nargs="+")
    parser.add_argument("--f-number", type=float, default=5.6)
    given = parser.parse_args()
    setups = [setup_of(lens, 360, 100, given.f_number).steady for lens in given.lens]
    numbers = np.array([each for setup in setups for each in terms_of(setup).values()])
    print(f"{len(numbers)} whole ghosts of {len(setups)} lenses at f/{given.f_number:g}; percentiles {_PERCENTILES}")
    for name, values in spread(numbers, 360).items():
        print(f"{name:24}", "  ".join(f"{value:7.3f}" for value in np.percentile(values, _PERCENTILES)))


if __name__ == "__main__":
    main()
