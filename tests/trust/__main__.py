"""Run the rig: `python -m tests.trust --minutes N [KIND...]`.

Each kind of hostile input runs in turn in a worker process, with the next seed each time. The rig reports every input
on which a promise was broken, and a table of all. It exits with 1 if one was broken.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable

from .kinds import KINDS, SLOW
from .worker import Tried, Worker

WARM_MINUTES = 5.0
"""From this length on all kernels are compiled first, so that the limits of time judge the work itself."""


def rig(kinds: list[str], minutes: float, seed: int, report: Callable[[str], None]) -> list[tuple[str, Tried]]:
    """Run kinds in turn until the time is over; report broken promises at once.

    Parameters
    ----------
    kinds : list of str
        Keys of `KINDS`.
    minutes : float
    seed : int
        The first seed of every kind.
    report : callable
        Receives a line for each broken promise.

    Returns
    -------
    list of (str, Tried)
    """
    end, worker, done = time.monotonic() + 60.0 * minutes, Worker(), []
    spent = dict.fromkeys(kinds, 0.0)
    number = dict.fromkeys(kinds, seed)
    while spent and time.monotonic() < end:
        # the kind with the least time so far: slow kinds do not crowd out quick ones
        kind = min(spent, key=lambda each: spent[each])
        start = time.monotonic()
        tried = worker.run(kind, number[kind])
        done.append((kind, tried))
        if not tried.verdict.held:
            report(f"BROKEN {kind}, seed {number[kind]}: {tried.verdict.subject}: {tried.verdict.remark}")
        number[kind] += 1
        spent[kind] += time.monotonic() - start
        if tried.verdict.skipped:
            # the next input would lack the same
            del spent[kind]
    worker.stop()
    return done


def table(done: list[tuple[str, Tried]]) -> str:
    """Return one line per kind: inputs, broken promises, longest time, largest memory, and why inputs were skipped."""
    lines = [f"{'kind':16} {'inputs':>7} {'broken':>7} {'longest':>10} {'memory':>10}"]
    for kind in dict.fromkeys(kind for kind, _ in done):
        of = [tried for each, tried in done if each == kind]
        broken = sum(not tried.verdict.held for tried in of)
        longest, peak = max(tried.cpu_s for tried in of), max(tried.peak_mb for tried in of)
        skipped = [tried.verdict.remark for tried in of if tried.verdict.skipped]
        number = len(of) - len(skipped)
        lines.append(
            f"{kind:16} {number:7} {broken:7} {longest:6.1f} CPU s {peak:6.0f} MB  {'; '.join(skipped)}".rstrip()
        )
    return "\n".join(lines)


def main() -> int:
    """Parse the arguments, run the rig and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.trust", description=__doc__)
    parser.add_argument("kinds", nargs="*", help=f"kinds of input (default: all): {', '.join(KINDS)}")
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0, help="first seed of every kind (default: 0)")
    given = parser.parse_args()
    unknown = set(given.kinds) - set(KINDS)
    if unknown:
        parser.error(f"no kind {', '.join(sorted(unknown))}; choose from {', '.join(KINDS)}")
    default = [kind for kind in KINDS if given.minutes >= SLOW.get(kind, 0.0)]
    if given.minutes >= WARM_MINUTES:
        subprocess.run([sys.executable, "-m", "flarewright", "warm-up"], check=True, stdout=subprocess.DEVNULL)
    done = rig(given.kinds or default, given.minutes, given.seed, lambda line: print(line, flush=True))
    print(table(done))
    return 1 if any(not tried.verdict.held for _, tried in done) else 0


if __name__ == "__main__":
    sys.exit(main())
