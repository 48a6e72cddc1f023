"""Little memory and a full disk: one sentence and no file; the rig runs more."""

import pytest

pytest.importorskip("resource", reason="limits of a process need a POSIX system")

from .limited_machine import disk, memory

# a picture whose bytes the library writes as it closes the file, ignoring errors: it was empty, with exit code 0
EMPTY = 9002
# commands without pictures, with 256 kB, nothing and 1 kB left
SEEDS = (0, 4, 5)


def test_a_full_disk_gets_a_sentence_and_no_file():
    verdicts = list(map(disk, (*SEEDS, EMPTY)))
    assert [verdict for verdict in verdicts if not verdict.held] == []
    if not verdicts[0].skipped:
        assert any("no space left on device" in verdict.remark.lower() for verdict in verdicts)


@pytest.mark.slow
def test_little_memory_gets_a_sentence_and_no_file():
    verdicts = list(map(memory, range(8)))
    assert [verdict for verdict in verdicts if not verdict.held] == []
    assert any("not enough memory" in verdict.remark or "needs" in verdict.remark for verdict in verdicts)
