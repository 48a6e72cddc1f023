"""The words for frames."""

from __future__ import annotations

import pytest

from flarewright.errors import ProjectError
from flarewright.jobs.frame_list import FramePattern, chunk_of, frames_text, parse_chunk, parse_frames


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("7", (7,)),
        ("1001-1004", (1001, 1002, 1003, 1004)),
        ("1-10x3", (1, 4, 7, 10)),
        ("9-12, 1,5 ,10", (1, 5, 9, 10, 11, 12)),
        ("-2-1", (-2, -1, 0, 1)),
        ("-4--2", (-4, -3, -2)),
    ],
)
def test_ranges(text, frames):
    assert parse_frames(text) == frames
    assert parse_frames(frames_text(frames)) == frames


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "neither a frame nor a range"),
        ("1-", "neither"),
        ("1..4", "neither"),
        ("5-1", "write 1-5"),
        ("1-5x0", "the step is 0"),
        ("1-999999999", "more than 1000000"),
    ],
)
def test_wrong_ranges(text, said):
    with pytest.raises(ProjectError, match=said):
        parse_frames(text)


@pytest.mark.parametrize(
    ("pattern", "frame", "name"),
    [
        ("a/flare.####.exr", 12, "flare.0012.exr"),
        ("flare.%04d.exr", 12, "flare.0012.exr"),
        ("flare.%d.exr", 12, "flare.12.exr"),
        ("flare.$F4.exr", 12, "flare.0012.exr"),
        ("flare_$F.exr", 12, "flare_12.exr"),
        ("f#.exr", 1001, "f1001.exr"),
        ("flare.####.exr", -3, "flare.-003.exr"),
    ],
)
def test_patterns(pattern, frame, name):
    assert FramePattern(pattern).path(frame).name == name
    FramePattern(pattern).check((1, 2))


def test_wrong_patterns():
    with pytest.raises(ProjectError, match="2 places"):
        FramePattern("a.##.##.exr")
    with pytest.raises(ProjectError, match="not its folder"):
        FramePattern("a####/b.exr")
    with pytest.raises(ProjectError, match=r"all 3 frames would go to a\.exr; write a\.####\.exr"):
        FramePattern("a.exr").check((1, 2, 3))
    FramePattern("a.exr").check((1,))


def test_chunks_are_the_list_in_equal_parts():
    items = tuple(range(17))
    parts = [chunk_of(items, k, 5) for k in range(1, 6)]
    assert sum(parts, ()) == items
    assert {len(part) for part in parts} == {3, 4}
    assert parse_chunk(" 2/5 ") == (2, 5)
    for text in ("3/2", "0/2", "a", "1/0", "1.5/2"):
        with pytest.raises(ProjectError, match="chunk"):
            parse_chunk(text)
