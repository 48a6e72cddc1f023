"""Models of planted ghosts, known, unknown or mistaken, and the residual of captures beside them."""

from dataclasses import replace
from functools import cache

import numpy as np
from planted_run import LARGEST, shape, views

from flarewright.kernels.ghost_model.pupil_mesh import SOFT
from flarewright.measure.core.parameters import Shape
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.residual.motion_fit import with_moves
from flarewright.measure.residual.sprite_fit import axis_sprite
from flarewright.model.measurement.ghost_model import GhostModel

# a strip that holds both ghosts of `TRUE`
SIZE = (240, 84)
CAPTURED = np.arange(1.0, LARGEST + 0.1, 1.0)
# captures in which one ghost of `TRUE` begins to leave the picture
FEW = CAPTURED[10:15]


def soft(speed: float, size: float, level: float) -> Shape:
    """Return a ghost with borders wider than a sprite's cells."""
    one = shape(speed, size, level)
    one.numbers[SOFT] = 2.5**2
    return one


# one ghost crosses the picture and leaves it, one stays inside
TRUE = (soft(-150.0, 30.0, 1.0), soft(60.0, 18.0, 0.6))


def mistaken(one: Shape) -> Shape:
    """Return a ghost that is slightly too small, too bright and displaced."""
    numbers = one.numbers.copy()
    numbers[:4] *= 1.02
    numbers[10:14] *= 0.93
    numbers[20:23] *= 1.05
    return replace(one, numbers=numbers)


def between(captured: np.ndarray) -> np.ndarray:
    """Return the constellations halfway between captures."""
    return 0.5 * (captured[:-1] + captured[1:])


def model_of(shapes: tuple[Shape, ...], captured: np.ndarray = CAPTURED) -> tuple[GhostModel, list]:
    """Return a model of some ghosts, and the residual of the captures."""
    seen = views(TRUE, angles=captured, noise=0.001, size=SIZE)
    return model_beside(shapes, seen), seen


def model_beside(shapes: tuple[Shape, ...], seen: list) -> GhostModel:
    """Return a model of some ghosts and the residual of captures beside them."""
    ghosts = to_model([DetectedGhost((one, one, one), 0, len(seen) - 1) for one in shapes], seen)
    axis = float(seen[0].frame[0]), float(seen[0].frame[1])
    model = GhostModel(
        size_px=SIZE, axis_px=axis, focal_px=1e4, largest_deg=LARGEST,
        constellation_deg=(seen[0].constellation_deg, seen[-1].constellation_deg), ghosts=ghosts,
    )  # fmt: skip
    left = [view.pixels - replay_model(model, view.constellation_deg)[0].pixels for view in seen]
    return model.replace(sprites=(axis_sprite(seen, left),))


# ghosts of the model, from none to all of `TRUE`
KNOWN = {"unknown": (), "known": TRUE, "mistaken": tuple(mistaken(one) for one in TRUE)}


@cache
def moving(known: str, captured: tuple[float, ...]) -> tuple[GhostModel, GhostModel, list]:
    """Return a model before and after it has moves, and the captures; cached for all tests."""
    model, seen = model_of(KNOWN[known], np.array(captured))
    return model, with_moves(model), seen


def truth_between(captured: np.ndarray) -> list:
    """Return noise-free views halfway between captures."""
    return views(TRUE, angles=between(captured), noise=0.0, size=SIZE)


def missed(model: GhostModel, truth: list) -> float:
    return sum(
        float(((replay_model(model, view.constellation_deg)[0].pixels - view.pixels) ** 2).sum()) for view in truth
    )
