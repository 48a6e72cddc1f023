"""How fast the editor is in a real browser: `python benchmarks/editor.py [LENS...]`.

A hand drags the light in circles at 60 moves a second for some seconds. Shown pictures are counted when the browser has
painted them; latency runs from the pointer's move to the picture of that place. Then it takes the light elsewhere some
times more: how long its pictures take once it has let go is told in the median of all times, and at worst. Processor
time is that of the server and of all processes of the browser, which tells more than the clock where other programs run
too (Linux). Of a lens that is traced for the screen before it is traced in full, two lines more tell how far
that picture is from the full one, and one made in haste: in codes of 255, as the page shows them. Needs the extra e2e
and Chromium.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "editor"))

import numpy as np
from chromium import Editor, Tab, browser

from flarewright.editor import studio
from flarewright.editor.files import project_for_lens
from flarewright.editor.session import begin
from flarewright.editor.shown import pixels_of
from flarewright.editor.view import View

SECONDS = 4.0
# what comes first is not counted: pictures find their size
SETTLE_S = 1.0
# how often the light is let go, and how long it is held before but for the first time
RELEASES, HELD_S = 8, 1.0


def median(values, part=0.5):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else float("nan")


def family(pid):
    """List a process and all that it started."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += family(int(child))
    return found


def processor_s(pids):
    """Add up the processor time of processes that still run; 0 where the system does not tell."""
    total = 0.0
    for pid in pids:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def screen_apart(lens, hasty):
    """Say how far the picture that is final for the screen is from the full one."""
    project = project_for_lens(lens) if lens else begin(None)[0].project
    # the first of each only to have everything loaded
    *_, screen, full = (
        studio.take(project, grade, View(), hasty=hasty) for grade in ("soon", "final", "soon", "final")
    )
    exposure = studio.exposure_of(full)
    codes = (pixels_of(each.ghosts + each.rest, exposure, View()).astype(int) for each in (screen, full))
    apart = np.abs(np.subtract(*codes))
    light = screen.ghost_light.sum() / full.ghost_light.sum() - 1.0
    return (
        f"for the screen{' in haste' if hasty else ''} {screen.seconds:.2f} s, in full {full.seconds:.2f} s; apart by "
        f"{apart.mean():.2f} codes of 255 on average, 999 of 1000 by {np.percentile(apart, 99.9):.0f} at most, all by "
        f"{apart.max()}; light of the ghosts {100.0 * light:+.2f} %"
    )


def circles(page, x, y, seconds):
    """Move the pointer in circles that begin at a place, and tell how long that has taken."""
    start = time.perf_counter()
    while (now := time.perf_counter() - start) < seconds:
        angle = 2.0 * math.pi * now / 2.5
        page.mouse.move(x - 60.0 + 60.0 * math.cos(angle), y + 50.0 * math.sin(angle))
        page.wait_for_timeout(8)
        yield now


def let_go(tab):
    """Wait for the pictures after letting go: ms to that which is final for the screen, if any, and to the full one."""
    tab.rest()
    found = tab.js("[flarewright.view.stats.soon ?? null, flarewright.view.stats.final]")
    tab.js("flarewright.view.stats.soon = null")
    return found


def spread(values):
    return f"{median(values):.0f} ms (at worst {max(values):.0f})"


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
        server = editor.process.pid
        others = (
            [pid for pid in family(os.getpid()) if pid not in (os.getpid(), server)] if Path("/proc").exists() else []
        )
        before = None
        for now in circles(page, x, y, SECONDS):
            if now > SETTLE_S and before is None:
                shown = tab.js("flarewright.view.stats.shown.length")
                before = now, shown, processor_s([server]), processor_s(others)
        stats = tab.js("JSON.parse(JSON.stringify(flarewright.view.stats))")
        begun_at, shown, server_s, browser_s = before
        spent = SECONDS - begun_at
        count = max(len(stats["shown"]) - shown, 1)
        server_ms, browser_ms = (
            1000.0 * (processor_s(pids) - then) / count for pids, then in (([server], server_s), (others, browser_s))
        )
        width = tab.js("flarewright.view.image.width")
        page.mouse.up()
        after = [let_go(tab)]
        for _ in range(RELEASES - 1):
            x, y = tab.light()
            page.mouse.move(x, y)
            page.mouse.down()
            for _ in circles(page, x, y, HELD_S):
                pass
            page.mouse.up()
            after.append(let_go(tab))
        soon, final = ([each[k] for each in after if each[k] is not None] for k in (0, 1))
        # what is quickly drawn needs no traced picture in between
        soon_told = f"final for the screen {spread(soon)} and " if soon else ""
        print(
            f"{lens or 'sample'}: {count / spent:.0f} frames/s of {width} px, latency "
            f"{median(stats['latency']):.0f} ms (9 of 10 below {median(stats['latency'], 0.9):.0f}), processor time a "
            f"frame {server_ms:.0f} ms in the server, {browser_ms:.0f} ms in the browser, {soon_told}full picture "
            f"{spread(final)} after letting go {len(after)} times, start to first picture "
            f"{first:.1f} s; load {os.getloadavg()[0]:.0f}"
        )
        page.close()
        editor.end()
        if soon:
            for hasty in (False, True):
                print(f"  {screen_apart(lens, hasty)}")


if __name__ == "__main__":
    with browser() as chrome:
        for name in sys.argv[1:] or ["", "canon-28-80"]:
            measure(chrome, name)
