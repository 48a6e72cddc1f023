"""Run a command in this process and judge its answer by the promises of docs/promises.md."""

from __future__ import annotations

import io
import json
import os
import resource
import signal
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr
from flarewright.model import Layer

from .compile_time import compile_time

# processor seconds after which an answer counts as missing
PATIENCE_S = 20.0
# longest sentence on an error, characters: the input is quoted to 120
LONGEST = 700
ERROR = "flarewright: error: "


class TooLongError(BaseException):
    """The command took more than `PATIENCE_S`; no handler for `Exception` may catch it."""


@contextmanager
def within(seconds: float = PATIENCE_S) -> Iterator[None]:
    """Raise `TooLongError` after this processor time, without what kernels take to compile."""
    compiled = compile_time()
    end_s = time.process_time() - compiled.seconds() + seconds

    def stop(*_: object) -> None:
        left_s = end_s - (time.process_time() - compiled.seconds())
        if left_s <= 0.0:
            raise TooLongError
        # the timer's grain
        signal.setitimer(signal.ITIMER_PROF, left_s + 0.01)

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def peak_mb() -> float:
    """Return the largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def judged(arguments: Sequence[str], folder: Path, *, endless: bool = False, keep: bool = False) -> tuple[bool, str]:
    """Run a command in a folder, and return whether its answer is right, and the answer.

    Parameters
    ----------
    arguments : sequence of str
    folder : Path
        The current folder while it runs.
    endless : bool
        The command may run until it is interrupted.
    keep : bool
        Keep the files that it writes.

    Returns
    -------
    bool
        An exit code of 0, with a strict JSON object if asked for and finite pictures; or of 2 with one short sentence,
        nothing on stdout but JSON, and no file.
    str
    """
    here, old = Path.cwd(), set(folder.rglob("*"))
    out, err = io.StringIO(), io.StringIO()
    state = os.environ.get("FLAREWRIGHT_STATE")
    os.environ["FLAREWRIGHT_STATE"] = str(folder / "state")
    os.chdir(folder)
    try:
        with redirect_stdout(out), redirect_stderr(err), within(2.0 if endless else PATIENCE_S):
            code = run(arguments)
    except TooLongError:
        return endless, f"more than {PATIENCE_S:g} CPU s"
    except SystemExit as end:
        return False, f"SystemExit {end.code}"
    except BaseException:
        return False, traceback.format_exc(limit=-3)
    finally:
        os.chdir(here)
        os.environ.pop("FLAREWRIGHT_STATE") if state is None else os.environ.update(FLAREWRIGHT_STATE=state)
    written = [path for path in folder.rglob("*") if path not in old and path.is_file()]
    sentences = err.getvalue().splitlines()
    if "Traceback" in err.getvalue():
        return False, "a traceback on stderr"
    if code == 2:
        errors = [line for line in sentences if line.startswith(ERROR)]
        if len(errors) != 1:
            return False, f"{len(errors)} errors on stderr: {err.getvalue()[:300]!r}"
        if len(errors[0]) > LONGEST:
            return False, f"a sentence of {len(errors[0])} characters: {errors[0][:200]!r}"
        if out.getvalue().strip() and not ("--json" in arguments and _strict(out.getvalue())):
            return False, f"an error, and on stdout {out.getvalue()[:80]!r}"
        # the folder of a long job may hold a checkpoint, and so may the file beside a long job's output
        left = [path.name for path in written if path.parent == folder and ".partial." not in path.name]
        if left:
            return False, f"an error, and the file {left[0]}"
        return True, errors[0].removeprefix(ERROR)
    if code != 0:
        return False, f"exit code {code}"
    if "--json" in arguments and not _strict(out.getvalue()):
        return False, f"no strict JSON: {out.getvalue()[:200]!r}"
    for path in written if not keep else ():
        if path.suffix == ".exr" and not all(_finite(layer) for layer in read_exr(path).layers):
            return False, f"{path.name} has pixels that are not finite"
        path.unlink()
    return True, "done"


def _finite(layer: Layer) -> bool:
    """Return whether all pixels are numbers; an infinite variance marks a pixel that no photograph shows."""
    wrong = np.isnan if layer.name.endswith("variance") else lambda pixels: ~np.isfinite(pixels)
    return not wrong(layer.pixels).any()


def _strict(text: str) -> bool:
    """Return whether a text is one JSON object without NaN and infinities."""
    try:
        return isinstance(json.loads(text, parse_constant=_refuse), dict)
    except ValueError:
        return False


def _refuse(name: str) -> float:
    raise ValueError(f"{name} in JSON")
