"""Holdouts: the part of a light that an image or a depth plate leaves visible, and its position."""

import numpy as np
import OpenEXR
import pytest
from judge import judge, probabilities
from PIL import Image

from flarewright.errors import ProjectError
from flarewright.io.project.project_file import read_project
from flarewright.io.project.project_text import project_text
from flarewright.io.render_state.reference_state import read_reference_state
from flarewright.model import Camera, Holdout, Light, Lines, Output, Polygon, Project, Quality, Rectangle
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.pupil.occlusion import hidden_part, visible_shape
from flarewright.optics.pupil.polygon import centroid, closed, content, mapped, shape_brightness
from flarewright.render.ghosts.extent_blur import extent_coverage
from flarewright.render.reference import batches as batch_module
from flarewright.render.reference import energy_ledger, estimator
from flarewright.render.reference.estimator import ReferenceRun
from flarewright.render.remarks import BLACK, HIDDEN
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

D_LINE = Lines(lines=((587.56, 1.0),))
SIZE = (120, 80)
FINE = 8
# half of the ghosts suffice to test holdouts
SOME = {"paths": "same-side"}
QUALITIES = [SOME, pytest.param({}, marks=pytest.mark.slow)]
DISC = Light(field_deg=(6.0, 4.0), spectrum=D_LINE, diameter_deg=3.0)


def project(light=DISC, holdout=None, mode="final", **how):
    return Project(
        lens="triplet-pestrecov",
        f_number=8.0,
        lights=(light,),
        camera=Camera(size_px=SIZE),
        quality=Quality(mode=mode, wavelengths=1, bridge=False, ringing="off", **how.pop("quality", {})),
        output=Output(**how),
        holdout=holdout,
    )


RENDERED = {}


def rendered(made):
    """Render a project, cached: the files of holdouts are written once per test."""
    key = made.model_dump_json()
    if key not in RENDERED:
        RENDERED[key] = render(made)
    return RENDERED[key]


def picture(made, name):
    found = next(layer for layer in rendered(made).layers if layer.name == name)
    return found.pixels.astype(np.float64) @ luminance_weights("rec709")


@pytest.fixture(scope="module")
def whole():
    """Return the full disc: its direct image, and column and row of its centre."""
    full = project(quality=SOME)
    x, y = rendered(full).summary["lights"][0]["direct_position_mm"]
    middle = (SIZE[0] / 2 + x * SIZE[0] / 36.0, SIZE[1] / 2 - y * SIZE[0] / 36.0)
    return picture(full, "starburst"), middle


def matte(path, column):
    """Write an image that is black left of a column of the picture, with the edge between pixels."""
    at = np.arange(SIZE[0] * FINE) / FINE
    grey = np.round(255.0 * np.clip((at + 1.0 / FINE - column) * FINE, 0.0, 1.0)).astype(np.uint8)
    Image.fromarray(np.tile(grey, (SIZE[1] * FINE, 1))).save(path)
    return str(path)


def depth_plate(path, depth, name="Z"):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: np.ascontiguousarray(depth, dtype=np.float32)}) as file:
        file.write(str(path))
    return str(path)


# ---------------------------------------------------------------------------------------------------------------------
# The remaining light


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize("mode", ["final", "draft"])
def test_two_halves_of_a_disc_are_the_disc(mode, quality, whole, tmp_path):
    """Half the direct image each, and together every pixel of the ghosts."""
    file = matte(tmp_path / "m.png", whole[1][0])
    halves = [Holdout(image=file), Holdout(image=file, invert=True)]
    full = picture(project(mode=mode, quality=quality), "ghosts")
    held = [project(DISC, half, mode, quality=quality) for half in halves]
    made = [{name: picture(half, name) for name in ("ghosts", "starburst")} for half in held]
    for half in made:
        assert half["starburst"].sum() == pytest.approx(0.5 * whole[0].sum(), rel=0.01)
        # different edges cut the ghosts of the two halves
        assert half["ghosts"].sum() == pytest.approx(0.5 * full.sum(), rel=0.1)
    both = made[0]["ghosts"] + made[1]["ghosts"]
    assert both.sum() == pytest.approx(full.sum(), rel=1e-3)
    assert np.abs(both - full).sum() < 0.02 * full.sum()
    # the black half is dark, the other unchanged
    column = int(whole[1][0])
    assert made[0]["starburst"][:, : column - 2].sum() < 0.02 * whole[0].sum()
    assert np.abs(made[0]["starburst"][:, column + 3 :] / whole[0][:, column + 3 :]).max() < 1.01


@pytest.mark.parametrize("quality", QUALITIES)
def test_what_is_seen_of_a_rectangle_is_a_smaller_one(quality, tmp_path):
    window = Light(field_deg=(6.0, 4.0), spectrum=D_LINE, shape=Rectangle(size_deg=(4.0, 2.0)))
    x = rendered(project(window, mode="draft")).summary["lights"][0]["direct_position_mm"][0]
    held = Holdout(image=matte(tmp_path / "m.png", SIZE[0] / 2 + x * SIZE[0] / 36.0))
    hidden = project(window, held, quality=quality)
    middle = np.degrees(np.arctan(np.tan(np.radians((4.0, 8.0))).mean())) - 6.0
    right = Polygon(corners_deg=((middle, -1.0), (2.0, -1.0), (2.0, 1.0), (middle, 1.0)))
    shots = make_shots(resolve_project(hidden), make_opening(resolve_project(hidden), None))
    left = sum(shot.share for shot in shots)
    assert left == pytest.approx(0.5, abs=0.005)
    seen = project(Light(field_deg=(6.0, 4.0), spectrum=D_LINE, shape=right, intensity=left), quality=quality)
    for name in ("ghosts", "starburst"):
        one, other = picture(hidden, name), picture(seen, name)
        assert one.sum() == pytest.approx(other.sum(), rel=3e-3)
    assert np.abs(picture(hidden, "ghosts") - picture(seen, "ghosts")).sum() < 0.02 * picture(seen, "ghosts").sum()


@pytest.mark.parametrize("effort", ["small", pytest.param("whole", marks=pytest.mark.slow)])
def test_the_reference_sees_the_same(effort, whole, tmp_path, monkeypatch):
    """Random directions of the visible part, by z-test; the entering light is that of the visible part."""
    layers, batches = "ghosts", 24
    if effort == "small":
        # each direction costs as much as hundreds of rays
        monkeypatch.setattr(batch_module, "AIM_SIDE", 4)
        monkeypatch.setattr(energy_ledger, "SIDE", 8)
        layers, batches = "passes", 12
    held = Holdout(image=matte(tmp_path / "m.png", whole[1][0] + 1.0))
    quality = {"source_step_deg": 1.5 if effort == "whole" else 2.0}
    judged = judge(project(DISC, held, quality=quality, layers=layers, starburst=False), batches=batches, side=32)
    final, mean, error = judged.total
    assert abs(final - mean) < 5e-3 * mean + 4.0 * error < 0.1 * mean
    _, worst = probabilities(judged, judged.mean)
    assert worst > 1e-4
    entered = []
    for hiding in (held, None):
        settled = resolve_project(project(DISC, hiding))
        shots = make_shots(settled, make_opening(settled, None))
        entered.append((energy_ledger.trace_ledger(shots, 0).entered_mm2, sum(shot.share for shot in shots)))
    assert entered[0][0] / entered[1][0] == pytest.approx(entered[0][1], rel=0.01)
    assert entered[0][1] == pytest.approx(0.427, abs=0.01)


def test_a_state_of_another_holdout_is_refused(tmp_path, monkeypatch):
    """The state compares the effect of a holdout, not its file name."""
    monkeypatch.setattr(estimator, "SIDE", 16)
    file, state = tmp_path / "m.png", tmp_path / "a.state.npz"
    quality = {"reference_samples": 1, "reference_from": "light"}
    made = project(DISC, Holdout(image=matte(file, 94.0)), "reference", quality=quality)
    render(made, run=ReferenceRun(state_file=state))
    render(made, run=ReferenceRun(resume=read_reference_state(state)))
    matte(file, 96.0)
    with pytest.raises(ProjectError, match="another holdout"):
        render(made, run=ReferenceRun(resume=read_reference_state(state)))


def test_grey_lets_its_part_through(tmp_path):
    grey = np.full((SIZE[1], SIZE[0]), 64, dtype=np.uint8)
    Image.fromarray(grey).save(tmp_path / "g.png")
    for light in (DISC, DISC.replace(diameter_deg=0.0)):
        full, part = (
            picture(project(light, held, quality=SOME), "ghosts")
            for held in (None, Holdout(image=str(tmp_path / "g.png")))
        )
        assert part.sum() == pytest.approx(64.0 / 255.0 * full.sum(), rel=2e-3)
        assert np.abs(part - 64.0 / 255.0 * full).sum() < 0.01 * part.sum()


def test_a_hidden_light_gives_nothing(tmp_path):
    Image.fromarray(np.zeros((SIZE[1], SIZE[0]), dtype=np.uint8)).save(tmp_path / "black.png")
    black = Holdout(image=str(tmp_path / "black.png"))
    for mode in ("final", "draft"):
        for light in (DISC, DISC.replace(diameter_deg=0.0)):
            found = render(project(light, black, mode))
            assert not any(layer.pixels.any() for layer in found.layers)
            assert found.summary["lights"][0]["visible"] == 0.0
            assert sum(found.summary["lights"][0]["direct_throughput_mm2"]) == 0.0
            # a remark names the holdout as the cause
            assert HIDDEN in found.remarks
            assert BLACK not in found.remarks
    # a second light beside it is not hidden
    other = DISC.replace(field_deg=(-6.0, 2.0), diameter_deg=0.0)
    both = Project(**{**dict(project()), "lights": (DISC.replace(holdout=black), other)})
    assert picture(both, "ghosts").sum() == pytest.approx(picture(project(other), "ghosts").sum(), rel=1e-6)


# ---------------------------------------------------------------------------------------------------------------------
# Position


@pytest.mark.parametrize("lens", ["flektogon-35", "heliar-tronnier"])
def test_a_plate_lies_in_the_picture(lens, tmp_path):
    """A point light is hidden exactly by the pixels of its direct image, with distortion."""
    made = project(Light(field_deg=(8.0, -5.0), spectrum=D_LINE)).replace(lens=lens)
    x, y = render(made).summary["lights"][0]["direct_position_mm"]
    zoom = SIZE[0] * FINE / 36.0
    column, row = int(SIZE[0] * FINE / 2 + x * zoom), int(SIZE[1] * FINE / 2 - y * zoom)
    spot = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), dtype=np.uint8)
    spot[row - 1 : row + 2, column - 1 : column + 2] = 255
    Image.fromarray(spot).save(tmp_path / "spot.png")
    for invert, seen in ((False, 1.0), (True, 0.0)):
        settled = resolve_project(made.replace(holdout=Holdout(image=str(tmp_path / "spot.png"), invert=invert)))
        assert make_shots(settled, make_opening(settled, None))[0].share == pytest.approx(seen, abs=1e-6)


def test_outside_the_plate_nothing_is_hidden(tmp_path):
    beside = DISC.replace(field_deg=(14.0, 0.0), diameter_deg=1.0)
    Image.fromarray(np.zeros((SIZE[1], SIZE[0]), dtype=np.uint8)).save(tmp_path / "black.png")
    for overscan, left in ((1.0, 1.0), (1.6, 0.0)):
        held = Holdout(image=str(tmp_path / "black.png"), overscan=overscan)
        settled = resolve_project(project(beside, held))
        assert sum(shot.share for shot in make_shots(settled, make_opening(settled, None))) == pytest.approx(left)


def test_a_plate_lies_over_the_frame_of_a_picture_with_overscan(tmp_path):
    """The same pixels hide the same light, with a margin around the frame that has other proportions."""
    made = project(Light(field_deg=(8.0, -5.0), spectrum=D_LINE))
    x, y = render(made).summary["lights"][0]["direct_position_mm"]
    zoom = SIZE[0] * FINE / 36.0
    column, row = int(SIZE[0] * FINE / 2 + x * zoom), int(SIZE[1] * FINE / 2 - y * zoom)
    spot = np.full((SIZE[1] * FINE, SIZE[0] * FINE), 255, dtype=np.uint8)
    spot[row - 1 : row + 2, column - 1 : column + 2] = 0
    Image.fromarray(spot).save(tmp_path / "spot.png")
    size = (SIZE[0] + 40, SIZE[1] + 40)
    wide = made.camera.replace(size_px=size, sensor_mm=(36.0 * size[0] / SIZE[0], 36.0 * size[1] / SIZE[0]))
    frame = (SIZE[0] / size[0], SIZE[1] / size[1])
    for camera, part in ((made.camera, (1.0, 1.0)), (wide, frame)):
        held = Holdout(image=str(tmp_path / "spot.png"), frame=part)
        settled = resolve_project(made.replace(camera=camera, holdout=held))
        assert make_shots(settled, make_opening(settled, None))[0].share == pytest.approx(0.0, abs=1e-6)


def test_a_depth_plate_hides_what_is_behind(tmp_path):
    """In metres: a lamp at 4 m, the sun, and pixels without an object."""
    lamp = DISC.replace(distance=4000.0, diameter_deg=0.0)
    nothing = [(far, 1.0, 1.0) for far in (0.0, np.inf, 65504.0)]
    for depth, lamp_seen, sun_seen in ((3.9, 0.0, 0.0), (4.1, 1.0, 0.0), *nothing):
        file = depth_plate(tmp_path / "d.exr", np.full((SIZE[1], SIZE[0]), depth))
        for light, seen in ((lamp, lamp_seen), (lamp.replace(distance=None), sun_seen)):
            settled = resolve_project(project(light, Holdout(depth=file)))
            assert sum(shot.share for shot in make_shots(settled, make_opening(settled, None))) == seen
        (tmp_path / "d.exr").unlink()


# ---------------------------------------------------------------------------------------------------------------------
# The geometry


ROUND = 2.0 * np.pi * np.arange(24) / 24.0
OUTLINES = {
    "disc": np.stack([20.3 + 7.0 * np.cos(ROUND), 15.1 + 5.0 * np.sin(ROUND)], axis=1),
    "concave, on the lines": np.array([(5.0, 5.0), (25.0, 5.5), (25.0, 12.0), (12.0, 12.0), (12.0, 22.0), (5.2, 22.0)]),
    "half outside": np.array([(-9.5, -4.0), (20.0, 3.0), (44.0, 25.0), (-3.0, 36.0)]),
}


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("kind", ["grey", "black and white"])
def test_a_cut_shape_covers_pixels_as_the_image_lets_it(name, kind):
    """Exact coverage of each pixel, pixel by pixel, and the points inside."""
    rng = np.random.default_rng(5)
    hidden = rng.random((30, 40))
    hidden = hidden if kind == "grey" else np.round(hidden)
    border, margin = closed(OUTLINES[name]), 12
    cut = visible_shape(border, hidden)
    size = (30 + 2 * margin, 40 + 2 * margin)
    whole, left = (extent_coverage(mapped(shape, np.eye(2), margin), size) for shape in (border, cut))
    expected = whole * (1.0 - np.pad(hidden, margin))
    assert left == pytest.approx(expected, abs=1e-12)
    assert content(cut) == pytest.approx(abs(expected.sum()), rel=1e-12)
    rows, columns = np.indices(size) - margin + 0.5
    middle = np.array([(expected * at).sum() for at in (columns, rows)]) / expected.sum()
    assert centroid(cut) == pytest.approx(middle, abs=0.2)
    places = rng.random((500, 2)) * [40, 30]
    seen = shape_brightness(border, places) * (1.0 - hidden[places[:, 1].astype(int), places[:, 0].astype(int)])
    assert shape_brightness(cut, places) == pytest.approx(seen, abs=1e-12)


def test_fine_images_are_averaged():
    """A chequered image of 400 pixels passes half of a shape, evenly."""
    chequered = np.indices((300, 400)).sum(axis=0) % 2.0
    border = closed(np.array([(0.0, 0.0), (400.0, 0.0), (400.0, 300.0), (0.0, 300.0)]))
    cut = visible_shape(border, chequered)
    assert content(cut) == pytest.approx(60_000.0, rel=1e-3)
    assert len(cut) < 70_000
    assert centroid(cut) == pytest.approx([200.0, 150.0], abs=0.1)


def test_all_nothing_and_between():
    border = closed(OUTLINES["disc"])
    assert visible_shape(border, np.zeros((30, 40))) is border
    assert len(visible_shape(border, np.ones((30, 40)))) == 0
    ramp = np.tile(np.arange(40.0) / 40.0, (30, 1))
    assert hidden_part(ramp, np.array([20.0, 11.3])) == pytest.approx(19.5 / 40.0)
    assert hidden_part(ramp, np.array([60.0, 11.3])) == 0.0


# ---------------------------------------------------------------------------------------------------------------------
# Files and flags


def test_project_files_keep_it(tmp_path):
    Image.fromarray(np.zeros((SIZE[1], SIZE[0]), dtype=np.uint8)).save(tmp_path / "m.png")
    text = (
        'lens = "heliar-tronnier"\n[holdout]\nimage = "m.png"\noverscan = 1.5\ninvert = true\n'
        '[[lights]]\nfield_deg = [1.0, 2.0]\nholdout = { depth = "d.exr", depth_unit_mm = 1.0 }\n'
    )
    (tmp_path / "p.toml").write_text(text)
    found = read_project(tmp_path / "p.toml")
    assert found.holdout == Holdout(image=str(tmp_path / "m.png"), overscan=1.5, invert=True)
    assert found.lights[0].holdout == Holdout(depth=str(tmp_path / "d.exr"), depth_unit_mm=1.0)
    for comments in (False, True):
        (tmp_path / "q.toml").write_text(project_text(found, folder=tmp_path, comments=comments))
        assert read_project(tmp_path / "q.toml") == found


@pytest.mark.parametrize(
    ("holdout", "words"),
    [
        ("image = 'no.png'", "no.png does not exist; give"),
        ("depth = 'no.exr'", "no.exr does not exist; give"),
        ("image = 'p.toml'", "cannot be read as an image"),
        ("depth = 'm.png'", "cannot be read as a depth plate"),
        ("image = 'square.png'", "of another shape than the picture's 120x80"),
        ("depth = 'colour.exr'", "it has no channel Z or depth"),
        ("", "a holdout is an image or a depth plate; give one"),
        ("image = 'm.png'\ndepth = 'd.exr'", "a holdout is an image or a depth plate; give one"),
        ("depth = 'd.exr'\ninvert = true", "invert is for an image"),
        ("image = 'm.png'\noverscan = 0.5", "holdout.overscan should be greater than or equal to 1, not 0.5"),
        ("image = 'm.png'\nmask = 'x'", "holdout.mask is not a known key"),
    ],
)
def test_bad_holdouts(holdout, words, tmp_path):
    Image.fromarray(np.zeros((SIZE[1], SIZE[0]), dtype=np.uint8)).save(tmp_path / "m.png")
    Image.fromarray(np.zeros((50, 50), dtype=np.uint8)).save(tmp_path / "square.png")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: np.ones((80, 120), dtype=np.float32) for name in "AB"}) as file:
        file.write(str(tmp_path / "colour.exr"))
    lights = "[[lights]]\nfield_deg = [1.0, 2.0]"
    head = f"lens = 'heliar-tronnier'\n[camera]\nsize_px = [120, 80]\n{lights}\n[holdout]\n"
    (tmp_path / "p.toml").write_text(f"{head}{holdout}\n")

    def shots():
        settled = resolve_project(read_project(tmp_path / "p.toml"))
        return make_shots(settled, make_opening(settled, None))

    with pytest.raises(ProjectError, match=words):
        shots()


def test_one_channel_by_any_name(tmp_path):
    """A matte with alpha only; depth channels with the names of various renderers."""
    for name, key in (("A", "image"), ("V", "image"), ("depth", "depth"), ("mist", "depth")):
        file = depth_plate(tmp_path / f"{name}.exr", np.full((SIZE[1], SIZE[0]), 0.25), name)
        settled = resolve_project(project(DISC, Holdout(**{key: file})))
        shots = make_shots(settled, make_opening(settled, None))
        assert sum(shot.share for shot in shots) == pytest.approx(0.25 if key == "image" else 0.0)


def test_a_cropped_plate_lies_where_its_window_is(tmp_path):
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage,
        "displayWindow": ((0, 0), (SIZE[0] - 1, SIZE[1] - 1)),
        "dataWindow": ((60, 0), (SIZE[0] - 1, 39)),
    }  # fmt: skip
    file = OpenEXR.File(header, {"A": np.ones((40, 60), dtype=np.float32)})
    file.write(str(tmp_path / "a.exr"))
    for field, seen in (((6.0, 4.0), 1.0), ((-6.0, 4.0), 0.0), ((6.0, -4.0), 0.0)):
        settled = resolve_project(project(DISC.replace(field_deg=field), Holdout(image=str(tmp_path / "a.exr"))))
        shots = make_shots(settled, make_opening(settled, None))
        assert sum(shot.share for shot in shots) == pytest.approx(seen)
