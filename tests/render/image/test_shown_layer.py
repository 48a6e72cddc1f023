"""A layer in a notebook: one view, at its position in the picture, with a separate exposure."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

import flarewright as fw
from flarewright.optics.colour.rgb import xyz_to_rgb_matrix
from flarewright.render.image.display import view
from flarewright.render.image.shown_layer import ShownLayer

PROJECT = fw.Project(lens="heliar-tronnier", lights=[fw.Light(field_deg=(1, 1))], camera=fw.Camera(size_px=(24, 16)))


def shown(pixels, window, **of_picture):
    layer = ShownLayer("ghost.7-3", np.asarray(pixels, np.float32), window, **{"size_px": (24, 16), **of_picture})
    return np.asarray(Image.open(BytesIO(layer._repr_png_())))


def test_a_layer_stands_at_its_place_in_the_picture():
    light = np.random.default_rng(1).uniform(0.2, 1.0, (5, 8, 3)).astype(np.float32)
    picture = shown(light, (3, 6, 8, 5))
    assert picture.shape == (16, 24, 3)
    assert picture[6:11, 3:11].min() > 60
    assert not np.delete(picture, np.s_[6:11], axis=0).any()
    assert not np.delete(picture, np.s_[3:11], axis=1).any()
    # a window that extends outside the picture is cut; without a picture size all of it is shown
    np.testing.assert_array_equal(shown(light[2:, 4:], (0, 0, 4, 3)), shown(light, (-4, -2, 8, 5)))
    assert shown(light, (3, 6, 8, 5), size_px=None).shape == (11, 11, 3)


def test_the_exposure_is_the_layers_own():
    light = np.random.default_rng(2).uniform(0.2, 1.0, (5, 8, 3))
    faint, bright = (shown(scale * light, (3, 6, 8, 5)).astype(int) for scale in (1e-9, 1.0))
    assert np.abs(faint - bright).max() <= 1
    assert bright.max() > 200
    stated = ShownLayer("beauty", light.astype(np.float32), (0, 0, 8, 5)).png(-1.0)
    np.testing.assert_array_equal(np.asarray(Image.open(BytesIO(stated))), view(light.astype(np.float32), -1.0))


def test_a_dark_layer_is_black():
    assert not shown(np.zeros((16, 24, 3)), (0, 0, 24, 16)).any()
    assert not shown(np.zeros((0, 0, 3)), (0, 0, 0, 0)).any()
    assert not shown(np.full((16, 24, 3), -0.3), (0, 0, 24, 16)).any()


@pytest.mark.parametrize("channel", range(3))
def test_negative_light_is_moved_towards_white(channel):
    """A colour outside the screen's triangle becomes as colourful as possible, with the order of its channels."""
    light = np.full((16, 24, 3), 0.5)
    light[..., channel] = -0.4
    light[..., channel - 1] = 1.0
    codes = shown(light, (0, 0, 24, 16))[8, 12]
    assert codes[channel] < codes[channel - 2] < codes[channel - 1]
    assert codes[channel] < 60


def test_the_colorspace_is_the_layers():
    light = np.random.default_rng(3).uniform(0.3, 0.5, (16, 24, 3))
    # the same colours in the wider primaries, as in their file
    wide = light @ (xyz_to_rgb_matrix("acescg") @ np.linalg.inv(xyz_to_rgb_matrix("rec709"))).T
    narrow = shown(light, (0, 0, 24, 16)).astype(int)
    assert np.abs(shown(wide, (0, 0, 24, 16), colorspace="acescg") - narrow).max() <= 2
    assert np.abs(shown(wide, (0, 0, 24, 16)) - narrow).max() > 4


def test_every_layer_of_a_render_shows_itself():
    output = fw.Output(colorspace="acescg", layers="ghosts", brightest=1)
    # a small round stop, whose starburst is drawn fast
    project = PROJECT.replace(
        f_number=16.0, iris=fw.Iris(blades=0), quality=fw.Quality(mode="draft", wavelengths=3), output=output
    )
    found = fw.render(project)
    assert [layer.name for layer in found.layers][:3] == ["beauty", "starburst", "ghosts"]
    for layer in found.layers:
        picture = np.asarray(Image.open(BytesIO(layer._repr_png_())))
        assert picture.shape == (16, 24, 3)
        # a uniform veil stays darker than details
        assert picture.max() > 40
        assert layer.colorspace == "acescg"
        assert isinstance(layer, fw.Layer)
