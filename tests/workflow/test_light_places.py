"""Lights in pixels over time: a track lands on its pixels in every frame, whatever moves."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright import Camera, Light, Project, Timeline
from flarewright.errors import ProjectError
from flarewright.io.tracks.track import Track, TrackFile
from flarewright.model import ProjectCurve, Rgb
from flarewright.render.scene.pixel_place import direct_images, image_px
from flarewright.render.scene.resolve import resolve_project
from flarewright.workflow.keyframes import project_at, still, time_of
from flarewright.workflow.light_places import (
    assigned,
    lights_at_pixels,
    resting_tracks,
    timeline_of_tracks,
    with_tracks,
)

SIZE = (640, 360)
FRAMES = np.arange(1001.0, 1025.0)
PATH = np.column_stack([320 + 200 * np.sin(np.arange(24) / 6.0), 180 + 60 * np.cos(np.arange(24) / 5.0)])


def project(lens="heliar-tronnier", **settings):
    return Project(
        lens=lens,
        lights=[Light(field_deg=(0, 0))],
        camera=Camera(size_px=SIZE),
        timeline=Timeline(start=1001),
        **settings,
    )


def shown(moved, frame, light=0):
    """Return the pixel at which a frame draws a light."""
    moment = still(project_at(moved, time_of(frame, moved.timeline)))
    settled = resolve_project(moment)
    return image_px(direct_images(settled, moment.lights[light]), moment.lights[light].field_deg)


def test_a_track_of_24_frames_lands_within_a_tenth_of_a_pixel_in_each():
    moved, remarks = with_tracks(project(), [(0, Track("sun", FRAMES, PATH))])
    assert len(moved.lights[0].keyframes) == 24
    assert remarks == ["track 'sun' moves light 0 (counted from 0) in frames 1001 to 1024"]
    for frame, place in zip(FRAMES, PATH, strict=True):
        assert np.hypot(*(np.array(shown(moved, frame)) - place)) < 0.1


def test_missing_frames_of_a_track_and_those_outside_it_are_named():
    """Of tracks without most of their frames, and of the shorter of two tracks, no remark stated them."""

    def words(*tracks, **settings):
        frames = [np.array(each, dtype=np.float64) for each in tracks]
        moves = [(k, Track(f"t{k}", each, np.tile((640.0, 360.0), (len(each), 1)))) for k, each in enumerate(frames)]
        lights = [Light(field_deg=(0, 0))] * len(tracks)
        return "\n".join(with_tracks(project(**settings).replace(lights=lights), moves)[1])

    assert "track 't0' has no frames 1003-1004, 1006-1007: straight" in words([1001, 1002, 1005, 1008])
    assert "track 't0' has no frames 1002-1003: straight" in words([1001, 1004])
    assert "track 't0' has one frame in 2: straight" in words([1001, 1003, 1005])
    both = words([1001, 1002, 1003, 1004], [1002, 1003])
    assert both.endswith("track 't1': before frame 1002 and after frame 1003 the light rests")
    zoom = ProjectCurve(of="zoom", at_s=(0.0, 4 / 24), values=(80.0, 140.0))
    said = words([1001, 1002], lens="canon-70-200", curves=(zoom,))
    assert "after frame 1002 the light rests at its field angles, so its pixel moves with the lens" in said


def test_a_track_with_the_rate_of_the_shot_in_other_digits_has_no_remark():
    tracks = (Track("sun", FRAMES, PATH),)
    found, remarks = timeline_of_tracks(
        project().replace(timeline=Timeline(fps=23.976, start=1001)), [TrackFile(tracks, "blender", 23.98)]
    )
    assert (found.timeline.fps, remarks) == (23.976, [])


def test_the_lens_of_each_frame_places_the_light_of_a_zoom():
    zoom = ProjectCurve(of="zoom", at_s=(0.0, 4 / 24), values=(80.0, 140.0))
    moved, _ = with_tracks(project("canon-70-200", curves=(zoom,)), [(0, Track("sun", FRAMES[:5:2], PATH[:5:2]))])
    for frame, place in zip(FRAMES[:5:2], PATH[:5:2], strict=True):
        assert np.hypot(*(np.array(shown(moved, frame)) - place)) < 0.1
    resting = project("canon-70-200", curves=(zoom,))
    ((index, track),) = resting_tracks(resting, {0: (500.0, 100.0)})
    held, _ = with_tracks(resting, [(index, track)])
    assert [shown(held, frame) for frame in (1001, 1004)] == [pytest.approx((500.0, 100.0), abs=0.05)] * 2
    assert resting_tracks(project(), {0: (500.0, 100.0)}) == []


def test_sizes_corners_and_overscan():
    """A track from the bottom left of a picture twice as large, and a picture with overscan."""
    big = Track("a", FRAMES[:1], np.array([[1000.0, 720.0 - 200.0]]), "bottom-left", (1280.0, 720.0))
    plain = project()
    moved, remarks = with_tracks(plain, [(0, big)])
    assert shown(moved, 1001) == pytest.approx((500.0, 100.0), abs=0.05)
    assert "places in 1280x720 pixels are scaled to 640x360" in remarks[1]
    camera = Camera(size_px=(704, 424), sensor_mm=(36.0 * 704 / 640, 20.25 * 424 / 360))
    wide = plain.replace(camera=camera)
    for found in (
        lights_at_pixels(wide, {0: (500.0, 100.0)}, SIZE),
        with_tracks(wide, [(0, big)], counted_px=SIZE)[0],
    ):
        assert found.lights[0].field_deg == pytest.approx(moved.lights[0].field_deg, abs=1e-3)


def test_intensity_colour_gaps_and_frames_behind_the_camera():
    frames = np.array([1001.0, 1002.0, 1005.0, 1006.0])
    track = Track(
        "lamp", frames, PATH[:4], intensity=np.array([1.0, 2.0, 3.0, 4.0]), rgb=np.array([[1.0, 0.5, 0.25]] * 4),
        hidden=np.array([False, False, True, False]), diameter_deg=0.5,
    )  # fmt: skip
    moved, remarks = with_tracks(project(), [(0, track)])
    (light,) = moved.lights
    assert [key.at_s for key in light.keyframes] == pytest.approx([0.0, 1 / 24, 5 / 24])
    assert {curve.of: curve.values for curve in light.curves}["intensity"] == (1.0, 2.0, 0.0, 4.0)
    assert project_at(moved, 0.0).lights[0].spectrum == Rgb(rgb=(1.0, 0.5, 0.25))
    assert light.diameter_deg == 0.5
    assert "has no frames 1003-1004" in remarks[1]
    kept, _ = with_tracks(project(), [(0, track)], keep=frozenset({"intensity", "rgb"}))
    assert {curve.of: curve.values for curve in kept.lights[0].curves} == {"intensity": (1.0, 1.0, 0.0, 1.0)}


def test_a_light_of_a_scene_beyond_the_field_keeps_its_direction():
    far = np.array([[5000.0, 180.0]])
    track = Track("sun", FRAMES[:1], far, directions=np.array([[np.tan(np.radians(60.0)), 0.0]]))
    moved, remarks = with_tracks(project("canon-28-80"), [(0, track)])
    assert moved.lights[0].field_deg == pytest.approx((60.0, 0.0))
    assert "1 frames lie beyond the field" in remarks[-1]
    with pytest.raises(ProjectError, match=r"track 'sun', frame 1001: .* no direct image at 5000,180"):
        with_tracks(project("canon-28-80"), [(0, Track("sun", FRAMES[:1], far))])


def test_the_timeline_begins_with_the_tracks_of_a_project_that_rests():
    file = TrackFile((Track("a", FRAMES, PATH),), "csv", fps=25.0)
    found, remarks = timeline_of_tracks(project().replace(timeline=Timeline()), [file])
    assert (found.timeline.start, found.timeline.fps, len(remarks)) == (1001, 25.0, 2)
    kept, remarks = timeline_of_tracks(project(), [file], fps_given=True, start_given=True)
    assert (kept.timeline, len(remarks)) == (Timeline(start=1001), 1)
    later = TrackFile((Track("a", FRAMES + 5.0, PATH),), "csv", fps=30.0)
    assert timeline_of_tracks(project(), [later])[0].timeline == Timeline(start=1001, fps=30.0)
    several, remarks = timeline_of_tracks(project(), [file, later])
    assert (several.timeline, "have 25, 30 frames per second" in remarks[0]) == (Timeline(start=1001), True)
    with pytest.raises(ProjectError, match="begins at frame 1001, before frame 1100 at 0 s; give --start 1001"):
        with_tracks(project().replace(timeline=Timeline(start=1100)), [(0, file.tracks[0])])


@pytest.mark.parametrize(
    ("names", "wanted", "lights", "found"),
    [
        (["a"], [None], [], (0,)),
        (["a", "b"], [None, None], ["light"], (0, 1)),
        (["sun", "b"], [None, None], ["light", "Sun"], (1, 0)),
        (["a", "b"], ["new", None], ["light"], (1, 0)),
        (["a", "b"], [1, "lamp"], ["lamp", "x"], (1, 0)),
        (["a", "b"], [None, None], ["light", "light"], (0, 1)),
    ],
)
def test_which_light_a_track_moves(names, wanted, lights, found):
    assert assigned(names, wanted, lights) == found


@pytest.mark.parametrize(
    ("names", "wanted", "said"),
    [
        (["a"], [2], "there is no light 2: the lights are 0 to 1"),
        (["a"], ["moon"], "no light has the name 'moon'"),
        (["a", "b"], [0, 0], "two tracks move light 0"),
    ],
)
def test_a_light_that_does_not_exist_is_reported(names, wanted, said):
    with pytest.raises(ProjectError, match=said):
        assigned(names, wanted, ["sun", "lamp"])
