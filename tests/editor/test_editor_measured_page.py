"""A measured flare on the editor's page, in a real browser: `pytest -m browser`."""

import numpy as np
import pytest

from flarewright.io.measurement.ghost_model_file import write_ghost_model

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import chromium, drop
from test_editor_measured import flare

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]


@pytest.fixture
def opened(tab, tmp_path):
    """Drop a measured flare on a page with a lens."""
    write_ghost_model(tmp_path / "model.json", flare())
    drop(tab, "mine.json", (tmp_path / "model.json").read_bytes())
    tab.until("flarewright.state.lens.measured")
    tab.rest()
    return tab


def test_its_handle_lies_on_its_light_and_moves_it(opened):
    tab = opened
    start = tab.light()
    tab.drag(start, (start[0] - 330, start[1] + 60), steps=30, hold_ms=25)
    tab.rest()
    assert not tab.state()["picture"]["problem"]
    # the halo is brightest at its light, and warmer than the ghost borders, which the codec sharpens
    picture = tab.shown()[..., 0].astype(float)
    rows, columns = np.nonzero(picture >= picture.max() - 1.0)
    x, y, w, h = tab.frame()
    seen = x + (columns.mean() + 0.5) / picture.shape[1] * w, y + (rows.mean() + 0.5) / picture.shape[0] * h
    assert seen == pytest.approx(tab.light(), abs=4.0)
    assert tab.light() == pytest.approx((start[0] - 330, start[1] + 60), abs=2.0)
    # outside the captured range the picture is that of the limit, with a remark
    tab.page.fill("[name=light_x]", "60")
    tab.page.press("[name=light_x]", "Enter")
    tab.until("flarewright.state.picture.remarks.some(remark => remark.includes('it is drawn at the limit'))")
    assert not tab.state()["picture"]["problem"]
    # an answer from before this picture may arrive late: picture and remarks stay those of the newer one
    tab.js(
        "(() => { const late = structuredClone(flarewright.state);"
        "Object.assign(late.picture, {number: late.picture.number - 1, remarks: []}); flarewright.take(late); })()"
    )
    assert any("it is drawn at the limit" in remark for remark in tab.state()["picture"]["remarks"])
    tab.page.click("#undo")
    tab.rest()


def test_its_panels_say_why_they_are_empty_and_its_ghosts_are_muted(opened):
    tab = opened
    for name in ("lens", "iris", "coating", "target"):
        tab.tab(name)
        assert "has no prescription" in tab.page.inner_text("#page")
        assert tab.page.locator("#page input:visible").count() == 0
    tab.tab("light")
    shown = tab.page.locator("#page label:visible").all_inner_texts()
    assert "Intensity" in shown
    assert "f-number" in shown
    assert not {"Distance", "Disc", "Grey", "Sensor", "Wavelengths", "Zoom position"} & set(shown)
    assert tab.page.locator("#section polyline").count() == 0 or not tab.page.locator("#section svg").is_visible()
    before = tab.shown().astype(int)
    tab.tab("ghosts")
    tab.page.click("tbody tr:has-text('1') >> nth=0")
    tab.page.click("button:has-text('Mute')")
    tab.rest()
    darker = before - tab.shown().astype(int)
    assert darker.max() > 20
    assert darker.min() > -20
    # back to the lens: its controls are shown again
    tab.page.click("#undo")
    tab.page.click("#undo")
    tab.until("!flarewright.state.lens.measured")
    tab.rest()
    tab.tab("lens")
    assert tab.page.locator("#page input:visible").count() > 10
