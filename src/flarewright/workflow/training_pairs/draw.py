"""Draw the values of an item from the distributions of a specification; each item has its own random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import floor, isfinite, log2, pi

import numpy as np

from ...errors import FlarewrightError, ProjectError
from ...io.lens.coating_text import parse_coating_choice
from ...model import BlackBody, Camera, Dirt, Iris, Lens, Light, Output, Project, Quality, Scatter
from ...model.lens.prescription import LARGEST_F_NUMBER
from ...model.project.dataset import DatasetSpec, InField, LensDraws
from ...model.project.distribution import (
    AnyDistribution,
    Choice,
    Constant,
    Integers,
    LogUniform,
    Normal,
    TextChoice,
    Uniform,
)
from ...optics.lens.paraxial import focal_lengths, vertex_positions
from ...render.scene.resolve import ResolvedProject, open_lens, resolve_project

# draft colours need three wavelengths, final ones seven
_WAVELENGTHS = {"draft": 3, "final": 7}

# Each group of values has a separate stream: a change to one distribution leaves the values of the other groups.
LENS, IRIS, DIRT, SCATTER, LIGHTS, BACKGROUND, EXPOSURE, SENSOR, NOISE = range(9)

# of final pictures: the detail that a screen shows, as in a preview
_FINAL = {"screen": True, "tolerance_px": 1.0}


def stream(spec: DatasetSpec, index: int, group: int) -> np.random.Generator:
    """Return the random numbers of one group of an item's values.

    Parameters
    ----------
    spec : DatasetSpec
    index : int
        Number of the item.
    group : int
        One of the constants of this module.

    Returns
    -------
    numpy.random.Generator
        A function of seed, index and group alone.
    """
    return np.random.default_rng(np.random.SeedSequence(spec.seed, spawn_key=(index, group)))


def draw_number(given: AnyDistribution, rng: np.random.Generator) -> float:
    """Draw a number from a distribution.

    Parameters
    ----------
    given : Distribution
    rng : numpy.random.Generator

    Examples
    --------
    >>> import numpy as np
    >>> draw_number(Uniform(uniform=(2.0, 3.0)), np.random.default_rng(1)) < 3.0
    True
    """
    match given:
        case Constant():
            return given.constant
        case Choice():
            return given.choice[_pick(len(given.choice), given.weights, rng)]
        case Uniform():
            return float(rng.uniform(*given.uniform))
        case LogUniform():
            low, high = np.log(given.log_uniform)
            # rounding must not leave the range
            return float(np.clip(np.exp(rng.uniform(low, high)), *given.log_uniform))
        case Normal():
            while True:
                value = float(rng.normal(*given.normal))
                if given.bounds[0] <= value <= given.bounds[1]:
                    return value
        case Integers():
            return float(rng.integers(given.integers[0], given.integers[1] + 1))


def draw_text(given: TextChoice, rng: np.random.Generator) -> str:
    """Draw a text from a choice."""
    return given.choice[_pick(len(given.choice), given.weights, rng)]


def _pick(number: int, weights: tuple[float, ...] | None, rng: np.random.Generator) -> int:
    if weights is None:
        return int(rng.integers(number))
    edges = np.cumsum(weights)
    return int(np.searchsorted(edges, rng.uniform(0.0, edges[-1]), side="right").clip(0, number - 1))


def drawn_lens(spec: DatasetSpec, index: int) -> str:
    """Return the name of an item's lens, which decides its split."""
    return draw_text(spec.lens.names, stream(spec, index, LENS))


@dataclass(frozen=True)
class Drawn:
    """The values of an item that do not depend on its background.

    Attributes
    ----------
    project : Project
        With lights of irradiance 1 times 2^stops; `brightened` scales them to the background.
    coating : str
        As in the specification.
    exposure_stops : float
    opened : bool
        Whether the drawn f-number was below that of the lens, so that it is wide open.
    """

    project: Project
    coating: str
    exposure_stops: float
    opened: bool


def draw_item(spec: DatasetSpec, index: int) -> Drawn:
    """Draw an item's values.

    Raises
    ------
    FlarewrightError
        The lens cannot be used with the drawn values.
    """
    rng = stream(spec, index, LENS)
    name = draw_text(spec.lens.names, rng)
    coating = draw_text(spec.lens.coating, rng)
    width_mm = draw_number(spec.lens.sensor_width_mm, rng)
    zoom = _zoom(open_lens(name).lens, draw_number(spec.lens.zoom, rng))
    focus = None if spec.lens.focus_distance is None else draw_number(spec.lens.focus_distance, rng)
    wide, high = spec.size_px
    project = Project(
        lens=name,
        coating=parse_coating_choice(coating),
        zoom=zoom,
        lights=(Light(field_deg=(0.0, 0.0)),),
        camera=Camera(size_px=spec.size_px, sensor_mm=(width_mm, width_mm * high / wide), focus_distance=focus),
        quality=_quality(spec),
        output=Output(layers=_layers(spec), brightest=spec.masks.ghosts if _layers(spec) == "ghosts" else None),
        iris=_iris(spec, index, name),
        dirt=_dirt(spec, index),
        scatter=_scatter(spec, index),
    )
    settled = resolve_project(project)
    f_number, opened = _f_number(spec.lens, settled.lens.f_number, rng)
    lights = _lights(spec, index, _image_distances(settled), project.camera.sensor)
    exposure = draw_number(spec.exposure.stops, stream(spec, index, EXPOSURE))
    return Drawn(project.replace(f_number=f_number, lights=lights), coating, exposure, opened)


def brightened(project: Project, mean_luminance: float) -> Project:
    """Return a project with the intensities of its lights scaled to pi times a background's mean luminance."""
    scale = pi * mean_luminance
    lights = tuple(light.replace(intensity=light.intensity * scale) for light in project.lights)
    return project.replace(lights=lights)


def _quality(spec: DatasetSpec) -> Quality:
    return Quality(
        mode=spec.quality, wavelengths=_WAVELENGTHS[spec.quality], ringing="collins" if spec.rings else "off",
        **(_FINAL if spec.quality == "final" else {}),
    )  # fmt: skip


def _layers(spec: DatasetSpec) -> str:
    wanted = spec.layout != "flare7k" and "ghost_mask" in spec.drawn_parts
    return "ghosts" if wanted else "passes"


def _zoom(lens: Lens, part: float) -> float | None:
    """Return a focal length of a zoom, None for another lens."""
    lengths = zoom_range(lens)
    return None if lengths is None else float(lengths[0] * (lengths[1] / lengths[0]) ** part)


def zoom_range(lens: Lens) -> tuple[float, float] | None:
    """Return the shortest and longest focal length of a zoom, mm; None for another lens."""
    lengths = [position.focal_length for position in lens.positions if position.focal_length is not None]
    if len(set(lengths)) < 2:
        return None
    return min(lengths), max(lengths)


def _iris(spec: DatasetSpec, index: int, name: str) -> Iris:
    draws = spec.iris
    rng = stream(spec, index // draws.repeat, IRIS)
    blades = None if draws.blades is None else int(draw_number(draws.blades, rng))
    own = open_lens(name).lens.iris
    return own.replace(
        **({} if blades is None else {"blades": blades, "mask": None}),
        **({} if draws.rounding is None else {"rounding": draw_number(draws.rounding, rng)}),
        rotation_deg=draw_number(draws.rotation_deg, rng),
    )


def _dirt(spec: DatasetSpec, index: int) -> Dirt:
    rng, draws = stream(spec, index, DIRT), spec.dirt
    values = [draw_number(given, rng) for given in (draws.dust_per_mm2, draws.scratches_per_cm2, draws.fingerprint)]
    if not any(values):
        return Dirt()
    return Dirt(
        dust_per_mm2=values[0], scratches_per_cm2=values[1], fingerprint=values[2], in_ghosts=draws.in_ghosts,
        seed=int(rng.integers(2**31)),
    )  # fmt: skip


def _scatter(spec: DatasetSpec, index: int) -> Scatter | None:
    draws = spec.scatter
    if draws is None:
        return None
    rng = stream(spec, index, SCATTER)
    level = None if draws.cleanliness_level is None else draw_number(draws.cleanliness_level, rng)
    return Scatter(model="harvey-shack", roughness_nm=draw_number(draws.roughness_nm, rng), cleanliness_level=level)


def _f_number(draws: LensDraws, widest: float, rng: np.random.Generator) -> tuple[float, bool]:
    """Return the f-number, and whether the drawn one was too fast for the lens."""
    if draws.f_number is None:
        return float(widest * 2.0 ** (0.5 * draw_number(draws.stops_down, rng))), False
    drawn = draw_number(draws.f_number, rng)
    return max(drawn, widest), drawn < widest


def _image_distances(settled: ResolvedProject) -> tuple[float, float]:
    """Return the places of direct images over the tangents of the field angles near the axis, across and down, mm.

    Focused far away, these are the focal lengths. A sensor behind the focus meets the chief rays, which come from the
    middle of the exit pupil, farther out.
    """
    order = settled.order
    last = float(vertex_positions(settled.lens)[-1])
    from_pupil = last - order.exit_pupil_z
    grown = (from_pupil + order.sensor_distance) / (from_pupil + order.bfl) if isfinite(from_pupil) else 1.0
    across, down = focal_lengths(order.efl, order.efl_x)
    return across * grown, down * grown


def _lights(
    spec: DatasetSpec, index: int, distances: tuple[float, float], sensor_mm: tuple[float, float]
) -> tuple[Light, ...]:
    """Return the lights; without one, a dark light on the axis, since a project needs one."""
    rng, draws = stream(spec, index, LIGHTS), spec.lights
    found = []
    for number in range(int(draw_number(draws.count, rng))):
        if isinstance(draws.place, InField):
            field = (draw_number(draws.place.x_deg, rng), draw_number(draws.place.y_deg, rng))
        else:
            reach = 0.5 + draws.place.margin
            place_mm = rng.uniform(-reach, reach, 2) * sensor_mm
            # without the lens' distortion
            x, y = np.degrees(np.arctan(place_mm / np.array(distances)))
            field = (float(x), float(y))
        found.append(
            Light(
                name=f"light {number + 1}",
                field_deg=field,
                intensity=2.0 ** draw_number(draws.stops, rng),
                spectrum=BlackBody(temperature_k=_rounded(draw_number(draws.temperature_k, rng), draws.temperature_k)),
                diameter_deg=draw_number(draws.diameter_deg, rng),
            )
        )
    return tuple(found) or (Light(name="none", field_deg=(0.0, 0.0), intensity=0.0),)


def _rounded(temperature_k: float, given: AnyDistribution) -> float:
    """Return a temperature in steps of 100 K: the tables of each spectrum take as long as the rest of a draft."""
    if isinstance(given, Constant | Choice):
        return temperature_k
    return float(np.clip(round(temperature_k, -2), *given.support))


def check_lenses(spec: DatasetSpec) -> None:
    """Raise an error before the work for a lens that cannot be used with the specification.

    Raises
    ------
    FlarewrightError
        A lens cannot be read, has no such coating, cannot be focused, or cannot be stopped down so far; the sentence
        names it.
    """
    for name in spec.lens.names.choice:
        try:
            lens = open_lens(name).lens
        except FlarewrightError as error:
            # names the lens itself
            raise ProjectError(f"lens.names: {error}", error.problems) from None
        lengths = zoom_range(lens)
        coatings = spec.lens.coating.choice
        focus = (None,) if spec.lens.focus_distance is None else spec.lens.focus_distance.support
        try:
            for zoom in lengths or (None,):
                for distance in focus:
                    settled = resolve_project(
                        Project(
                            lens=name, zoom=zoom, lights=(Light(field_deg=(0.0, 0.0)),),
                            camera=Camera(focus_distance=distance),
                        )
                    )  # fmt: skip
                    _check_stops(spec.lens, settled.lens.f_number)
            for text in coatings:
                _check_coating(settled.lens, text)
        except FlarewrightError as error:
            raise ProjectError(f"lens.names: {name}: {error}", error.problems) from None


def _check_stops(draws: LensDraws, widest: float) -> None:
    """Raise an error for stops that lead beyond the largest f-number."""
    most = draws.stops_down.support[1]
    if draws.f_number is None and widest * 2.0 ** (0.5 * most) > LARGEST_F_NUMBER:
        raise ProjectError(
            f"lens.stops_down of {most:g} from f/{widest:.3g} leads beyond f/{LARGEST_F_NUMBER:g}: give at most "
            f"{floor(20.0 * log2(LARGEST_F_NUMBER / widest)) / 10.0:g}"
        )


def _check_coating(lens: Lens, text: str) -> None:
    from ...optics.rays.pack import resolve_coatings

    resolve_coatings(lens, parse_coating_choice(text))


@lru_cache(maxsize=16)
def splits_of(spec: DatasetSpec) -> dict[str, str]:
    """Return the split of each lens.

    Returns
    -------
    dict of str to str
        Lenses by name. With weights, the seed shuffles the lenses; each split with a weight has at least one.
    """
    names = spec.lens.names.choice
    named = {name: split for split, part in spec.splits if isinstance(part, tuple) for name in part}
    if any(isinstance(part, tuple) for _, part in spec.splits):
        return {name: named.get(name, "train") for name in names}
    parts = [(split, part) for split, part in spec.splits if isinstance(part, float) and part > 0.0]
    order = np.random.default_rng(np.random.SeedSequence(spec.seed)).permutation(len(names))
    counts = _shared_out(len(names), [part for _, part in parts])
    labels = [split for (split, _), count in zip(parts, counts, strict=True) for _ in range(count)]
    return {names[k]: label for k, label in zip(order, labels, strict=True)}


def _shared_out(number: int, weights: list[float]) -> list[int]:
    """Share a number in proportion to weights (largest remainders), at least one each."""
    exact = [number * weight / sum(weights) for weight in weights]
    counts = [int(part) for part in exact]
    for k in sorted(range(len(weights)), key=lambda k: counts[k] - exact[k])[: number - sum(counts)]:
        counts[k] += 1
    while 0 in counts:
        counts[counts.index(max(counts))] -= 1
        counts[counts.index(0)] += 1
    return counts
