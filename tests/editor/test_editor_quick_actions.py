"""User actions faster than the editor's answers: `pytest -m browser`."""

import json

import numpy as np
import pytest
from PIL import Image

from flarewright.io.project.project_file import read_project

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import chromium, download, drop

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]


def delay(tab, ms=300):
    """Delay every change of the project, as on a busy computer."""
    tab.js(
        f"(() => {{ const ask = window.fetch; window.fetch = async (path, rest) => {{ if (String(path) === '/api/do') "
        f"await new Promise(done => {{ setTimeout(done, {ms}); }}); return ask(path, rest); }}; }})()"
    )


def test_what_is_saved_or_exported_is_what_was_typed(tab, tmp_path):
    """A value typed just before saving used to be missing in the file in seven of ten tries."""
    file = tmp_path / "shot.toml"
    tab.save_as(file)
    delay(tab)
    tab.page.fill("input[name=intensity]", "3.5")
    tab.page.keyboard.press("Control+s")
    tab.until("flarewright.state.lights[0].intensity === 3.5 && flarewright.state.clean")
    assert read_project(file).lights[0].intensity == 3.5
    tab.page.fill("input[name=intensity]", "2.5")
    tab.page.click("#save")
    tab.until("flarewright.state.lights[0].intensity === 2.5 && flarewright.state.clean")
    assert read_project(file).lights[0].intensity == 2.5
    tab.page.fill("input[name=intensity]", "1.5")
    exported = read_project(download(tab, "Project file", tmp_path / "exported.toml"))
    assert exported.lights[0].intensity == 1.5
    # the same for a cell of the prescription
    tab.tab("lens")
    tab.page.fill("[data-row='2'][data-column=thickness]", "4.25")
    tab.page.keyboard.press("Control+s")
    tab.until("flarewright.state.lens.rows[2].thickness === '4.25' && flarewright.state.clean")
    assert read_project(file).lens.rows[2].thickness == 4.25


def test_undo_takes_back_what_was_asked_for_last(tab):
    """Undo used to overtake the last key, which then ran after it."""
    before = tab.state()["lights"][0]["field_deg"]
    delay(tab)
    # a busy browser may drop the repeat of a key
    tab.js(
        "{ window.keys = 0; addEventListener('keydown', (event) => { keys += event.key === 'ArrowRight'; }, true); }"
    )
    tab.page.locator("#view").focus()
    for _ in range(20):
        # held down for longer than an answer takes
        tab.page.keyboard.down("ArrowRight")
        tab.page.wait_for_timeout(30)
    tab.page.keyboard.up("ArrowRight")
    tab.page.keyboard.press("Control+z")
    tab.until("flarewright.state.redo === 'Move the light' && !flarewright.under.way")
    tab.rest()
    assert tab.state()["lights"][0]["field_deg"] == before
    assert tab.state()["undo"] == ""
    tab.page.keyboard.press("Control+Shift+z")
    tab.until("flarewright.state.undo === 'Move the light'")
    # no key that the page got is lost
    keys = tab.js("keys")
    assert keys > 10
    assert tab.state()["lights"][0]["field_deg"][0] == pytest.approx(before[0] + 0.1 * keys)


def test_undo_while_a_path_plays_can_be_done_again(tab):
    """The stopped position used to be a step, which cleared the redo list."""
    tab.page.click("#path-key")
    tab.until("flarewright.state.lights[0].keys.length === 1")
    tab.page.fill("input[name=path_time]", "3")
    tab.page.press("input[name=path_time]", "Enter")
    tab.rest()
    tab.drag(tab.light(), tab.at(0.4, 0.6))
    tab.rest()
    tab.page.click("#path-key")
    tab.until("flarewright.state.lights[0].keys.length === 2")
    steps, place = tab.state()["steps"], tab.state()["lights"][0]["field_deg"]
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("t")
    tab.until("flarewright.player.playing && flarewright.view.shownGrade === 'moving'")
    tab.page.keyboard.press("Control+z")
    tab.until("flarewright.state.lights[0].keys.length === 1")
    tab.rest()
    assert not tab.js("flarewright.player.playing")
    assert tab.state()["steps"] == steps | {"at": steps["at"] - 1}
    assert tab.state()["lights"][0]["field_deg"] == place
    tab.page.keyboard.press("Control+Shift+z")
    tab.until("flarewright.state.lights[0].keys.length === 2")
    # without anything to undo, the project's picture is restored all the same
    tab.page.keyboard.press("t")
    tab.until("flarewright.player.playing && flarewright.view.shownGrade === 'moving'")
    tab.page.keyboard.press("Control+Shift+z")
    tab.until("!flarewright.player.playing")
    tab.rest()
    assert tab.js("flarewright.view.shownGrade") == "final"
    assert tab.state()["steps"] == steps


def test_two_numbers_typed_before_the_first_answer_both_count(tab):
    """The second used to be sent together with the old value of the first."""
    tab.js("flarewright.command('set_key', {light: 0, at_s: 0})")
    tab.js("flarewright.command('set_key', {light: 0, at_s: 3, field_deg: [-4, -2]})")
    tab.until("flarewright.state.lights[0].keys.length === 2")
    delay(tab)
    tab.page.fill("input[name=light_x]", "3.5")
    tab.page.fill("input[name=light_y]", "-1.25")
    tab.page.press("input[name=light_y]", "Enter")
    tab.until("flarewright.state.lights[0].field_deg.join() === '3.5,-1.25'")
    # a key that is moved behind another one is the same key, whenever the answer moves its row
    tab.page.fill("input[name=key_seconds_0]", "4.5")
    for value in ("7", "2.5"):
        tab.page.keyboard.press("Tab")
        tab.page.keyboard.type(value)
    tab.page.keyboard.press("Enter")
    tab.until("flarewright.state.lights[0].keys.at(-1).field_deg.join() === '7,2.5'")
    keys = tab.state()["lights"][0]["keys"]
    assert [(key["at_s"], key["field_deg"]) for key in keys] == [(3.0, [-4.0, -2.0]), (4.5, [7.0, 2.5])]
    tab.page.select_option("select[name=light_shape]", "rectangle")
    tab.until("flarewright.state.lights[0].shape")
    tab.page.fill("input[name=light_width]", "2")
    tab.page.fill("input[name=light_height]", "5")
    tab.page.press("input[name=light_height]", "Enter")
    tab.until("flarewright.state.lights[0].shape.size_deg.join() === '2,5'")


def test_the_focus_stays_with_a_key_that_moves_to_another_row(tab):
    """It used to stay in the row, so that what was typed next went to another key."""
    for at_s, place in ((0, [1, 2]), (3, [-4, -2]), (6, [5, 0])):
        tab.js(f"flarewright.command('set_key', {{light: 0, at_s: {at_s}, field_deg: {place}}})")
    tab.until("flarewright.state.lights[0].keys.length === 3")
    tab.page.fill("input[name=key_seconds_0]", "4.5")
    tab.page.keyboard.press("Tab")
    tab.until("document.querySelector('[name=key_seconds_1]')?.value === '4.5'")
    assert tab.js("document.activeElement.name") == "key_right_1"
    tab.page.keyboard.type("7")
    tab.page.keyboard.press("Enter")
    tab.until("flarewright.state.lights[0].keys[1].field_deg.join() === '7,2'")
    # a removed key is gone from the table while its button has the focus, and the next key can be removed
    tab.page.click("[name=key_remove_0]")
    tab.until("document.querySelectorAll('table.keys tbody tr').length === 2")
    assert tab.js("document.activeElement.name") == "key_remove_0"
    tab.page.keyboard.press("Enter")
    tab.until("document.querySelectorAll('table.keys tbody tr').length === 1")
    assert [key["at_s"] for key in tab.state()["lights"][0]["keys"]] == [6.0]


def test_a_light_added_while_a_path_plays_is_no_error_of_the_page(tab):
    """The pictures on their way lack it, which used to be a message of the script: "Cannot read properties"."""
    tab.js("flarewright.command('set_key', {light: 0, at_s: 0})")
    tab.js("flarewright.command('set_key', {light: 0, at_s: 3, field_deg: [-4, -2]})")
    tab.until("flarewright.state.lights[0].keys.length === 2")
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("t")
    tab.until("flarewright.player.playing && flarewright.view.shownGrade === 'moving'")
    tab.page.click("#light-add")
    tab.until("flarewright.light === 1 && flarewright.view.mover.lights?.length === 2")
    # the panel shows the new light as soon as a picture has it
    tab.until("Math.abs(document.querySelector('[name=light_x]').value - flarewright.view.mover.lights[1][0]) < 0.006")
    assert tab.page.locator(".toast.error").all_inner_texts() == []


def test_the_circle_of_a_target_moves_with_the_light(tab):
    """It used to stand still while the light was dragged and the target picture moved."""
    tab.tab("target")
    tab.until("flarewright.view.places.length > 0")
    tab.js("flarewright.command('set_ghost_target', {ghost: '8-6', values: {move_mm: 2}})")
    tab.page.click("[data-compare=side]")
    tab.rest()
    where = "(v => v.line(v.placeOf(v.places.find(one => one.name === '8-6')) + 2))(flarewright.view)"
    x, y = tab.light()
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x - 150, y + 90, steps=10)
    # not the previous one: pictures of the drag have arrived
    tab.until("(v => v.mover.live && v.mover.lights && !v.mover.busy() && v.shownGrade === 'final')(flarewright.view)")
    during = tab.js(where)
    tab.page.mouse.up()
    tab.rest()
    # its place afterwards is that of the project
    assert during == pytest.approx(tab.js(where), abs=1e-3)
    slopes = tab.js("flarewright.state.lights[0].field_deg.map(deg => Math.tan(deg * Math.PI / 180))")
    assert during[0] * slopes[1] == pytest.approx(during[1] * slopes[0], abs=1e-6)


def test_what_went_wrong_is_not_pushed_out_by_what_went_well(tab):
    said = ["it cannot be read", "one", "two", "three"]
    for k, words in enumerate(said):
        tab.js(f"import('/static/ui.js').then(ui => ui.toast({json.dumps(words)}, '{'good' if k else 'error'}'))")
    assert tab.page.locator(".toast").all_inner_texts() == [said[0], *said[2:]]
    # later messages push out earlier ones of the same kind
    for words in ("no", "nor this", "this is new"):
        kind = "info" if words == "this is new" else "error"
        tab.js(f"import('/static/ui.js').then(ui => ui.toast({json.dumps(words)}, '{kind}'))")
    assert tab.page.locator(".toast").all_inner_texts() == ["no", "nor this", "this is new"]


def test_that_the_editor_is_gone_is_said_until_it_is_back(tab):
    tab.editor.kill()
    gone = tab.page.locator(".toast.error", has_text="does not answer")
    gone.wait_for()
    tab.page.fill("input[name=intensity]", "3")
    tab.page.keyboard.press("Enter")
    # it stays longer than other messages
    tab.page.wait_for_timeout(10000)
    assert gone.count() == 1
    tab.editor.start()
    tab.page.locator(".toast.good", has_text="is back").wait_for(timeout=20000)
    assert gone.count() == 0
    # the browser logs it too
    tab.said[:] = [said for said in tab.said if "net::ERR_" not in said]


def test_ghosts_of_the_lens_before_are_none_of_the_next(tab):
    """A choice in the old table used to become a rule for another lens' ghost."""
    tab.tab("ghosts")
    assert tab.page.locator("tr[data-ghost]").count() > 5
    tab.js("flarewright.command('choose_lens', {lens: 'takumar-50-f1.4'})")
    tab.until("flarewright.state.lens.name.includes('Takumar')")
    listed = tab.js("fetch('/api/ghosts').then(a => a.json())")
    assert listed["fresh"] or listed["ghosts"] == []
    assert tab.js("flarewright.ghosts.fresh || flarewright.ghosts.ghosts.length === 0")
    tab.rest()
    assert tab.page.locator("tr[data-ghost]").count() > 5


def test_a_pull_that_is_refused_leaves_the_ghost_where_it_was(tab):
    """It used to stay where the drag ended."""
    tab.tab("target")
    tab.page.click("#ghost-target-add")
    tab.until("flarewright.ghostTarget === 0")
    where = "(v => v.toPage(...v.line(flarewright.state.design.ghost_targets[0].place_mm)))(flarewright.view)"
    x, y = tab.js(where)
    box = tab.page.locator("#view").bounding_box()
    start = (box["x"] + x, box["y"] + y)
    refused = {"status": 400, "body": json.dumps({"error": "it was taken away in another tab"})}
    tab.page.route("**/api/do", lambda route: route.fulfill(**refused))
    tab.drag(start, (start[0] - 60, start[1] + 33))
    tab.page.locator(".toast.error", has_text="It was taken away").wait_for()
    assert tab.js("flarewright.view.preview") is None
    assert tab.js(where) == [x, y]


def test_a_light_that_another_tab_takes_away_is_held_no_more(tab):
    """Every move of the drag used to be an error of the page."""
    tab.page.click("#light-add")
    tab.until("flarewright.state.lights.length === 2 && flarewright.light === 1")
    tab.rest()
    x, y = tab.light()
    x2, y2 = tab.js("flarewright.view.lightPage(1)")
    box = tab.page.locator("#view").bounding_box()
    tab.page.mouse.move(box["x"] + x2, box["y"] + y2)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + x2 - 60, box["y"] + y2 + 20, steps=5)
    tab.until("flarewright.view.drag?.kind === 'light' && flarewright.view.shownGrade === 'moving'")
    tab.js("fetch('/api/undo', {method: 'POST'})")
    tab.until("flarewright.state.lights.length === 1")
    tab.page.mouse.move(box["x"] + x2 - 90, box["y"] + y2 + 20, steps=3)
    tab.page.mouse.up()
    tab.rest()
    assert tab.light() == (x, y)
    assert tab.js("flarewright.view.shownGrade") == "final"


def test_a_light_removed_during_its_drag_hands_the_drag_to_no_other(tab):
    """The next light, which got its number, used to jump to the pointer."""
    tab.page.click("#light-add")
    tab.until("flarewright.state.lights.length === 2 && flarewright.light === 1")
    tab.rest()
    other = tab.state()["lights"][1]["field_deg"]
    x, y = tab.light()
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x - 60, y + 30, steps=5)
    tab.until("flarewright.view.drag?.kind === 'light' && flarewright.view.shownGrade === 'moving'")
    tab.page.locator("#view").focus()
    tab.page.keyboard.press("Delete")
    tab.until("flarewright.state.lights.length === 1")
    tab.page.mouse.move(x - 120, y + 60, steps=5)
    tab.page.mouse.up()
    tab.rest()
    assert tab.state()["lights"][0]["field_deg"] == other
    assert tab.js("flarewright.view.drag") is None


def test_zoom_pan_and_wipe_are_reached_by_keys(tab):
    """They used to work with a mouse only."""
    view = tab.page.locator("#view")
    view.focus()
    fitted = tab.js("flarewright.view.frame()")
    box = view.bounding_box()
    tab.page.keyboard.press("PageUp")
    larger = tab.js("flarewright.view.frame()")
    assert larger["w"] == pytest.approx(1.25 * fitted["w"])
    # about the middle of the view
    assert larger["x"] + larger["w"] / 2 == pytest.approx(box["width"] / 2)
    place = tab.state()["lights"][0]["field_deg"]
    for key, axis, by in (("ArrowRight", "x", -40), ("ArrowLeft", "x", 0), ("ArrowUp", "y", 40), ("ArrowDown", "y", 0)):
        tab.page.keyboard.press(f"Control+{key}")
        assert tab.js("flarewright.view.frame()")[axis] == pytest.approx(larger[axis] + by)
    tab.page.keyboard.press("PageDown")
    assert tab.js("flarewright.view.frame()")["w"] == pytest.approx(fitted["w"])
    tab.tab("target")
    tab.page.click("[data-compare=wipe]")
    view.focus()
    tab.page.keyboard.press("]")
    assert tab.js("flarewright.view.wipe") == pytest.approx(0.55)
    for _ in range(30):
        tab.page.keyboard.press("[")
    assert tab.js("flarewright.view.wipe") == 0.0
    # these keys still scroll pages and lists
    tab.tab("ghosts")
    tab.page.focus("tr[data-ghost] >> nth=0")
    tab.page.keyboard.press("PageUp")
    assert tab.js("flarewright.view.frame()")["w"] == pytest.approx(fitted["w"])
    assert tab.state()["lights"][0]["field_deg"] == place


def test_a_large_page_shows_a_sharp_picture(tab):
    """In large windows the picture at rest used to be 960 pixels wide, and stretched."""
    small = tab.shown()
    assert small.shape[1] == 960
    tab.page.set_viewport_size({"width": 1900, "height": 1080})
    tab.until("flarewright.view.image.width > 960")
    assert tab.js("[flarewright.view.image.width, flarewright.view.image.height]") == tab.js(
        "[flarewright.view.frame().w, flarewright.view.frame().h].map(side => Math.round(side * devicePixelRatio))"
    )
    # the picture is the same in brightness and place
    large = np.asarray(Image.fromarray(tab.shown()).resize((96, 54), Image.Resampling.BOX), dtype=float)
    both = np.asarray(Image.fromarray(small).resize((96, 54), Image.Resampling.BOX), dtype=float), large
    assert np.abs(both[0] - both[1]).mean() < 0.5
    # a drag is as fast as ever, and its final picture is sharp
    x, y = tab.light()
    mouse = tab.page.mouse
    mouse.move(x, y)
    mouse.down()
    mouse.move(x - 90, y + 40, steps=6)
    tab.until("flarewright.view.shownGrade === 'moving'")
    assert tab.js("flarewright.view.image.width") <= 960
    mouse.up()
    tab.rest()
    assert tab.js("flarewright.view.image.width === Math.round(flarewright.view.frame().w * devicePixelRatio)")
    # zooming in shows more detail, up to the file's size; 1:1 is one file pixel per screen pixel
    tab.page.keyboard.press("z")
    tab.until("flarewright.view.image.width === 1920")
    assert tab.js("Math.round(flarewright.view.frame().w * devicePixelRatio)") == 1920


def doublet(name):
    """Return a lens file of a format with reported repairs."""
    rows = [("0.01627", "6", "N-BK7"), ("-0.0224", "2.5", "SF5"), ("-0.0077", "90", "")]
    lines = ["MODE SEQ", f"NAME {name}", "UNIT MM", "ENPD 20", "SURF 0", "  DISZ INFINITY"]
    for number, (curvature, gap, glass) in enumerate(rows, start=1):
        lines += [f"SURF {number}", f"  CURV {curvature}", f"  DISZ {gap}", "  DIAM 12.5 1"]
        lines += ["  STOP"] * (number == 1) + [f"  GLAS {glass}"] * bool(glass)
    return "\n".join([*lines, "SURF 4", "  DISZ 0"])


def test_what_was_noticed_in_a_file_goes_with_it_and_words_are_no_files(tab):
    """Remarks on the previous file used to cover the light, and dragging their text opened the drop area for files."""
    for name in ("one", "two"):
        drop(tab, f"{name}.zmx", doublet(name).encode())
        tab.until(f"flarewright.state.lens.name === '{name}'")
        tab.until("document.querySelector('.toast[data-about=noticed]')")
    tab.rest()
    assert tab.js("document.querySelectorAll('.toast[data-about=noticed]').length") == 1
    assert tab.js("[...document.querySelectorAll('.toast[data-about=opened]')].map(each => each.textContent)") == [
        "Opened two.zmx"
    ]
    note = tab.page.locator(".toast[data-about=noticed] li").first
    box = note.bounding_box()
    tab.js("getSelection().selectAllChildren(document.querySelector('.toast[data-about=noticed]'))")
    x, y = box["x"] + 12, box["y"] + 8
    tab.drag((x, y), (x - 150, y - 60), hold_ms=40)
    assert tab.js("document.getElementById('drop').hidden")


def test_a_dialog_closes_by_a_click_beside_it_only(tab):
    """A click on its padding, or the end of a drag in its field, used to close it and lose what was typed."""
    tab.page.click("#open")
    tab.page.fill("dialog input", "some/where.toml")
    box = tab.page.locator("dialog").bounding_box()
    tab.page.mouse.click(box["x"] + 4, box["y"] + 4)
    field = tab.page.locator("dialog input").first.bounding_box()
    tab.page.mouse.move(field["x"] + 40, field["y"] + 8)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] - 30, field["y"] + 8, steps=4)
    tab.page.mouse.up()
    assert tab.page.input_value("dialog input") == "some/where.toml"
    tab.page.mouse.click(box["x"] - 30, box["y"] + 20)
    tab.until("!document.querySelector('dialog')")


def test_the_chosen_light_stays_chosen_when_undo_gives_it_another_number(tab):
    for _ in range(2):
        tab.js("flarewright.command('add_light', {})")
    tab.until("flarewright.state.lights.length === 3")
    names = [light["name"] for light in tab.state()["lights"]]
    tab.js("flarewright.command('remove_light', {light: 0})")
    tab.until("flarewright.state.lights.length === 2")
    tab.js("flarewright.chooseLight(1)")
    assert tab.state()["lights"][1]["name"] == names[2]
    tab.page.click("#undo")
    tab.until("flarewright.state.lights.length === 3")
    assert tab.js("flarewright.state.lights[flarewright.light].name") == names[2]
