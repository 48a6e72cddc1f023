"""What a screen reader announces, what the Tab key reaches, and whether all text can be read: `pytest -m browser`."""

import io
import json

import pytest
from PIL import Image

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import chromium, drop

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]

PANELS = ("light", "ghosts", "lens", "iris", "coating", "target", "library")
# WCAG 2.2 AA, success criterion 1.4.3
LEAST_CONTRAST = 4.5

# Text and placeholders with too little contrast to their background, and text that is wider than its part of the page.
# Disabled controls are exempt; a name that ends in an ellipsis has its full text in a title.
READABLE = """(() => {
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const luminance = (rgb) => rgb.reduce((sum, part, k) => sum + linear(part / 255) * [0.2126, 0.7152, 0.0722][k], 0);
  const parse = (text) => [...text.match(/[\\d.]+/g).map(Number), 1].slice(0, 4);
  const over = (top, below) => below.map((v, k) => v * (1 - top[3]) + top[k] * top[3]);
  const behind = (element) => {
    const sheets = [];
    for (let each = element; each; each = each.parentElement) sheets.unshift(each);
    const colours = sheets.map((each) => parse(getComputedStyle(each).backgroundColor));
    return colours.reduce((below, top) => over(top, below), [0, 0, 0]);
  };
  const contrast = (ink, element) => {
    const ground = behind(element);
    const [low, high] = [luminance(over(parse(ink), ground)), luminance(ground)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const wrong = [];
  const seen = (element) => element.getClientRects().length && !element.closest('svg, option, [disabled]');
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const element = words.currentNode.parentElement;
    const text = words.currentNode.data.trim();
    if (!text || !seen(element)) continue;
    if (contrast(getComputedStyle(element).color, element) < LEAST) wrong.push(`contrast of ${text}`);
    const range = document.createRange();
    range.selectNodeContents(words.currentNode);
    const part = element.closest('.toast, dialog, #panel, #bar, #status, #section')?.getBoundingClientRect();
    const place = range.getBoundingClientRect();
    const shortened = getComputedStyle(element).textOverflow === 'ellipsis' && element.title;
    const wide = part && (place.right > part.right + 1 || place.left < part.left - 1);
    if (wide && !shortened) wrong.push(`width of ${text}`);
  }
  for (const field of document.querySelectorAll('input[placeholder]')) {
    const ink = getComputedStyle(field, '::placeholder').color;
    const text = field.placeholder;
    if (text && seen(field) && contrast(ink, field) < LEAST) wrong.push(`contrast of ${text}`);
  }
  return [...new Set(wrong)];
})()""".replace("LEAST", str(LEAST_CONTRAST))

# Controls without a name; the name of a button is its text or its label, and must contain a letter or a number.
NAMELESS = """(() => [...document.querySelectorAll('button, input:not([type=file]), select, textarea, canvas')]
  .filter((each) => each.getClientRects().length)
  .filter((each) => !/[\\p{L}\\p{N}]/u.test(each.ariaLabel || each.labels?.[0]?.textContent || each.textContent))
  .map((each) => each.outerHTML.slice(0, 120)))()"""


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768)])
def test_all_text_can_be_read_and_all_controls_have_names(tab, size):
    tab.page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    tab.rest()
    tab.js("flarewright.command('set_ghost', {name: flarewright.ghosts.ghosts[1].name, values: {muted: true}})")
    tab.rest()
    found = {}
    for name in PANELS:
        tab.tab(name)
        if name == "library":
            tab.page.locator("[data-lens]").first.wait_for()
        found[name] = tab.js(READABLE) + tab.js(NAMELESS)
    assert found == {name: [] for name in PANELS}
    tab.page.keyboard.press("o")
    tab.page.locator("dialog").wait_for()
    assert tab.js(READABLE) + tab.js(NAMELESS) == []
    tab.page.keyboard.press("Escape")
    # muted ghosts under the pointer and chosen ones
    tab.tab("ghosts")
    row = tab.page.locator("tr.muted")
    row.hover()
    assert tab.js(READABLE) == []
    row.click()
    assert tab.js(READABLE) == []


def test_a_long_name_of_a_file_is_shown_in_full(tab, tmp_path):
    """A name without spaces used to leave its message on the left, where it was cut."""
    tab.save_as(tmp_path / f"Übergroße-Sonne-光斑-{'sehr_langer_name_' * 10}.toml")
    tab.page.locator(".toast.good").wait_for()
    assert tab.js(READABLE) == []
    drop(tab, f"{'unreadable_' * 20}.png", b"\x89PNG")
    tab.page.locator(".toast.error").wait_for()
    assert tab.js(READABLE) == []
    # beside a button there is room for two lines, and the title has the whole name
    encoded = io.BytesIO()
    Image.new("RGB", (64, 36)).save(encoded, "PNG")
    drop(tab, f"{'plate_' * 20}.png", encoded.getvalue())
    tab.until("flarewright.state.plate")
    name = tab.page.locator("#plate-none + .quietly")
    assert name.get_attribute("title").endswith("plate_.png")
    assert name.bounding_box()["height"] < 40


def test_a_screen_reader_gets_values_and_states(tab):
    """Sliders used to be announced as a part of their length, and chosen buttons like all others."""
    bars = "[...document.querySelectorAll('#page input[type=range][aria-valuetext]')]"
    spoken = f"{bars}.map((bar) => [bar.ariaLabel, bar.ariaValueText])"
    assert ["f-number", "16"] in tab.js(spoken)
    assert ["Disc", "0 °"] in tab.js(spoken)
    assert tab.page.locator("#bar input[type=range]").get_attribute("aria-valuetext") == tab.page.input_value(
        "input[name=exposure]"
    )
    bar = tab.page.get_by_role("slider", name="f-number")
    bar.focus()
    bar.press("ArrowRight")
    assert bar.get_attribute("aria-valuetext") == "16.1"
    # the tooltip describes the focused control
    described = bar.get_attribute("aria-describedby")
    assert "Closing the iris" in tab.page.locator(f"#{described}").inner_text()
    tab.page.click("#light-add")
    tab.until("flarewright.light === 1")
    assert tab.page.get_by_role("button", name="Light 2", pressed=True).count() == 1
    assert tab.page.get_by_role("button", name="Light 1", pressed=False).count() == 1
    assert tab.page.get_by_role("group", name="Camera").get_by_role("combobox", name="Picture").count() == 1
    assert tab.page.get_by_role("tabpanel", name="Light").count() == 1
    # what has nothing to remove is disabled
    assert [tab.page.locator(one).is_disabled() for one in ("#plate-none", "#holdout-none")] == [True, True]


def test_the_tab_key_passes_the_table_of_ghosts_in_one_step(tab):
    """Each ghost used to be a stop, hundreds in a zoom."""
    tab.tab("ghosts")
    tab.page.locator("th.sort").last.focus()
    tab.page.keyboard.press("Tab")
    focused = "document.activeElement.dataset.ghost ?? document.activeElement.tagName"
    names = tab.js("[...document.querySelectorAll('tr[data-ghost]')].map((row) => row.dataset.ghost)")
    assert tab.js(focused) == names[0]
    tab.page.keyboard.press("ArrowDown")
    tab.page.keyboard.press("ArrowDown")
    tab.page.keyboard.press("Enter")
    tab.until(f"flarewright.ghost === {json.dumps(names[2])}")
    tab.page.keyboard.press("Tab")
    assert tab.js(focused) not in names
    tab.page.keyboard.press("Shift+Tab")
    assert tab.js(focused) == names[2]
    # the heads sort by keys, and state the order
    head = tab.page.locator("th.sort").first
    assert head.get_attribute("aria-sort") == "none"
    head.focus()
    head.press("Space")
    assert head.get_attribute("aria-sort") == "ascending"
