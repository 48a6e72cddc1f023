"""How fast the editor is in a real browser: `python benchmarks/editor.py [LENS...]`.

A hand drags the light in circles at 60 moves a second for some seconds. Shown pictures are counted when the browser has
painted them; latency runs from the pointer's move to the picture of that place. Needs the extra e2e and Chromium.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "editor"))

from chromium import Editor, Tab, browser

SECONDS = 4.0


def median(values, part=0.5):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else float("nan")


def measure(chrome, lens):
    with tempfile.TemporaryDirectory() as state:
        begun = time.perf_counter()
        editor = Editor(state, *([lens] if lens else []))
        page = chrome.new_page(viewport={"width": 1420, "height": 860})
        page.goto(editor.address)
        page.wait_for_function("window.flarewright?.view?.image")
        first = time.perf_counter() - begun
        tab = Tab(page, editor)
        x, y = tab.light()
        page.mouse.move(x, y)
        page.mouse.down()
        start = time.perf_counter()
        while (now := time.perf_counter() - start) < SECONDS:
            angle = 2.0 * math.pi * now / 2.5
            page.mouse.move(x - 60.0 + 60.0 * math.cos(angle), y + 50.0 * math.sin(angle))
            page.wait_for_timeout(8)
        stats = tab.js("JSON.parse(JSON.stringify(flarewright.view.stats))")
        width = tab.js("flarewright.view.image.width")
        page.mouse.up()
        tab.rest()
        final = tab.js("flarewright.view.stats.final")
        half = [t for t in stats["shown"] if t > stats["shown"][0] + 1000.0]
        rate = 1000.0 * (len(half) - 1) / (half[-1] - half[0])
        print(
            f"{lens or 'sample'}: {rate:.0f} frames/s of {width} px, latency {median(stats['latency']):.0f} ms "
            f"(9 of 10 below {median(stats['latency'], 0.9):.0f}), server {1000 * median(stats['server']):.0f} ms, "
            f"final {final:.0f} ms after letting go, start to first picture {first:.1f} s"
        )
        page.close()
        editor.end()


if __name__ == "__main__":
    with browser() as chrome:
        for name in sys.argv[1:] or ["", "canon-28-80"]:
            measure(chrome, name)
