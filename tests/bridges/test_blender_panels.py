"""What the panels draw, with a layout that only writes down: a module of Blender has no window."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")

from blender_objects import camera, lamp, plane  # noqa: E402

pytestmark = pytest.mark.blender


class Layout:
    """Takes what a panel draws, and looks it up in Blender."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties
        self.drawn.append(name)

    def operator(self, name, **_):
        module, function = name.split(".")
        assert getattr(getattr(bpy.ops, module), function).get_rna_type() is not None
        self.drawn.append(name)

    def label(self, text, **_):
        self.drawn.append(text)

    def row(self):
        return Layout(self.drawn)


def drawn(panel, context):
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout), context)
    return layout.drawn


def test_the_panel_of_a_scene_shows_every_setting_and_command(registered, scene):
    shown = drawn(registered.panels.FlarewrightPanel, bpy.context)
    settings = set(registered.panels.FlarewrightSettings.bl_rna.properties.keys()) - {"rna_type", "name"}
    assert settings <= set(shown)
    assert {"flarewright.render", "flarewright.export", "flarewright.copy_command", "flarewright.composite"} <= {*shown}


def test_while_a_job_runs_the_panel_shows_its_progress_and_no_second_one_begins(registered, scene, monkeypatch):
    job = registered.job.Job(iter(()))
    job.words = "flare of 1 of 9 frames"
    monkeypatch.setattr(registered.panels._State, "job", job)
    shown = drawn(registered.panels.FlarewrightPanel, bpy.context)
    assert job.words in shown
    assert "flarewright.cancel" in shown
    assert "flarewright.render" not in shown
    assert not bpy.ops.flarewright.render.poll()
    assert bpy.ops.flarewright.cancel() == {"FINISHED"}
    assert job._stopped


def test_a_lens_of_another_focal_length_than_the_camera_is_noted(registered, scene, monkeypatch):
    monkeypatch.setattr(registered.panels._State, "lenses", {"long": 200.0, "like": 55.0})
    camera(scene, lens=50.0)
    scene.flarewright.lens = "long"
    note = "the lens has 200 mm, the camera 50 mm"
    assert note in drawn(registered.panels.FlarewrightPanel, bpy.context)
    for name in ("like", "unknown"):
        scene.flarewright.lens = name
        assert not any("the camera" in str(each) for each in drawn(registered.panels.FlarewrightPanel, bpy.context))


def test_the_panel_of_an_object_shows_what_counts_for_its_kind(registered, scene):
    def shown(item):
        return drawn(registered.panels.FlarewrightObjectPanel, SimpleNamespace(object=item))

    assert shown(lamp(scene, "POINT")) == ["ignored"]
    panel = plane(scene)
    assert shown(panel) == ["passes", "glows"]
    panel.flarewright.glows = True
    assert shown(panel) == ["passes", "glows", "radiance", "colour"]


class Operator(SimpleNamespace):
    """Stands for an operator with a window: its timer, and what it reports."""

    def report(self, kinds, text):
        self.said.append((*kinds, text))


def window():
    """Return a context with a window that has a timer."""
    timers = []
    manager = SimpleNamespace(
        event_timer_add=lambda step, window: timers.append(step) or "timer",
        event_timer_remove=lambda timer: timers.clear(),
        modal_handler_add=lambda operator: None,
    )
    return SimpleNamespace(window_manager=manager, window=None, screen=None), timers


def started(registered, work):
    steps = registered.panels._Steps
    operator = Operator(said=[], work=lambda context: work)
    operator._result = lambda job: steps._result(operator, job)
    context, timers = window()
    assert steps.invoke(operator, context, None) == {"RUNNING_MODAL"}
    assert timers == [0.1]

    def event(kind):
        return steps.modal(operator, context, SimpleNamespace(type=kind))

    return operator, event, timers


def test_work_beside_the_window_takes_steps_with_the_timer_and_ends(registered, scene):
    def work():
        yield "waits"
        yield "waits"
        return ["done"]

    operator, event, timers = started(registered, work())
    assert event("MOUSEMOVE") == {"PASS_THROUGH"}
    assert registered.panels._State.job.words == ""
    results = [event("TIMER"), event("TIMER")]
    assert results == [{"PASS_THROUGH"}, {"FINISHED"}]
    assert operator.said == [("INFO", "done")]
    assert timers == []
    assert registered.panels._State.job is None


def test_escape_stops_the_work_and_so_does_another_file(registered, scene):
    closed = []

    def work():
        try:
            while True:
                yield "waits"
        finally:
            closed.append(True)

    operator, event, timers = started(registered, work())
    assert event("TIMER") == {"PASS_THROUGH"}
    assert event("ESC") == {"CANCELLED"}
    assert operator.said == [("WARNING", "Flarewright was cancelled; finished frames are kept")]
    assert (closed, timers) == ([True], [])
    operator, event, _ = started(registered, work())
    event("TIMER")
    registered.panels._Steps.cancel(operator, None)
    assert closed == [True, True]
    assert registered.panels._State.job is None


def test_a_bug_in_the_work_leaves_no_timer_and_no_job(registered, scene):
    def work():
        yield "begins"
        raise ValueError("a bug")

    _, event, timers = started(registered, work())
    with pytest.raises(ValueError, match="a bug"):
        event("TIMER")
    assert timers == []
    assert registered.panels._State.job is None
