"""Finished parts of a command beside its output, or in the state folder, from which the same command resumes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import OutputError
from .common import print_remark

if TYPE_CHECKING:
    from ..measure.core.checkpoint import Journal


@contextmanager
def partial_work(output: Path | None, inputs: Sequence[Any], part: str, parts: str) -> Iterator[Journal]:
    """Open the journal NAME.partial.json of an output; the end of the block removes it unless it is `unfinished`.

    Parameters
    ----------
    output : Path or None
        None: the journal lies in the state folder, and a folder that cannot be written costs one sentence.
    inputs : sequence
        Everything that determines the result; a journal of other inputs is discarded.
    part, parts : str
        Name of a finished part, for the remark on resuming.
    """
    from ..measure.core.checkpoint import Journal, journal
    from ..sentences import count
    from ..workflow.kept_work.unnamed_work import unnamed_file

    text = json.dumps(list(inputs))
    path = unnamed_file(text, ".json") if output is None else output.with_suffix(".partial.json")
    with ExitStack() as stack:
        try:
            steps = stack.enter_context(journal(path, hashlib.sha256(text.encode()).hexdigest(), print_remark))
        except OutputError as error:
            if output is not None:
                raise
            print_remark(f"no checkpoint: {error}")
            steps = Journal()
        if steps.remembered:
            print_remark(f"{path}: resuming after {count(steps.remembered, part, parts)} of an interrupted run")
        yield steps
