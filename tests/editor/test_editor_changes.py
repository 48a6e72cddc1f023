"""Changes of lens, zoom, look and time leave nothing behind that belongs to what was there before."""

import pytest

from flarewright.editor.commands.design_targets import direction, new_discs
from flarewright.editor.commands.registry import done
from flarewright.editor.session.input_notes import correction
from flarewright.errors import FlarewrightError
from flarewright.model import Design, GhostTarget, LightCurve, ProjectCurve, RowScatter, Scatter
from flarewright.render.scene.resolve import open_lens, resolve_project


def do(project, command, /, **values):
    return done(project, command, values)[0]


def test_another_lens_drops_rows_sensor_and_zoom_of_the_old_one(project):
    scatter = Scatter(model="abg", rows=(RowScatter(row=1, share=0.1),))
    curves = (
        ProjectCurve(of="zoom", at_s=(0.0, 1.0), values=(70.0, 100.0)),
        ProjectCurve(of="f_number", at_s=(0.0, 1.0), values=(1.2, 8.0)),
    )
    own = project.replace(scatter=scatter, curves=curves, camera=project.camera.replace(sensor_distance=33.0))
    other = do(own, "choose_lens", lens="tessar-brendel")
    assert other.scatter == Scatter(model="abg")
    (left,) = other.curves
    assert left.values == (open_lens("tessar-brendel").lens.f_number, 8.0)
    assert (
        resolve_project(other).order.sensor_distance
        == resolve_project(do(project, "choose_lens", lens="tessar-brendel")).order.sensor_distance
    )
    resolve_project(do(other, "go_to", at_s=0.0))


def test_an_anamorphic_lens_is_drawn_wide_as_when_it_is_opened(project):
    wide = do(project, "choose_lens", lens="anamorphic-heliar-2x")
    assert wide.camera.desqueeze
    assert not do(wide, "choose_lens", lens="tessar-brendel").camera.desqueeze
    # a project that keeps the squeezed picture keeps it with another anamorphic lens
    own = wide.replace(camera=wide.camera.replace(desqueeze=False))
    assert not do(own, "choose_lens", lens="anamorphic-heliar-2x").camera.desqueeze


def test_a_zoom_position_that_opens_less_stops_the_lens_down(project):
    lens = open_lens("canon-70-200").lens
    positions = tuple(
        each.replace(f_number=lens.f_number * (2.0 if k else 1.0)) for k, each in enumerate(lens.positions)
    )
    zoom = project.replace(lens=lens.replace(positions=positions), f_number=lens.f_number)
    long = do(zoom, "set_fields", values={"zoom": positions[-1].name})
    assert long.f_number == positions[-1].f_number
    with pytest.raises(FlarewrightError, match="no position"):
        do(zoom, "set_fields", values={"zoom": "none such"})


def test_a_lens_that_opens_less_wide_stops_the_project_down(project):
    values = {"f_number": project.f_number + 4.0}
    slow = do(project, "set_lens_facts", values=values)
    resolve_project(slow)
    assert slow.f_number == project.f_number + 4.0
    assert (
        correction("set_lens_facts", {"values": values}, slow)
        == "the picture is drawn at f/12: this lens opens no wider"
    )


def test_the_target_picture_has_new_ghosts_where_and_as_large_as_their_circles(project):
    x, y = direction(project)
    targets = (
        GhostTarget(place_mm=2.0, move_mm=1.0, radius_mm=-1.0, height=1.5),
        GhostTarget(at_mm=(4.0 * x - 3.0 * y, 4.0 * y + 3.0 * x), radius_mm=1.0),
        GhostTarget(place_mm=1.0, radius_mm=1.0, action="ignore"),
    )
    discs = new_discs(project.replace(design=Design(ghost_targets=targets)))
    assert discs == (pytest.approx((3.0 * x, 3.0 * y, 1.5)), pytest.approx((4.0 * x, 4.0 * y, 1.0)))


def test_curves_alone_move_the_project_in_time(project):
    light = project.lights[0].replace(curves=(LightCurve(of="intensity", at_s=(0.0, 2.0), values=(1.0, 3.0)),))
    moving = project.replace(lights=(light,))
    assert do(moving, "go_to", at_s=1.0).lights[0].intensity == 2.0


def test_an_abbe_number_of_zero_is_refused_in_words(project):
    with pytest.raises(FlarewrightError, match=r"row 0: Abbe number V_d must be more than 5, not 0"):
        do(project, "set_cell", row=0, column="v_d", text="0")
