"""What the page shows follows every change that it depends on; `pytest -m browser`."""

import pytest

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import chromium

from flarewright.io.project.project_file import read_project
from flarewright.io.project.project_text import project_text
from flarewright.model import Art, LightCurve, Rule

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]


def change(tab, name, values):
    tab.page.evaluate("([name, values]) => flarewright.command(name, values)", [name, values])
    tab.until("!flarewright.under.way")


def test_the_plot_of_a_cemented_row_follows_the_glass_before_it(tab):
    tab.tab("coating")
    tab.page.click("[aria-label='Row 1']")
    words = "document.querySelector('.plot').textContent"
    tab.until(f"{words}.includes('behind LAKN7')")
    change(tab, "set_cell", {"row": 0, "column": "n_d", "text": "1.7"})
    tab.until(f"{words}.includes('behind n = 1.7')")


def test_curves_and_rules_of_a_file_are_played_and_shown(tab, tmp_path):
    path = tmp_path / "shot.toml"
    tab.save_as(path)
    project = read_project(path)
    curve = LightCurve(of="intensity", at_s=(0.0, 2.0), values=(1.0, 3.0))
    light = project.lights[0].replace(curves=(curve,))
    moving = project.replace(lights=(light,), art=Art(rules=(Rule(select="row:4", enable=False),)))
    path.write_text(project_text(moving, folder=tmp_path))
    tab.page.keyboard.press("o")
    tab.page.fill("dialog input[name=path]", str(path))
    tab.page.keyboard.press("Enter")
    tab.until("flarewright.state.moves")
    tab.rest()
    tab.page.fill("[name=path_time]", "1")
    tab.page.keyboard.press("Enter")
    tab.until("flarewright.state.lights[0].intensity === 2")
    assert tab.state()["undo"] == "Move along the path"
    tab.rest()
    tab.tab("ghosts")
    tab.until("document.querySelector('tr.muted')")
    muted = tab.js("[...document.querySelectorAll('tr.muted')].map((row) => row.dataset.ghost)")
    assert all("4" in name.split("-") for name in muted)
    # one of them is shown by its own rule
    tab.page.click(f"tr[data-ghost='{muted[0]}']")
    tab.page.click("#mute")
    tab.until(f"document.querySelector('tr.chosen:not(.muted)')?.dataset.ghost === '{muted[0]}'")
    tab.until("!flarewright.under.way")
    tab.rest()
    assert tab.said == []


def test_a_time_beyond_the_longest_path_is_stated(tab):
    tab.page.fill("[name=path_time]", "1e30")
    tab.page.keyboard.press("Enter")
    tab.until("document.getElementById('toasts').textContent.includes('became 86400 s')")
    assert tab.page.input_value("[name=path_time]") == "86400.00"
