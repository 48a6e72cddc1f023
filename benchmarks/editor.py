"""Benchmark of the editor in a real browser: `python benchmarks/editor.py [LENS...]`.

The script drags the light in circles, with 60 pointer moves per second, for some seconds. It counts pictures when the
browser has painted them; latency is the time from a pointer move to the picture of that position. Then it drags and
releases the light several times more and reports the median and the longest time from the release to the pictures.
Processor time is that of the server and of all browser processes; unlike wall time it does not depend on other
programs (Linux). For a lens that is traced for the screen before it is traced in full, two more lines report the
difference between that picture and the full one, with normal and with reduced detail, in codes of 255 as displayed.
Requires the extra e2e and Chromium.
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

from flarewright.editor.preview import render_picture
from flarewright.editor.preview.display_image import pixels_of
from flarewright.editor.session.files import project_for_lens
from flarewright.editor.session.session import begin
from flarewright.editor.session.view_settings import View

SECONDS = 4.0
# start of a drag that is not counted, because pictures still change their size
SETTLE_S = 1.0
# number of releases, and duration of each drag after the first, seconds
RELEASES, HELD_S = 8, 1.0


def median(values, part=0.5):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else float("nan")


def family(pid):
    """Return the ids of a process and all its descendants."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += family(int(child))
    return found


def processor_s(pids):
    """Return the summed processor time of running processes; 0 where the system does not report it."""
    total = 0.0
    for pid in pids:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def screen_apart(lens, hasty):
    """Describe the difference between the final screen picture and the full one."""
    project = project_for_lens(lens) if lens else begin(None)[0].project
    # the first picture of each kind only warms up
    *_, screen, full = (
        render_picture.take(project, grade, View(), hasty=hasty) for grade in ("soon", "final", "soon", "final")
    )
    exposure = render_picture.exposure_of(full)
    codes = (pixels_of(each.ghosts + each.rest, exposure, View()).astype(int) for each in (screen, full))
    apart = np.abs(np.subtract(*codes))
    light = screen.ghost_light.sum() / full.ghost_light.sum() - 1.0
    return (
        f"for the screen{', reduced detail,' if hasty else ''} {screen.seconds:.2f} s, in full {full.seconds:.2f} s; "
        f"difference {apart.mean():.2f} codes of 255 on average, {np.percentile(apart, 99.9):.0f} at the 99.9th "
        f"percentile, {apart.max()} at most; light of the ghosts {100.0 * light:+.2f} %"
    )


def circles(page, x, y, seconds):
    """Move the pointer in circles from a starting point and yield the elapsed time."""
    start = time.perf_counter()
    while (now := time.perf_counter() - start) < seconds:
        angle = 2.0 * math.pi * now / 2.5
        page.mouse.move(x - 60.0 + 60.0 * math.cos(angle), y + 50.0 * math.sin(angle))
        page.wait_for_timeout(8)
        yield now


def let_go(tab):
    """Wait for the pictures after a release; return ms to the final screen picture, if any, and to the full one."""
    tab.rest()
    found = tab.js("[flarewright.view.stats.soon ?? null, flarewright.view.stats.final]")
    tab.js("flarewright.view.stats.soon = null")
    return found


def spread(values):
    return f"{median(values):.0f} ms (at worst {max(values):.0f})"


def measure(chrome, lens):
    with tempfile.TemporaryDirectory() as state:
        started = time.perf_counter()
        editor = Editor(state, *([lens] if lens else []))
        page = chrome.new_page(viewport={"width": 1420, "height": 860})
        page.goto(editor.address)
        # the page's Content-Security-Policy forbids scripts from text, so the browser cannot wait for one by itself
        while not page.evaluate("Boolean(window.flarewright?.view?.image)"):
            page.wait_for_timeout(5)
        first = time.perf_counter() - started
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
        started_at, shown, server_s, browser_s = before
        spent = SECONDS - started_at
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
        # pictures that are drawn quickly have no separate screen version
        soon_reported = f"final for the screen {spread(soon)} and " if soon else ""
        print(
            f"{lens or 'sample'}: {count / spent:.0f} frames/s of {width} px, latency "
            f"{median(stats['latency']):.0f} ms (9 of 10 below {median(stats['latency'], 0.9):.0f}), processor time a "
            f"frame {server_ms:.0f} ms in the server, {browser_ms:.0f} ms in the browser, {soon_reported}full picture "
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
