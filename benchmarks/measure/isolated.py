"""Benchmark of single ghosts, without noise and without each other: accuracy of the primitive, and Walch's method.

Each path is rendered alone at all constellations. Where it is clean (no fold, one rim, not cut by the picture:
`truth.TrueGhost`) the search and the fit use the even constellations. The odd ones between them are compared with
linear interpolation between their neighbours. The same ghosts, one image each, are fitted with Walch's primitive by his
method and, from the same start, by least squares. The result of our fit over all angles in that image is listed
beside them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from synthetic_camera import Pose, Setup, ghost_layers, poses, project_of, scale_of

from benchmarks.measure.lateral_colour import spread_by_colour, with_lateral_start
from benchmarks.measure.shoot import setup_of
from benchmarks.measure.truth import cut_by_frame, footprint, forms_of
from flarewright.kernels.ghost_model.bezier import BORDER, INNER
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, FIRST_DISC, FIRST_I, LATERAL
from flarewright.measure.compression.order_selection import can_go
from flarewright.measure.core.parameter_vector import field, frame, with_bounded_controls
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.core.views import View
from flarewright.measure.detection.matching_pursuit import pursue
from flarewright.measure.fitting.alternating_fit import kinds_of
from flarewright.measure.fitting.ghost_fit import Fit, refine, render
from flarewright.measure.fitting.model_growth import grow
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.fitting.settings import Growth
from flarewright.measure.walch.gradient_descent import circle, descend_gradient, draw_single, window_with_margin
from flarewright.model.measurement.ghost_model import Blades
from flarewright.render.scene.resolve import resolve_project as prepared

Floats = NDArray[np.float64]

# number of ghosts per lens, brightest first
GHOSTS = 5
# assumed noise, part of a ghost's median level; a fit requires some
NOISE = 1e-2
# number of constellations per fit
VIEWS = 16
# least number of views that must show a ghost
_LEAST_VIEWS = 8
# step between the constellations that determine the brightest ghosts
_GLANCE = 8
_ROUNDS = 200
# largest number of parameters of a ghost
NUMBERS = 27
# with 3 wavelengths a ghost of a Nikkor 85 differs from one with 25 by 1 to 7 %, more than the error of a fit; with
# these by 0.04 to 0.8 %
WAVELENGTHS = 15


def brightest(setup: Setup) -> list[str]:
    """Return the paths with the most light where they are clean, of those that are clean at enough constellations."""
    scale = scale_of(setup)
    light: dict[str, list[float]] = {}
    for pose in poses(setup)[::_GLANCE]:
        forms = forms_of(setup, pose)
        for name, image in ghost_layers(setup, pose, scale):
            if _clean(image[..., 1], forms.get(name), setup.size_px):
                light.setdefault(name, []).append(float(image[..., 1].sum()))
    often = {name: sum(seen) for name, seen in light.items() if len(seen) * _GLANCE >= 2 * _LEAST_VIEWS}
    return sorted(often, key=lambda name: -often[name])


def _clean(green: Floats, form: tuple[bool, bool] | None, size_px: tuple[int, int]) -> bool:
    """Return whether a picture shows a whole ghost; `form`: whether it folds, and whether several rims cut it."""
    seen = footprint(green)
    return seen is not None and form is not None and not any(form) and not cut_by_frame(seen[0], size_px)


def pictures_of(setup: Setup) -> tuple[list[Pose], dict[str, list[Floats | None]]]:
    """Return the poses, and for every path its green image at each pose, None where it is not clean."""
    scale = scale_of(replace(setup, paths=()))
    every = poses(setup)
    found: dict[str, list[Floats | None]] = {name: [None] * len(every) for name in setup.paths}
    for pose in every:
        forms = forms_of(setup, pose)
        for name, image in ghost_layers(setup, pose, scale):
            if _clean(image[..., 1], forms.get(name), setup.size_px):
                found[name][pose.number] = image[..., 1].astype(np.float32)
    return every, {name: _longest(pictures) for name, pictures in found.items()}


def _longest(pictures: list[Floats | None]) -> list[Floats | None]:
    """Keep only the longest run of consecutive images; beyond a gap the ghost is another part of the path."""
    runs, begin = [(0, 0)], 0
    for k, picture in enumerate([*pictures, None]):
        if picture is None:
            runs.append((begin, k))
            begin = k + 1
    first, end = max(runs, key=lambda run: run[1] - run[0])
    return [picture if first <= k < end else None for k, picture in enumerate(pictures)]


def view_of(setup: Setup, pose: Pose, green: Floats | None, noise: float) -> View:
    """Return one image as the fitter uses it."""
    width, height = setup.size_px
    shown = np.zeros((height, width)) if green is None else green
    placed = frame(setup.axis_px, setup.roll_deg, pose.constellation_deg, 1.0)
    pixels = np.repeat(shown[..., None], 3, axis=2).astype(np.float32)
    largest = max(abs(angle) for angle in setup.angles_deg)
    return View(
        pose.constellation_deg, abs(field(pose.constellation_deg, largest)), placed, (1e4, 0.0), pixels,
        np.full_like(pixels, noise**2),
    )  # fmt: skip


def isolated(lens: str, width: int, count: int, f_number: float, tell: Callable[[str], None]) -> list[dict[str, Any]]:
    """Return the results for each of a lens' brightest clean ghosts."""
    setup = replace(setup_of(lens, width, count, f_number).steady, wavelengths=WAVELENGTHS)
    # the brightness is sampled coarsely: some of these paths are clean too rarely
    setup = replace(setup, paths=tuple(brightest(setup)[: 2 * GHOSTS]))
    if not setup.paths:
        return []
    every, images = pictures_of(setup)
    rows: list[dict[str, Any]] = []
    for name in setup.paths:
        some = images[name]
        if len(rows) == GHOSTS or sum(each is not None for each in some[::2]) < _LEAST_VIEWS:
            continue
        levels = [seen[2] for each in some if each is not None and (seen := footprint(each)) is not None]
        noise = NOISE * float(np.median(levels))
        views = [view_of(setup, pose, some[pose.number], noise) for pose in every]
        row, shape = _alone(views, iris_of_setup(setup))
        rows.append({"lens": lens, "path": name, **row, **_against_walch(views, some, shape, row)})
        tell(str(rows[-1]))
    return rows


def iris_of_setup(setup: Setup) -> Blades | None:
    """Return the lens' iris, which a run detects from the star; None: round."""
    iris = prepared(project_of(setup, poses(setup)[0], "ghosts")).iris
    # the first edge is at the top
    return Blades(count=iris.blades, first_deg=90.0 + iris.rotation_deg) if iris.blades and not iris.rounding else None


def _alone(views: list[View], iris: Blades | None) -> tuple[dict[str, Any], Shape | None]:
    """Find and fit one ghost at the even views; return its results and its gain over interpolation at the odd ones."""
    clean = [bool(view.pixels.any()) for view in views]
    even = [view for view, whole in zip(views[::2], clean[::2], strict=True) if whole]
    start = time.process_time()
    found = pursue(even, [np.ones(view.pixels.shape[:2], bool) for view in even], most=1, iris=iris)
    if not found:
        return {"numbers": 0, "gain dB": None, "found": False}, None
    searched = time.process_time() - start
    rough = max(found, key=lambda one: one.shapes[1].numbers[FIRST_I])
    shown = even[:: max(1, len(even) // VIEWS)]
    fits = [fit for start in kinds_of(rough.shapes[1], iris) if (fit := _fitted(start, shown)) is not None]
    # compare over whole images: over its own windows a fit that covers less of a ghost would have less error
    best = min(fits, key=lambda fit: sum(_squares(fit.shape, view) for view in shown))
    took = time.process_time() - start
    mine = between = whole = 0.0
    for k in range(1, len(views) - 1, 2):
        if not all(clean[k - 1 : k + 2]):
            continue
        a, b = views[k - 1], views[k + 1]
        part = (views[k].constellation_deg - a.constellation_deg) / (b.constellation_deg - a.constellation_deg)
        line = (1.0 - part) * a.pixels[..., 1] + part * b.pixels[..., 1]
        true = views[k].pixels[..., 1]
        between += float(((line - true) ** 2).sum())
        mine += _squares(best.shape, views[k])
        whole += float((true**2).sum())
    return {
        "numbers": int(best.free.size), "gain dB": 10.0 * float(np.log10(between / max(mine, 1e-300))), "found": True,
        "error": float(np.sqrt(mine / whole)), "interpolation's": float(np.sqrt(between / whole)), "fit CPU s": took,
        "fit CPU s a picture": took / len(shown), "of it search": searched / took,
    }, best.shape  # fmt: skip


def _squares(shape: Shape, view: View) -> float:
    """Return the squared error of a shape in a whole image."""
    return float(((render(shape, view) - view.pixels[..., 1]) ** 2).sum())


def _fitted(start: Shape, views: list[View]) -> Fit | None:
    """Fit a ghost with at most `NUMBERS` parameters, until noise hides every step."""
    grown = grow(start, views, 1, most=Growth(order=2, discs=1))
    if grown is None:
        return None
    shape, width = with_lateral_start(spread_by_colour(grown, views, 1).shape), views[0].size_px[0]
    patches = patches_of(shape, views, 1)
    if not patches:
        return None
    # the centre of a rim moves linearly with the field
    free = np.union1d(free_numbers(2, shape.discs, 2, True, True), np.arange(LATERAL, BELOW))
    free = free[free != FIRST_DISC + 1]
    fit = refine(shape, patches, free, width=width, steps=20, error=0.0)
    while free.size > NUMBERS:
        # remove the least significant of the removable parameters
        may_go = free[can_go(free)]
        least = may_go[np.argmin(np.abs(fit.shape.numbers[may_go]) / np.maximum(fit.uncertainty[may_go], 1e-300))]
        free, numbers = free[free != least], fit.shape.numbers.copy()
        numbers[least] = 0.0
        fit = refine(replace(fit.shape, numbers=numbers), patches, free, width=width, steps=8, error=0.0)
    return refine(fit.shape, patches, free, width=width, steps=20, error=0.0)


def _against_walch(
    views: list[View], images: list[Floats | None], shape: Shape | None, row: dict[str, Any]
) -> dict[str, Any]:
    """Fit the middle image of a ghost's range with Walch's primitive by both methods; return times and errors."""
    shown = [k for k, each in enumerate(images) if each is not None]
    view = views[shown[len(shown) // 2]]
    green = view.pixels[..., 1].astype(float)
    seen = footprint(green)
    if seen is None:
        return {}
    (left, top, width, height), _, level = seen
    # start: centre of the outline along the light's line, and its mean size
    x, y = left + 0.5 * width - view.frame[0], top + 0.5 * height - view.frame[1]
    centre, radius = x * view.frame[2] - y * view.frame[3], 0.25 * (width + height)
    start = circle(centre + 0.1 * radius, 1.1 * radius, np.full(3, 0.8 * level), np.full(3, 0.8 * level))
    window = window_with_margin(start, view.frame, view.size_px, margin=8)
    x0, y0, w, h = window
    wanted = green[y0 : y0 + h, x0 : x0 + w]
    if wanted.size == 0:
        return {}
    draw_single(start, view.frame, window)
    begin = time.process_time()
    mine, drawn = _least_squares(start, wanted, view.frame, window)
    middle = time.process_time()
    his = descend_gradient(start, wanted, view.frame, window, rounds=_ROUNDS)
    end = time.process_time()
    errors = [
        float(np.sqrt(((draw_single(numbers, view.frame, window)[..., 1] - wanted) ** 2).mean())) / level
        for numbers in (mine, his.numbers)
    ]
    reported = {
        "walch, his primitive: times slower": (end - middle) / max(middle - begin, 1e-9),
        "error over his, his primitive": errors[0] / errors[1],
        "error, his": errors[1], "pictures": (drawn, his.evaluations),
    }  # fmt: skip
    if shape is not None:
        ours = render(shape, view)[y0 : y0 + h, x0 : x0 + w]
        error = float(np.sqrt(((ours - wanted) ** 2).mean())) / level
        slower = (end - middle) / row["fit CPU s a picture"]
        reported |= {
            "walch: times slower": slower,
            # his method is given a start, so compare without the search
            "walch: times slower than the fit alone": slower / (1.0 - row["of it search"]),
            "error over his": error / errors[1],
        }
    return reported


def _least_squares(
    start: Floats, wanted: Floats, frame: Floats, window: tuple[int, int, int, int]
) -> tuple[Floats, int]:
    """Fit a Bezier ghost to one green image by trust-region least squares; return its numbers and images drawn."""
    free = np.r_[0:13, BORDER + 1, INNER + 1]
    low = np.full(len(free), -np.inf)
    low[2:5], low[9:13] = 0.5, 0.05
    drawn = 0

    def numbers_of(values: Floats) -> Floats:
        numbers = start.copy()
        numbers[free] = values
        return with_bounded_controls(numbers)

    def missed(values: Floats) -> Floats:
        nonlocal drawn
        drawn += 1
        return (draw_single(numbers_of(values), frame, window)[..., 1] - wanted).ravel()

    fit = least_squares(missed, start[free], bounds=(low, np.inf), x_scale="jac", max_nfev=40)
    return numbers_of(fit.x), drawn


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the rows of the table over many ghosts."""
    good = [row for row in rows if row["gain dB"] is not None and row["gain dB"] >= 10.0 and row["numbers"] <= NUMBERS]

    def median(key: str) -> float | None:
        reported = [row[key] for row in rows if key in row]
        return float(np.median(reported)) if reported else None

    return {
        "isolated ghosts": len(rows), "of at most 27 numbers, 10 dB and more": len(good),
        "gain dB": [None if row["gain dB"] is None else round(row["gain dB"], 1) for row in rows],
        "walch, medians": {
            key: median(key)
            for key in (
                "walch: times slower", "walch: times slower than the fit alone", "error over his",
                "walch, his primitive: times slower", "error over his, his primitive",
            )
        },
    }  # fmt: skip
