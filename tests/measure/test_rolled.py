"""A replay with the light where it was not photographed: all that goes with it turns, and corners are not empty."""

import numpy as np
import pytest
from planted_run import LARGEST
from test_sprites import lights

from flarewright.kernels.measure_pupil import FIRST_G, FIRST_I
from flarewright.measure.beyond import gone_on, shown
from flarewright.measure.numbers import NUMBERS, channel_of, frame
from flarewright.measure.replay import light_px, replay
from flarewright.measure.rest_fit import with_rest
from flarewright.measure.sprite_fit import light_sprites
from flarewright.measure.views import View
from flarewright.model.ghost_model import AberrationGhost, GhostModel
from flarewright.model.sprite import Sprite, packed

SIZE = (240, 160)
AXIS = (120.0, 80.0)
ANGLES = np.linspace(2.0, LARGEST, 10)[2:9]
# radiance of the picture, and of a ghost over all of it that the model takes for six times as bright
TRUE, TAKEN = 0.02, 0.12


def flat(level, radius):
    """Return a ghost of even light about the axis."""
    numbers = np.zeros(NUMBERS)
    numbers[FIRST_G], numbers[FIRST_I] = radius, level * radius**2
    colour = channel_of(numbers, 0)
    return AberrationGhost(name="1", red=colour, green=colour, blue=colour, visible_deg=(2.0, LARGEST))


def scene(angle, roll, size=SIZE, axis=AXIS):
    """Return an even picture with two soft lights: one that goes with the light, one that stays on the axis' side."""
    model = GhostModel(
        size_px=size, axis_px=axis, focal_px=250.0, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST)
    )
    at = light_px(model, angle, roll)
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    turn = np.radians(roll)
    out = np.full((size[1], size[0]), TRUE)
    for px, py, wide in (
        (at[0] - 18.0 * np.cos(turn), at[1] + 18.0 * np.sin(turn), 9.0),
        (axis[0] - 50.0 * np.cos(turn), axis[1] + 50.0 * np.sin(turn), 12.0),
    ):
        out += 0.05 * np.exp(-0.5 * ((x - px) ** 2 + (y - py) ** 2) / wide**2)
    return np.repeat(out[..., None], 3, axis=2).astype(np.float32)


@pytest.fixture(scope="module")
def learned():
    ghost = flat(TAKEN, 200.0)
    model = GhostModel(
        size_px=SIZE,
        axis_px=AXIS,
        focal_px=250.0,
        largest_deg=LARGEST,
        constellation_deg=(2.0, LARGEST),
        ghosts=(ghost,),
    )
    seen = []
    for angle in ANGLES:
        pixels = scene(angle, 0.0)
        placed = frame(AXIS, 0.0, angle, 1.0)
        noise = np.full(pixels.shape, 1e-8, np.float32)
        seen.append(View(float(angle), 0.5, placed, light_px(model, angle), pixels, noise))
    return with_rest(model, seen, 1)


@pytest.mark.parametrize("roll", [0.0, 30.0, 90.0, 180.0, 260.0])
@pytest.mark.parametrize("angle", [ANGLES[2], ANGLES[5]])
def test_a_rolled_replay_is_the_picture_that_the_light_would_make_there(learned, roll, angle):
    # the ghost's light and what makes up for it are six times the picture: neither may be seen
    true, mine = scene(angle, roll), replay(learned, float(angle), roll_deg=roll)[0].pixels
    x, y = (np.arange(side) + 0.5 - middle for side, middle in zip(SIZE, AXIS, strict=True))
    inside = shown(AXIS, (*AXIS, *np.subtract(SIZE, AXIS)), roll, SIZE)
    assert np.abs(mine - true)[inside].max() < 0.2 * TRUE
    assert np.hypot(x, y[:, None])[~inside].min(initial=np.inf) > 79.0
    # and nobody sees where the photographs end
    assert np.abs(mine - true).max() < 0.3 * TRUE


def test_a_taller_picture_goes_on_above_and_below(learned):
    wide = replay(learned, float(ANGLES[2]))[0].pixels
    tall = replay(learned, float(ANGLES[2]), size_px=(240, 240))[0].pixels
    np.testing.assert_allclose(tall[40:200], wide, atol=1e-5)
    assert np.abs(tall[:40] - TRUE).max() < 0.3 * TRUE
    assert np.abs(tall[200:] - TRUE).max() < 0.3 * TRUE


def test_where_a_ghost_ends_beyond_the_photographs_no_darkness_is_left():
    # the rest makes up for a ghost that is too bright, which ends where no photograph tells
    unit, cells = packed(np.full((3, 54, 80, 3), TRUE - TAKEN, np.float32), 1e-4)
    rest = Sprite(
        follows="ghosts", grain_px=3.0, corner_px=(-120.0, -81.0), rolls_deg=(0.0, 0.0, 0.0),
        constellation_deg=(2.0, 12.0, LARGEST), rows=54, columns=80, unit=unit, cells=cells,
    )  # fmt: skip
    model = GhostModel(
        size_px=SIZE, axis_px=AXIS, focal_px=250.0, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST),
        ghosts=(flat(TAKEN, 122.0),), sprites=(rest,),
    )  # fmt: skip
    turned = replay(model, 12.0, roll_deg=90.0)[0].pixels
    assert turned.min() > 0.4 * TRUE
    upright = replay(model, 12.0)[0].pixels
    # what photographs show stays as it is, but no light is below 0
    assert upright.min() == 0.0
    assert np.isclose(upright[80, 60:180], TRUE, rtol=0.06).all()


def test_a_star_stands_still_and_all_else_turns():
    seen = lights(0.05)
    still, turning = (light_sprites(seen, [view.pixels for view in seen], starry) for starry in (True, False))
    assert all(one.rolls_deg for one in turning)
    assert [bool(one.rolls_deg) for one in still] == sorted((bool(one.rolls_deg) for one in still), reverse=True)
    assert still[0].rolls_deg
    assert not still[-1].rolls_deg


def test_light_goes_on_as_it_is_at_the_border_and_smoother_farther_out():
    known = shown((40.0, 30.0), (40.0, 20.0, 40.0, 20.0), 0.0, (80, 60))
    assert np.flatnonzero(known.all(axis=1)).tolist() == list(range(10, 50))
    even = np.full((60, 80, 3), 0.7)
    np.testing.assert_allclose(gone_on(np.where(known[..., None], even, 99.0), known, (40.0, 30.0)), 0.7)
    rng = np.random.default_rng(2)
    noisy = rng.uniform(0.0, 1.0, (60, 80, 3))
    out = gone_on(noisy, known, (40.0, 30.0))
    assert np.array_equal(out[known], noisy[known])
    assert out[9].std() > 2.0 * out[0].std()
    np.testing.assert_allclose(out[9, 20:60], noisy[10, 20:60], atol=0.5)
    assert 0.0 <= out.min() <= out.max() <= 1.0
    whole = np.ones((60, 80), bool)
    assert gone_on(noisy, whole, (40.0, 30.0)) is noisy
