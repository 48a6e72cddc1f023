"""What a project names by the number of a light or a row stays with it when others are added, removed or moved."""

import subprocess
import sys

import numpy as np
import pytest

from flarewright.editor.commands.lens import own_lens, prescription
from flarewright.editor.commands.registry import done
from flarewright.errors import FlarewrightError
from flarewright.model import (
    Camera,
    Design,
    Element,
    GhostTarget,
    Lens,
    Light,
    Medium,
    Position,
    Project,
    RowScatter,
    Scatter,
    Stop,
    Surface,
)
from flarewright.optics.lens.zoom import at_position, positions_without_row
from flarewright.render.scene.resolve import open_lens, resolve_project

GLASS = Medium(n_d=1.6, v_d=50.0)


def do(project, command, /, **values):
    return done(project, command, values)[0]


def small_zoom():
    """Return a lens of two elements and a stop, whose air moves between two positions."""
    rows = (
        Surface(curvature=0.02, thickness=4.0, medium=GLASS, semi_diameter=10.0),
        Surface(curvature=-0.005, thickness=6.0, semi_diameter=10.0),
        Stop(thickness=5.0),
        Surface(curvature=0.01, thickness=3.0, medium=GLASS, semi_diameter=9.0),
        Surface(curvature=-0.02, thickness=30.0, semi_diameter=9.0),
    )
    positions = (
        Position(name="wide", gaps=((1, 2.0), (2, 5.0))),
        Position(name="long", gaps=((1, 9.0), (2, 7.0))),
    )
    return Lens(name="small zoom", f_number=4.0, rows=rows, positions=positions)


def zoom_project(**more):
    return Project(lens=small_zoom(), lights=(Light(field_deg=(3.0, 1.0)),), **more)


def test_targets_follow_their_lights(project):
    lights = tuple(project.lights[0].replace(name=name) for name in ("key", "rim", "back"))
    targets = [GhostTarget(place_mm=float(k), radius_mm=1.0, light=k) for k in range(3)]
    targets.append(GhostTarget(place_mm=9.0, radius_mm=1.0))
    project = project.replace(lights=lights, design=Design(ghost_targets=tuple(targets)))
    left = do(project, "remove_light", light=1).design.ghost_targets
    assert [(each.light, each.place_mm) for each in left] == [(0, 0.0), (1, 2.0), (None, 9.0)]


def test_a_light_that_is_not_there_is_not_removed_in_silence(project):
    project = do(project, "add_light")
    with pytest.raises(FlarewrightError, match="no light 7"):
        do(project, "remove_light", light=7)


@pytest.mark.parametrize("command", ["add_row", "duplicate_row", "remove_row"])
@pytest.mark.parametrize("row", [-1, 5])
def test_a_row_that_is_not_there_is_refused(command, row):
    with pytest.raises(FlarewrightError, match=rf"there is no row {row}; they count from 0 to 4"):
        do(zoom_project(), command, row=row)


def test_targets_scatter_and_fixed_rows_follow_their_rows(project):
    stop = open_lens(project.lens).lens.stop_row
    last = stop + 2
    design = Design(
        structure="lens",
        fixed_rows=(0, last),
        ghost_targets=(GhostTarget(ghost="1-0", move_mm=1.0), GhostTarget(ghost=f"{last}-{stop + 1}", move_mm=2.0)),
    )
    scatter = Scatter(model="abg", rows=(RowScatter(row=1, share=0.1), RowScatter(row=last, share=0.2)))
    project = project.replace(design=design, scatter=scatter)
    added = do(project, "add_row", row=1)
    assert [each.ghost for each in added.design.ghost_targets] == ["1-0", f"{last + 1}-{stop + 2}"]
    assert added.design.fixed_rows == (0, last + 1)
    assert [each.row for each in added.scatter.rows] == [1, last + 1]
    removed = do(added, "remove_row", row=1)
    assert [each.ghost for each in removed.design.ghost_targets] == [f"{last}-{stop + 1}"]
    assert [(each.row, each.share) for each in removed.scatter.rows] == [(last, 0.2)]


def test_an_element_keeps_its_tilt_without_its_last_row():
    lens = small_zoom().replace(positions=(), elements=(Element(rows=(3, 4), tilt_deg=(1.0, 0.0)),))
    rows = (*lens.rows[:4], lens.rows[4].replace(thickness=1.0, medium=GLASS), lens.rows[4])
    project = zoom_project().replace(lens=lens.replace(rows=rows, elements=(lens.elements[0].replace(rows=(3, 5)),)))
    left = do(project, "remove_row", row=5).lens
    assert left.elements == (Element(rows=(3, 4), tilt_deg=(1.0, 0.0)),)


@pytest.mark.parametrize(("command", "row"), [("add_row", 4), ("duplicate_row", 4), ("remove_row", 4)])
def test_the_sensor_stays_when_the_last_row_changes(command, row):
    lens = small_zoom().replace(positions=(), sensor_distance=25.0)
    project = zoom_project(camera=Camera(sensor_distance=24.0)).replace(lens=lens)
    changed = do(project, command, row=row)
    whole = sum(each.thickness for each in lens.rows[:-1])
    new = sum(each.thickness for each in changed.lens.rows[:-1])
    assert new + changed.lens.sensor_distance == pytest.approx(whole + 25.0)
    assert new + changed.camera.sensor_distance == pytest.approx(whole + 24.0)


def test_the_sensor_stays_when_a_last_stop_moves():
    """The stop behind the lens goes in front of it, so the last glass is the last row."""
    first, second, stop, *_ = small_zoom().rows
    lens = small_zoom().replace(positions=(), rows=(first, second, stop), sensor_distance=25.0)
    project = zoom_project(camera=Camera(sensor_distance=24.0)).replace(lens=lens)
    moved = do(project, "move_stop", row=0)
    assert isinstance(moved.lens.rows[0], Stop)
    assert moved.lens.sensor_distance == pytest.approx(25.0 + second.thickness)
    assert moved.camera.sensor_distance == pytest.approx(24.0 + second.thickness)


def test_a_gap_is_that_of_the_zoom_position():
    project = do(zoom_project(), "set_fields", values={"zoom": "long"})
    assert prescription(project).rows[1]["thickness"] == "9"
    changed = do(project, "set_cell", row=1, column="thickness", text="8.5")
    assert prescription(changed).rows[1]["thickness"] == "8.5"
    assert resolve_project(changed).lens.rows[1].thickness == 8.5
    # the rows and the other position are as they were
    assert changed.lens.rows == own_lens(project).rows
    assert changed.lens.positions[0] == project.lens.positions[0]
    # glass moves in no position
    assert do(project, "set_cell", row=0, column="thickness", text="5").lens.rows[0].thickness == 5.0


def test_a_gap_between_positions_is_refused_with_a_remedy():
    efl = [resolve_project(zoom_project(zoom=name)).order.efl for name in ("wide", "long")]
    project = zoom_project(zoom=float(np.mean(efl)))
    with pytest.raises(FlarewrightError, match="choose a position"):
        do(project, "set_cell", row=1, column="thickness", text="8.5")


def test_positions_without_a_row_keep_their_lengths():
    lens = small_zoom()
    for one, other in zip(lens.positions, positions_without_row(lens, 2), strict=True):
        whole = sum(row.thickness for row in at_position(lens, one).rows[:-1])
        rows = [row for k, row in enumerate(lens.rows) if k != 2]
        gaps = [row.thickness for row in rows]
        for k, gap in other.gaps:
            gaps[k] = gap
        assert sum(gaps[:-1]) == pytest.approx(whole)


def test_positions_that_move_nothing_any_more_are_gone():
    lens = small_zoom()
    front = Surface(thickness=2.0, semi_diameter=12.0)
    positions = tuple(Position(name=name, gaps=((0, gap),)) for name, gap in (("a", 1.0), ("b", 3.0)))
    project = zoom_project(zoom="b").replace(lens=lens.replace(rows=(front, *lens.rows), positions=positions))
    left = do(project, "remove_row", row=0)
    assert left.lens.positions == ()
    assert left.zoom is None
    resolve_project(left)


def test_a_plate_is_shown_without_scipy(tmp_path):
    from PIL import Image

    Image.fromarray(np.full((8, 12, 3), 100, np.uint8)).save(tmp_path / "plate.png")
    code = (
        "import sys; from flarewright.editor.preview.plate_view import plate_for; "
        "from flarewright.model import Backplate; plate_for(Backplate(image='plate.png'), (16, 16)); "
        "sys.exit('scipy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False).returncode == 0
