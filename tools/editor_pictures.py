"""Take the screenshots of docs/editor.md: `python tools/editor_pictures.py [FOLDER [MODEL]]`.

With a ghost model, take only the screenshot of a measured flare, because no model ships. Needs the extra e2e and
Chromium.
"""

from __future__ import annotations

import sys
import tempfile
from io import BytesIO
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "editor"))

from chromium import Editor, Tab, browser

ROOT = Path(__file__).parents[1]


def shoot(tab: Tab, path: Path) -> None:
    """Save the page as a small JPEG."""
    tab.page.mouse.move(5, 715)
    tab.page.wait_for_timeout(350)
    image = Image.open(BytesIO(tab.page.screenshot())).convert("RGB")
    image.save(path, quality=72, subsampling=2, optimize=True)
    print(f"{path} {path.stat().st_size // 1024} KB")


def path(tab: Tab, folder: Path) -> None:
    """Animate a light, play it, and restore the state."""
    for at, place in (("0", None), ("1.5", (0.35, 0.3)), ("3", (0.2, 0.8))):
        tab.page.fill("input[name=path_time]", at)
        tab.page.press("input[name=path_time]", "Enter")
        tab.rest()
        if place is not None:
            tab.drag(tab.light(), tab.at(*place))
            tab.rest()
        tab.page.click("#path-key")
        tab.rest()
    tab.page.click("#path-play")
    tab.until("flarewright.player.at > 0.8 && flarewright.view.shownGrade === 'moving'")
    shoot(tab, folder / "editor-path.jpg")
    tab.page.click("#path-play")
    tab.rest()
    while tab.state()["undo"]:
        tab.page.click("#undo")
        tab.page.wait_for_timeout(100)
    tab.rest()


def panels(tab: Tab, folder: Path) -> None:
    """Open every panel once and use it."""
    shoot(tab, folder / "editor-light.jpg")
    path(tab, folder)
    tab.page.mouse.click(*tab.at(0.62, 0.6))
    tab.until("flarewright.ghost && flarewright.view.outline")
    tab.tab("ghosts")
    tab.rest()
    shoot(tab, folder / "editor-ghosts.jpg")
    tab.tab("lens")
    box = tab.page.locator("input[data-row='3'][data-column='thickness']")
    box.fill("0.4")
    box.press("Enter")
    tab.rest()
    shoot(tab, folder / "editor-lens.jpg")
    tab.page.click("#undo")
    tab.tab("iris")
    tab.rest()
    shoot(tab, folder / "editor-iris.jpg")
    tab.tab("coating")
    tab.js("flarewright.choose('3-1')")
    tab.until("document.querySelector('.map img').naturalWidth > 0 && document.querySelector('.plot svg')")
    tab.rest()
    shoot(tab, folder / "editor-coating.jpg")
    tab.tab("target")
    tab.until("flarewright.view.places.length > 0")
    tab.js("flarewright.command('set_ghost_target', {ghost: '3-1', values: {move_mm: 2.0, height: 0.6}})")
    tab.rest()
    tab.page.click("[data-compare=wipe]")
    tab.until("flarewright.view.target")
    tab.page.fill("input[name=seconds]", "6")
    tab.page.press("input[name=seconds]", "Enter")
    tab.page.click("#solve")
    tab.until("flarewright.state.solve.running")
    tab.until("!flarewright.state.solve.running")
    tab.until("[...document.querySelectorAll('.candidates img')].every(i => i.naturalWidth > 0)")
    # the designed lenses are below the targets
    tab.page.evaluate("() => { document.getElementById('page').scrollTop = 300; }")
    shoot(tab, folder / "editor-target.jpg")
    tab.tab("library")
    # every thumbnail must be drawn once
    page = tab.page.locator("#page")
    for k in range(6):
        page.evaluate(f"(p) => p.scrollTop = {k * 400}")
        tab.page.wait_for_timeout(700)
    tab.until("[...document.querySelectorAll('.library img')].every(i => i.naturalWidth > 0)")
    page.evaluate("(p) => p.scrollTop = 0")
    shoot(tab, folder / "editor-library.jpg")
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("?")
    shoot(tab, folder / "editor-keys.jpg")


def measured(tab: Tab, folder: Path) -> None:
    """Select a ghost of a measured flare."""
    tab.page.mouse.click(*tab.at(0.36, 0.55))
    tab.until("flarewright.ghost && flarewright.view.outline")
    tab.tab("ghosts")
    tab.rest()
    shoot(tab, folder / "editor-measured.jpg")


def main() -> None:
    """Start a separate editor, take the screenshots, and remove everything else."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    model = sys.argv[2:3]
    with tempfile.TemporaryDirectory() as state, browser() as chrome:
        editor = Editor(state, *model, own_sample=True)
        try:
            visit = measured if model else panels
            visit(Tab(chrome.new_page(viewport={"width": 1280, "height": 720}), editor), folder)
        finally:
            editor.end()


if __name__ == "__main__":
    main()
