"""The pictures of the library: shipped thumbnails equal what the lenses and looks render."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from flarewright.io.images.thumbnails import SIZE_PX, thumbnail
from flarewright.io.lens.library import library_names
from flarewright.io.project.look_file import shipped_looks
from flarewright.render.gallery import card_picture, card_project, cards, light_place


def test_every_lens_and_every_look_has_a_card_and_a_picture_that_ships():
    found = cards()
    assert [card.name for card in found] == [*library_names(), *shipped_looks()]
    for card in found:
        assert card.title
        assert card.caption
        with Image.open(BytesIO(thumbnail(card.kind, card.name))) as image:
            pixels = np.asarray(image.convert("RGB")).astype(float)
        assert pixels.shape == (SIZE_PX[1], SIZE_PX[0], 3)
        # none is black or white
        assert 2.0 < pixels.mean() < 120.0


def test_a_lens_is_shown_with_the_light_of_the_readme():
    assert light_place("takumar-50-f1.4") == pytest.approx((-9.0, 5.0), abs=0.03)
    (card,) = (card for card in cards() if card.name == "takumar-50-f1.4")
    project = card_project(card, (64, 36))
    assert (project.f_number, project.camera.size_px) == (4.0, (64, 36))
    assert card.command.startswith("flarewright render takumar-50-f1.4 --light -9")


@pytest.mark.slow
@pytest.mark.parametrize("card", cards(), ids=lambda card: card.name)
def test_pictures_that_ship_are_what_is_rendered(card):
    with Image.open(BytesIO(thumbnail(card.kind, card.name))) as image:
        kept = np.asarray(image.convert("RGB")).astype(float)
    drawn = card_picture(card, SIZE_PX).astype(float)
    # JPEG's noise is below 2 of 255
    assert np.abs(drawn - kept).mean() < 2.0
