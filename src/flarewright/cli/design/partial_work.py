"""Finished parts of a search beside its output, from which the same command resumes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..common import print_remarks

if TYPE_CHECKING:
    from ...measure.core.checkpoint import Journal


@contextmanager
def partial_work(output: Path | None, inputs: Sequence[Any], part: str, parts: str) -> Iterator[Journal]:
    """Open the journal NAME.partial.json of an output; the end of the block removes it unless it is `unfinished`.

    Parameters
    ----------
    output : Path or None
        None: nothing is recorded.
    inputs : sequence
        Everything that determines the result; a journal of other inputs is discarded.
    part, parts : str
        Name of a finished part, for the remark on resuming.
    """
    from ...measure.core.checkpoint import Journal, journal
    from ...sentences import count

    if output is None:
        yield Journal()
        return
    path = output.with_suffix(".partial.json")
    with journal(path, hashlib.sha256(json.dumps(list(inputs)).encode()).hexdigest()) as steps:
        if steps.remembered:
            print_remarks([f"{path}: resuming after {count(steps.remembered, part, parts)} of an interrupted run"])
        yield steps
