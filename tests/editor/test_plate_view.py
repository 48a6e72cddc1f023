"""The comp of the viewport: the same as that of a shot, and a brighter flare without drawing it again."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from flarewright.editor.commands.shot import move_light
from flarewright.editor.preview import render_picture
from flarewright.editor.preview.drag import Drag
from flarewright.editor.preview.picture import DrawnPicture
from flarewright.editor.preview.plate_view import comp_of, plate_for, plate_under
from flarewright.editor.preview.progressive_render import sharpen
from flarewright.editor.preview.viewport import Screen, pixels_of_picture
from flarewright.editor.session.session import begin
from flarewright.editor.session.view_settings import View
from flarewright.io.images.picture import decode_srgb
from flarewright.model import Backplate, Layer, PlateSearch
from flarewright.plates.comp import composed, source_mask

SIZE = (48, 27)


@pytest.fixture
def plate(tmp_path):
    codes = np.full((27, 48, 3), 20, np.uint8)
    codes[10:14, 20:26] = 250
    Image.fromarray(codes).save(tmp_path / "p.png")
    return Backplate(image=str(tmp_path / "p.png"), lights_above=0.5), decode_srgb(codes / np.float32(255.0))


@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_the_comp_is_that_of_a_shot(project, plate, gain):
    lit, linear = plate
    lit = lit.replace(search=PlateSearch(gain=gain))
    rng = np.random.default_rng(1)
    ghosts, star, haze = (rng.uniform(0.0, 2.0, (27, 48, 3)).astype(np.float32) for _ in range(3))
    drawn = DrawnPicture(project.replace(plate=lit), "final", ghosts, star + haze, 0.0, haze=haze)
    found = comp_of(drawn, ghosts, plate_for(lit, SIZE))
    window = (0, 0, *SIZE)
    layers = [Layer("ghosts", ghosts, window), Layer("starburst", star, window), Layer("scatter", haze, window)]
    # display codes clip, so the brighter of plate and flare is shown inside the lamps
    wanted = composed(linear, layers, source_mask(linear, 0.5), too_dark=True).pixels
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_the_plate_of_an_older_picture_stays_until_the_new_one_is_drawn(project, plate):
    lit, _ = plate
    free = lit.replace(lights_above=None)
    empty = np.zeros((27, 48, 3), np.float32)

    def picture(of):
        return DrawnPicture(project.replace(plate=of), "final", empty, empty, 0.0)

    assert plate_under(picture(None), free) is free
    assert plate_under(picture(free), None) is None
    # lights in another unit would be a white or a black picture
    assert plate_under(picture(free), lit) is free
    assert plate_under(picture(lit), None) is lit


def test_flare_and_plate_have_one_exposure_once_the_lights_are_found(screen_size, plate):
    lit, _ = plate
    session, _ = begin(None)
    screen = Screen(session, lambda *_: None)
    session.put(session.project.replace(plate=lit), "Lit", placed=True)
    light = np.full((27, 48, 3), 0.1, np.float32)
    drawn = DrawnPicture(session.project, "final", light, np.zeros_like(light), 0.0)
    session.set_view({"look": "srgb", "exposure_stops": 9.0})
    shown = pixels_of_picture(screen, drawn)[0, 0]
    session.set_view({"plate_stops": 1.0})
    assert (pixels_of_picture(screen, drawn)[0, 0] > shown).all()
    session.set_view({"plate_shown": False, "plate_stops": 0.0})
    alone = pixels_of_picture(screen, drawn)
    assert alone.min() == alone.max() == 89
    screen.close()
    session.writer.close()


def test_a_drag_of_one_light_of_many_shows_all(shot, monkeypatch):
    session, _ = begin(None)
    first = shot.lights[0]
    places = ((-6.0, 2.0), (3.0, -4.0), (7.0, 3.0))
    lights = tuple(
        first.replace(name=f"plate-{k}", field_deg=place, diameter_deg=0.4) for k, place in enumerate(places)
    )
    many = shot.replace(lights=lights)
    session.put(many, "Many", placed=True)
    screen = Screen(session, lambda *_: None)
    drag = Drag(screen)
    drawn = []
    draw = drag._pixels
    monkeypatch.setattr(drag, "_adapt_size", lambda seconds: None)
    drag._pixels = lambda picture: drawn.append(picture) or draw(picture)
    # the others are drawn before the drag begins, and once
    drag.prepare()
    take, taken = render_picture.take, []
    monkeypatch.setattr(render_picture, "take", lambda *a, **k: taken.append(len(a[0].lights)) or take(*a, **k))
    drag._dragged = 1
    drag.prepare()
    assert taken.count(2) == 1
    for x in (2.0, 1.0):
        moved = drag.picture(lambda project, x=x: move_light(project, 1, x, -3.0), session.revision)
        wanted = take(moved.project, "moving", View())
        light, both = drawn[-1].ghosts, wanted.ghosts
        # which faint ghosts are drawn at half the resolution depends on the lights of a picture
        assert np.abs(light - both).mean() < 0.01 * both.mean()
        assert light.sum() == pytest.approx(both.sum(), rel=1e-3)
    assert taken.count(2) == 1
    # three area lights are points in quick pictures, and discs in the final one
    assert all(light.diameter_deg == 0.0 for light in render_picture.staged(many, "moving").lights)
    assert all(light.diameter_deg == 0.4 for light in render_picture.staged(many, "final").lights)
    assert render_picture.staged(many.replace(lights=lights[:2]), "draft").lights[0].diameter_deg == 0.4
    screen.close()
    session.writer.close()


def test_lights_that_all_become_brighter_are_not_drawn_again(shot, monkeypatch):
    session, _ = begin(None)
    session.put(shot, "Shot", placed=True)
    screen = Screen(session, lambda *_: None)
    two = shot.replace(lights=(shot.lights[0], shot.lights[0].replace(name="other", intensity=0.3)))
    sharpen(screen, two, View(), lambda: None)
    before, seen = screen.picture, screen.seen
    brighter = two.replace(lights=tuple(one.replace(intensity=3.0 * one.intensity) for one in two.lights))
    drawn = []
    take = render_picture.take
    monkeypatch.setattr(render_picture, "take", lambda *a, **k: drawn.append(a[1]) or take(*a, **k))
    sharpen(screen, brighter, View(), lambda: None)
    assert drawn == []
    wanted = take(brighter, "final", View(), room=screen.room)
    np.testing.assert_allclose(screen.picture.ghosts, wanted.ghosts, rtol=1e-4, atol=1e-6 * wanted.ghosts.max())
    assert screen.seen.ghosts[0].flux == pytest.approx(3.0 * seen.ghosts[0].flux)
    assert screen.picture.project == brighter
    # one of both lights alone is another picture
    assert render_picture.common_gain(before.project, two.replace(lights=(two.lights[0], brighter.lights[1]))) is None
    assert render_picture.common_gain(two, brighter.replace(f_number=11.0)) is None
    assert replace(before, project=two).project == two
    screen.close()
    session.writer.close()
