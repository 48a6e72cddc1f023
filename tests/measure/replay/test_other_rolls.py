"""Replay with the light at a roll that was not photographed: the flare turns with it."""

import numpy as np
import pytest
from planted_run import LARGEST
from test_sprites import lights

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_G, FIRST_I
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of, frame
from flarewright.measure.core.views import View
from flarewright.measure.replay.model_image import light_px, replay_model
from flarewright.measure.residual.learn import with_residual
from flarewright.measure.residual.sprite_fit import light_sprites
from flarewright.model.measurement.ghost_model import AberrationGhost, GhostModel
from flarewright.model.measurement.sprite import Sprite, encode_pictures

SIZE = (192, 128)
AXIS = (96.0, 64.0)
ANGLES = np.linspace(2.0, LARGEST, 10)[3:8]
# radiance of the picture, and of a ghost over the whole picture that the model draws six times as bright
TRUE, TAKEN = 0.02, 0.12


def flat(level, radius):
    """Return a uniform ghost about the axis."""
    numbers = np.zeros(NUMBERS)
    numbers[FIRST_G], numbers[FIRST_I] = radius, level * radius**2
    colour = channel_of(numbers, 0)
    return AberrationGhost(name="1", red=colour, green=colour, blue=colour, visible_deg=(2.0, LARGEST))


def scene(angle, roll, size=SIZE, axis=AXIS):
    """Return a uniform picture with two soft spots: one near the light, one on the opposite side of the axis."""
    model = GhostModel(
        size_px=size, axis_px=axis, focal_px=250.0, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST)
    )
    at = light_px(model, angle, roll)
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    turn = np.radians(roll)
    out = np.full((size[1], size[0]), TRUE)
    for px, py, wide in (
        (at[0] - 18.0 * np.cos(turn), at[1] + 18.0 * np.sin(turn), 9.0),
        (axis[0] - 40.0 * np.cos(turn), axis[1] + 40.0 * np.sin(turn), 12.0),
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
    return with_residual(model, seen, 1)


@pytest.mark.parametrize(
    "roll", [0.0, pytest.param(30.0, marks=pytest.mark.slow), 90.0, pytest.param(180.0, marks=pytest.mark.slow), 260.0]
)
@pytest.mark.parametrize("angle", [ANGLES[1], ANGLES[3]])
def test_a_rolled_replay_turns_the_true_picture_and_keeps_half_of_the_residual(learned, roll, angle):
    # the ghost and the negative residual that corrects it are six times the picture: at the photographed roll neither
    # shows, and at others half of the ghost's excess does (docs/adr/0021)
    mine = replay_model(learned, float(angle), roll_deg=roll)[0].pixels
    bare = replay_model(learned.replace(sprites=()), float(angle), roll_deg=roll)[0].pixels
    true = scene(angle, roll)
    true = true + (0.0 if roll == 0.0 else 0.5) * (bare - true)
    x, y = (np.arange(side) + 0.5 - middle for side, middle in zip(SIZE, AXIS, strict=True))
    cosine, sine = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    along, down = np.abs(cosine * x - sine * y[:, None]), np.abs(sine * x + cosine * y[:, None])
    # two cells from the border, where the residual ends
    inside = (along < AXIS[0] - 6.0) & (down < AXIS[1] - 6.0)
    assert np.abs(mine - true)[inside].max() < 0.2 * TRUE


def test_a_taller_picture_shows_the_same_between_its_added_rows(learned):
    wide = replay_model(learned, float(ANGLES[2]))[0].pixels
    tall = replay_model(learned, float(ANGLES[2]), size_px=(192, 192))[0].pixels
    np.testing.assert_allclose(tall[32:160], wide, atol=1e-5)


def test_no_pixel_is_below_0_where_the_residual_exceeds_a_ghost():
    # the residual corrects a ghost that is too bright and ends inside the photographs
    unit, cells = encode_pictures(np.full((3, 44, 64, 3), TRUE - TAKEN, np.float32), 1e-4)
    rest = Sprite(
        follows="ghosts", grain_px=3.0, corner_px=(-96.0, -66.0), rolls_deg=(0.0, 0.0, 0.0),
        constellation_deg=(2.0, 12.0, LARGEST), rows=44, columns=64, unit=unit, cells=cells,
    )  # fmt: skip
    model = GhostModel(
        size_px=SIZE, axis_px=AXIS, focal_px=250.0, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST),
        ghosts=(flat(TAKEN, 98.0),), sprites=(rest,),
    )  # fmt: skip
    for roll in (0.0, 90.0):
        drawn = replay_model(model, 12.0, roll_deg=roll)[0].pixels
        assert drawn.min() == 0.0
        # half of the residual remains at a roll that was not photographed
        assert np.isclose(drawn[54:74, 48:144], TRUE if roll == 0.0 else 0.5 * (TRUE + TAKEN), rtol=0.06).all()


def test_a_star_keeps_its_orientation_and_all_else_turns():
    seen = lights(0.05, ANGLES[:4])
    still, turning = (light_sprites(seen, [view.pixels for view in seen], starry) for starry in (True, False))
    assert all(one.rolls_deg for one in turning)
    assert [bool(one.rolls_deg) for one in still] == sorted((bool(one.rolls_deg) for one in still), reverse=True)
    assert still[0].rolls_deg
    assert not still[-1].rolls_deg


def test_the_residual_of_each_of_two_rolls_is_that_of_its_own_captures():
    """Captures of two rolls were pictures of one sprite, so that a replay mixed both."""
    model = GhostModel(size_px=SIZE, axis_px=AXIS, focal_px=250.0, largest_deg=LARGEST, constellation_deg=(2.0, 24.0))
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    # one roll shows a spot right of the axis, the other one above it
    spots = {0.0: (140.0, 64.0), 90.0: (96.0, 30.0)}
    lit = {
        roll: np.repeat(0.1 * np.exp(-0.5 * ((x - px) ** 2 + (y - py) ** 2) / 6.0**2)[..., None], 3, axis=2)
        for roll, (px, py) in spots.items()
    }
    noise = np.full((SIZE[1], SIZE[0], 3), 1e-8, np.float32)
    # the same constellations at both rolls, as where the light is not seen
    seen = [
        View(float(angle), 0.5, frame(AXIS, roll, angle, 1.0), light_px(model, angle, roll),
             pixels.astype(np.float32), noise, roll)
        for angle in ANGLES[:4] for roll, pixels in lit.items()
    ]  # fmt: skip
    found = with_residual(model, seen, 1)
    for angle in (ANGLES[1], 0.5 * (ANGLES[1] + ANGLES[2])):
        for roll, pixels in lit.items():
            drawn = replay_model(found, float(angle), roll_deg=roll)[0].pixels
            # pictures of both rolls in turn: 0.004 to 0.007
            assert np.sqrt(((drawn - pixels) ** 2).mean()) < 0.0015
    # from the other side the light is at the same place
    both = found.replace(constellation_deg=(-24.0, 24.0))
    np.testing.assert_allclose(
        replay_model(both, -float(ANGLES[1]), roll_deg=270.0)[0].pixels,
        replay_model(both, float(ANGLES[1]), roll_deg=90.0)[0].pixels, atol=1e-6,
    )  # fmt: skip
