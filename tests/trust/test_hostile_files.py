"""Damaged files and hostile fields: the rig tries thousands, this test that it can, and a few."""

import pytest

pytest.importorskip("resource", reason="limits of a process need a POSIX system")

from .answers import judged
from .hostile_fields import cases, fields, run_case
from .hostile_files import READERS, damaged, prepared_files, run


def test_every_reader_accepts_its_file_undamaged(tmp_path):
    """A file that is refused anyway would test nothing; the slow readers are left to the rig."""
    for name, command in READERS:
        if command[0] in ("lens", "project", "scene", "looks") or command[1] in ("check", "replay"):
            assert judged(command, prepared_files(tmp_path / f"{READERS.index((name, command))}")) == (True, "done"), (
                command
            )


def test_damage_depends_on_the_seed_alone():
    import random

    data = bytes(range(256)) * 4
    assert damaged(data, random.Random(3)) == damaged(data, random.Random(3)) != data


@pytest.mark.parametrize("seed", [0, 2, 4, 6, 19])
def test_a_damaged_file_gets_a_sentence_or_is_read(seed):
    verdict = run(seed)
    assert verdict.held, verdict


def test_every_numeric_field_is_found():
    shot, scene = set(fields("shot.toml")), set(fields("match.toml"))
    assert {("f_number",), ("lights", "[1]", "field_deg", "[2]"), ("iris", "rounding")} <= shot
    assert ("cameras", "[1]", "position_m", "[3]") in scene
    assert len(cases()) > 4000


@pytest.mark.parametrize(
    "case",
    [("shot.toml", ("f_number",), "nan"), ("match.toml", ("north_deg",), "1e308")],
    ids=lambda case: ".".join(case[1]),
)
def test_a_hostile_field_gets_a_sentence_or_is_read(case):
    verdict = run_case(*case)
    assert verdict.held, verdict
