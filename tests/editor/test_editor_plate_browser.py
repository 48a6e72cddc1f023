"""A photograph on the page: its lights are found, dragged with the mouse, and undone; `pytest -m browser`."""

import io

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import chromium, download, drop

from flarewright.io.images.exr import read_exr

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]

SIZE = (640, 360)
LAMPS = ((120.0, 90.0), (402.0, 182.0), (540.0, 280.0))


def night():
    pixels = np.full((SIZE[1], SIZE[0], 3), 8, np.uint8)
    for x, y in LAMPS:
        pixels[int(y) - 2 : int(y) + 2, int(x) - 2 : int(x) + 2] = 255
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format="PNG")
    return buffer.getvalue()


def handles(tab):
    """Return the places of the handles in pixels of the plate."""
    frame = tab.js("flarewright.view.frame()")
    places = tab.js("flarewright.state.lights.map((_, k) => flarewright.view.lightPage(k))")
    return sorted(((x - frame["x"]) / frame["w"] * SIZE[0], (y - frame["y"]) / frame["h"] * SIZE[1]) for x, y in places)


def test_lights_of_a_dropped_photograph_are_found_dragged_and_undone(tab, tmp_path):
    drop(tab, "night.png", night())
    # outlines come by themselves
    tab.until("flarewright.plateLights()?.lights.length === 3")
    outlined = tab.js("flarewright.plateLights().lights.map((one) => [one.x, one.y])")
    np.testing.assert_allclose(sorted(outlined), LAMPS, atol=0.01)
    tab.page.fill("input[name=plate_threshold]", "30")
    tab.page.keyboard.press("Enter")
    # near white at most
    tab.until("document.querySelector('#plate-words').textContent.includes('near the plate')")
    assert tab.state()["undo"] == "Change the plate"
    before = tab.state()["lights"]
    tab.page.click("#find-lights")
    tab.until("flarewright.state.plate.lit && !flarewright.state.finding.running")
    tab.rest()
    assert tab.state()["undo"] == "Find lights"
    np.testing.assert_allclose(handles(tab), LAMPS, atol=1.0)
    # the shown picture is the plate, and the lamps are as bright as in it
    shown = tab.shown().astype(int)
    high, wide = shown.shape[:2]
    for x, y in LAMPS:
        assert shown[round(y / SIZE[1] * high), round(x / SIZE[0] * wide)].min() > 200
    assert np.median(shown) < 30

    # the exported comp holds the plate's linear values; near the lamps the flare is added to them
    [comp] = read_exr(download(tab, "Comp as EXR", tmp_path / "night.comp.exr")).layers
    assert comp.pixels.shape == (SIZE[1], SIZE[0], 3)
    dark = 8 / 255 / 12.92
    assert np.median(comp.pixels) == pytest.approx(dark, rel=0.02)
    assert comp.pixels.min() >= dark * 0.999
    assert comp.pixels.max() == pytest.approx(1.0, rel=0.1)

    # a brighter lamp has a visible flare
    def level():
        # away from the lamps
        return tab.shown()[: high // 6, wide // 2 :].astype(float).mean()

    dark = level()
    tab.page.fill("input[name=plate_gain]", "14")
    tab.page.keyboard.press("Enter")
    tab.until("flarewright.state.plate.search.gain > 16000")
    tab.rest()
    assert level() > dark + 2.0

    # drag one of them with the mouse
    chosen = 1
    x, y = tab.js(f"flarewright.view.lightPage({chosen})")
    box = tab.page.locator("#view").bounding_box()
    angles = [light["field_deg"] for light in tab.state()["lights"]]
    tab.drag((box["x"] + x, box["y"] + y), (box["x"] + x - 60, box["y"] + y - 30), steps=12)
    tab.rest()
    moved = [light["field_deg"] for light in tab.state()["lights"]]
    assert moved[chosen][0] < angles[chosen][0] - 0.5
    assert moved[chosen][1] > angles[chosen][1] + 0.2
    assert [moved[0], moved[2]] == [angles[0], angles[2]]
    # Delete removes it
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("Delete")
    tab.until("flarewright.state.lights.length === 2")
    for _ in range(3):
        tab.page.keyboard.press("Control+z")
    tab.until("flarewright.state.plate.search.gain === 1")
    np.testing.assert_allclose(handles(tab), LAMPS, atol=1.0)
    # the whole finding is one step
    tab.page.keyboard.press("Control+z")
    tab.until("!flarewright.state.plate.lit")
    assert tab.state()["lights"] == before
    # without the plate
    tab.page.click("#plate-none")
    tab.until("!flarewright.state.plate")
    tab.rest()
    assert tab.page.locator("#find-lights").is_hidden()
    assert not tab.page.locator("#plate-words").is_visible()


def test_undo_of_a_removed_plate_brings_the_exposure_back(tab):
    drop(tab, "night.png", night())
    tab.until("flarewright.plateLights()?.lights.length === 3")
    tab.page.click("#find-lights")
    tab.until("flarewright.state.plate.lit && !flarewright.state.finding.running")
    assert tab.state()["view"]["exposure_stops"] is None
    tab.page.click("#plate-none")
    tab.until("!flarewright.state.plate && flarewright.state.view.exposure_stops === 0 && !flarewright.under.way")
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("Control+z")
    tab.until("flarewright.state.plate?.lit && flarewright.state.view.exposure_stops === null")
    # it was that of a black picture without the plate
    tab.page.keyboard.press("Control+z")
    tab.page.keyboard.press("Control+z")
    tab.until("!flarewright.state.plate && !flarewright.under.way")
    tab.rest()
    assert tab.state()["view"]["exposure_stops"] is None
    assert tab.shown().max() > 100
