"""Direct changes: the ghost gets its new size, the stop its new place."""

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.design.finishing.lens_edits import move_stop, resize_all, resize_ghost
from flarewright.design.problem.ghosts import placed_ghosts
from flarewright.errors import ProjectError
from flarewright.io.lens.glass_catalogue import cauchy_from_abbe
from flarewright.io.lens.toml_lens import read_lens
from flarewright.model import Lens, Medium, Position, Stop, Surface
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.zoom import at_position
from flarewright.render.scene.resolve import load_lens

LENS = load_lens("heliar-tronnier")


@pytest.mark.parametrize(("mirror", "row", "height"), [("first", 4, 1.1), ("second", 1, 1.3)])
def test_a_ghost_gets_its_size_by_one_radius(mirror, row, height):
    done = resize_ghost(LENS, (4, 1), height, mirror=mirror)
    assert done.row == row
    g = done.ghosts.index((4, 1))
    assert abs(done.after[g, 1] / done.before[g, 1]) == pytest.approx(height, rel=1e-6)
    changed = [k for k, (a, b) in enumerate(zip(LENS.rows, done.lens.rows, strict=True)) if a != b]
    assert changed == [row]
    # the written lens gives the same
    entrance = 2.0 * LENS.rows[0].semi_diameter
    now = placed_ghosts(done.lens, entrance=entrance)
    assert np.allclose([[ghost.place, ghost.radius] for ghost in now], done.after, rtol=1e-9)
    assert first_order(done.lens).stop_semi_diameter == pytest.approx(first_order(LENS).stop_semi_diameter)


@pytest.mark.parametrize(("by", "height"), [("stop", 0.5), ("entrance", 0.3)])
def test_one_opening_resizes_all_that_it_bounds(by, height):
    """With a small stop, the stop bounds all ghosts; with a small front, the front bounds most of them."""
    done = resize_all(LENS, height, by=by, f_number=11.0 if by == "stop" else None)
    radii = np.abs(done.after[:, 1] / done.before[:, 1])
    assert (radii <= 1.0 + 1e-12).all()
    assert radii.min() >= height - 1e-12
    assert np.isclose(radii, height).sum() >= (len(radii) if by == "stop" else 4)
    # the written lens gives the same
    now = placed_ghosts(done.lens)
    assert np.allclose([[one.place, one.radius] for one in now], done.after, rtol=1e-9)
    assert first_order(done.lens).efl == pytest.approx(first_order(LENS).efl)


def test_the_stop_moves_and_keeps_its_size():
    moved = move_stop(LENS, 3)
    assert isinstance(moved.rows[3], Stop)
    assert len(moved.rows) == len(LENS.rows) - 1
    assert sum(row.thickness for row in moved.rows) == pytest.approx(sum(row.thickness for row in LENS.rows))
    assert first_order(moved).stop_semi_diameter == pytest.approx(first_order(LENS).stop_semi_diameter)


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "7-1", "--height", "2"], "no ghost 7-1"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "x", "--height", "2"], "write its mirrors"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "4-1", "--height", "0"], "no size"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "4-1", "--height", "2", "--mirror", "x"], "first or"),
        (["resize", "heliar-tronnier", "-o", "a.exr", "--ghost", "4-1", "--height", "2"], "must be named"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--height", "2"], "--ghost J-I for one"),
        (["resize", "heliar-tronnier", "-o", "own.toml", "--all", "stop", "--height", "0.5"], "own.toml exists"),
        (["move-stop", "heliar-tronnier", "-o", "own.toml", "--row", "3"], "own.toml exists"),
        (
            ["resize", "heliar-tronnier", "-o", "a.toml", "--all", "stop", "--height", "0.5", "--mirror", "second"],
            "--mirror is for one ghost",
        ),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--all", "x", "--height", "2"], "stop or entrance"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--all", "entrance", "--height", "9"], "wider than that"),
        (["resize", "heliar-tronnier", "-o", "a.toml", "--all", "stop", "--height", "0.001"], "f-numbers go from"),
        (
            ["move-stop", "heliar-tronnier", "-o", "a.toml", "--row", "5"],
            "row 5 is the stop already",
        ),
        (["move-stop", "heliar-tronnier", "-o", "a.toml", "--row", "1"], "glass is in front"),
        (
            ["move-stop", "heliar-tronnier", "-o", "a.toml", "--row", "99"],
            "row 99 cannot become the stop: choose a surface between 0 and",
        ),
        (["move-stop", "nikon-28-75", "-o", "a.toml", "--row", "24"], "f-numbers go from 0.3 to 256"),
        (
            ["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "8-6", "--height", "1.1", "--fstop", "1"],
            "f/1 is faster than Heliar-Tronnier 100 mm f/3.5 opens (f/3.5)",
        ),
        (
            ["resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "8-6", "--height", "0.2", "--fstop", "200"],
            "f-numbers go from 0.3 to 256",
        ),
    ],
)
def test_errors_are_reported(words, reported, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text("mine")
    assert run(["design", *words]) == 2
    assert reported in capsys.readouterr().err
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_commands_write_lenses(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["design", "resize", "heliar-tronnier", "-o", "a.toml", "--ghost", "4-1", "--height", "1.1"]) == 0
    assert "1.100" in capsys.readouterr().out
    assert run(["design", "move-stop", "heliar-tronnier", "-o", "b.toml", "--row", "3"]) == 0
    assert "the stop is row 3" in capsys.readouterr().out
    for name in ("a.toml", "b.toml"):
        assert read_lens(tmp_path / name)[0].rows


def test_a_size_that_no_radius_gives_is_refused():
    with pytest.raises(ProjectError, match="no curvature of row"):
        resize_ghost(LENS, (2, 1), 1e6)


def zoom(gaps, **changes):
    """Return a lens of two elements with the stop between them, and two positions that move some gaps."""
    glass = Medium(glass=None, n_d=1.6, v_d=50.0, dispersion=cauchy_from_abbe(1.6, 50.0))
    rows = (
        Surface(curvature=1 / 40, thickness=4.0, medium=glass, semi_diameter=8.0),
        Surface(curvature=-1 / 300, thickness=10.0, semi_diameter=8.0),
        Stop(thickness=6.0),
        Surface(curvature=1 / 60, thickness=3.0, medium=glass, semi_diameter=8.0),
        Surface(curvature=-1 / 80, thickness=5.0, semi_diameter=8.0),
        Surface(curvature=1 / 90, thickness=3.0, medium=glass, semi_diameter=8.0),
        Surface(curvature=-1 / 200, thickness=0.0, semi_diameter=8.0),
    )
    positions = tuple(
        Position(name=name, gaps=tuple((row, thickness * part) for row, thickness in gaps))
        for name, part in (("wide", 1.0), ("tele", 0.5))
    )
    return Lens(name="a zoom", rows=rows, f_number=8.0, positions=positions, **changes)


@pytest.mark.parametrize("gaps", [((1, 10.0),), ((2, 6.0),), ((1, 10.0), (2, 6.0), (4, 5.0)), ((4, 5.0),)])
def test_a_zoom_keeps_its_gaps_when_its_stop_moves(gaps):
    """Rows got new numbers, but not the gaps that move: the stop's own gap was lost, or glass called moving."""
    lens = zoom(gaps)
    moved = move_stop(lens, 5)
    for before, after in zip(lens.positions, moved.positions, strict=True):
        one, other = at_position(lens, before), at_position(moved, after)
        # the old stop is air and the new one, a plane in place of a weak surface, stands where that was
        assert sum(row.thickness for row in one.rows[:5]) == pytest.approx(sum(row.thickness for row in other.rows[:4]))
        thick = [row.thickness for row in one.rows]
        assert [row.thickness for row in other.rows] == pytest.approx([*thick[:1], thick[1] + thick[2], *thick[3:]])


def test_a_zoom_whose_last_group_moves_is_not_resized():
    """The distance of the sensor by the rows was written for all positions: the others were out of focus."""
    lens = zoom(((1, 10.0), (4, 5.0)))
    wide, tele = (first_order(at_position(lens, position)).sensor_distance for position in lens.positions)
    assert abs(wide - tele) > 0.5
    with pytest.raises(ProjectError, match=r"at 'tele', and .* remove its \[\[positions\]\]"):
        resize_ghost(lens, (1, 0), 1.1)
    assert resize_ghost(lens.replace(positions=()), (1, 0), 1.1).lens.sensor_distance == pytest.approx(wide)
    # what a patent rounds moves no sensor
    rounded = lens.replace(positions=tuple(p.replace(gaps=((1, 10.0), (4, 5.0 - 1e-3 * k)))
                                           for k, p in enumerate(lens.positions)))  # fmt: skip
    assert resize_ghost(rounded, (1, 0), 1.1).lens.positions == rounded.positions


def test_a_resized_lens_states_no_focal_length_of_the_old_one():
    """A remark then compared the new lens with the patent, and a zoom was set by focal lengths that it has not."""
    lens = zoom(((1, 10.0),), stated_focal_length=33.0)
    positions = tuple(
        position.replace(gaps=((1, gap),), f_number=f_number)
        for position, gap, f_number in zip(lens.positions, (10.0, 9.9), (8.0, 9.0), strict=True)
    )
    efls = [first_order(at_position(lens, position)).efl for position in positions]
    positions = tuple(one.replace(focal_length=0.99 * efl) for one, efl in zip(positions, efls, strict=True))
    lens = lens.replace(positions=(*positions, positions[1].replace(name="near", focus_distance=1e6)))
    bent = resize_ghost(lens, (1, 0), 1.1).lens
    assert bent.stated_focal_length is None
    for before, after in zip(lens.positions[:2], bent.positions[:2], strict=True):
        old, new = first_order(at_position(lens, before)), first_order(at_position(bent, after))
        assert after.focal_length == pytest.approx(0.99 * new.efl)
        assert abs(new.efl / old.efl - 1.0) > 1e-3
        assert new.stop_semi_diameter == pytest.approx(old.stop_semi_diameter)
    assert bent.positions[2].focal_length == bent.positions[1].focal_length
    smaller = resize_all(lens, 0.5).lens
    assert smaller.stated_focal_length == 33.0
    assert [position.f_number for position in smaller.positions[:2]] == pytest.approx([16.0, 18.0])


def test_the_sensor_stays_where_it_is_when_a_rear_stop_moves():
    rows = list(zoom(((1, 10.0),)).rows)
    rows.append(rows.pop(2))
    rows[-2] = rows[-2].replace(thickness=8.0)
    lens = zoom(((1, 10.0),)).replace(rows=tuple(rows), positions=(), sensor_distance=60.0)
    moved = move_stop(lens, 4)
    ends = [sum(row.thickness for row in one.rows[:-1]) + one.sensor_distance for one in (lens, moved)]
    assert ends[1] == pytest.approx(ends[0])
