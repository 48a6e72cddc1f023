"""Hostile values of options: the rig tries all of them, this test a few of every command."""

import pytest

pytest.importorskip("resource", reason="limits of a process need a POSIX system")

from .commands import ARGUMENTS, LEFT_OUT, commands
from .hostile_flags import cases, run_case


def test_every_command_has_arguments_for_the_rig():
    assert {name for name, _ in commands()} == set(ARGUMENTS) | LEFT_OUT


def test_every_number_of_a_command_is_tried():
    flags = {(command, flag) for command, flag, value in cases() if value == "nan"}
    assert {("render", "--rounding"), ("predict", "--tolerance"), ("design solve", "--time")} <= flags
    assert len(flags) > 100


@pytest.mark.parametrize(
    "case",
    [
        ("render", "--rounding", "nan"),
        ("render", "--size", "1e308x1e308"),
        ("ghosts", "--wavelength", "inf"),
        *(
            pytest.param(case, marks=pytest.mark.slow)
            for case in (
                ("lens show", "--light", "nan,nan"),
                ("measure replay", "--roll", "1e308"),
                ("measure explain", "--light", "1e999"),
                ("design identify", "--fstop", "-1"),
            )
        ),
        # a sentence of 5116 characters, and a traceback
        ("measure fit", "--by", "x" * 5000),
        ("looks save", "--name", "x" * 5000),
        # a traceback, and a file left beside the error
        ("shot", "--white", "1e30"),
        ("shot", "--threshold", "1e30"),
        # a core of the starburst that no pixel can be split into was an OverflowError
        ("shot", "--starburst-size", "1e-308"),
        # these were noticed after merging, with its result on stdout
        ("measure run", "--every", "4294967296"),
        ("measure run", "--corrections", "x" * 5000),
    ],
    ids=" ".join,
)
def test_a_hostile_value_gets_a_sentence_or_a_picture(case):
    verdict = run_case(case)
    assert verdict.held, verdict
