"""Seeded faults: small wrong edits of the source, and whether the tests catch them (docs/seeded-faults.md).

    python tools/seeded_faults.py check
    python tools/seeded_faults.py run --results after.json
    python tools/seeded_faults.py table before.json after.json

Each fault replaces one piece of text in one source file of a copy of the checkout. A fault is caught when a test fails
or times out there. The checkout itself does not change.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = Path(__file__).with_suffix(".toml")
SOURCES = Path("src") / "flarewright"
KERNELS = SOURCES / "kernels"

KINDS = ("sign", "factor", "index", "channel", "clip", "layer", "range", "condition", "unit")

TIMEOUT_S = 1200
"""Time limit for the named tests of one fault; a timeout counts as caught."""

SUITE_TIMEOUT_S = 5400
"""Time limit for the whole suite."""


@dataclass(frozen=True)
class Fault:
    """One wrong edit.

    Attributes
    ----------
    id : str
        Short, unique, the area first.
    kind : str
        One of `KINDS`.
    file : str
        Source file, relative to the root of the checkout. A moved file is found by its text.
    before, after : str
        The correct text, which occurs exactly once in the file, and the wrong one.
    effect : str
        The wrong result.
    tests : tuple of str
        Test files that most likely catch it; they run first.
    """

    id: str
    kind: str
    file: str
    before: str
    after: str
    effect: str
    tests: tuple[str, ...]

    @property
    def area(self) -> str:
        """The package of the source file."""
        return self.file.split("/")[2]


@dataclass(frozen=True)
class Verdict:
    """Result of a fault: whether it was caught, by which test, and after how many seconds."""

    caught: bool
    by: str
    seconds: float


Keep = Callable[[dict[str, Verdict]], None]
"""Callback that stores new verdicts."""


def read_faults(path: Path = SAMPLE) -> list[Fault]:
    """Read the list of faults.

    Raises
    ------
    SystemExit
        When two faults share an id, or one has an unknown kind.
    """
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["fault"]
    faults = [Fault(**{**row, "tests": tuple(row["tests"])}) for row in rows]
    repeated = [name for name, times in Counter(fault.id for fault in faults).items() if times > 1]
    unknown = [fault.id for fault in faults if fault.kind not in KINDS]
    if repeated or unknown:
        sys.exit(f"{path.name}: ids used twice: {repeated}; of unknown kind: {unknown}")
    return faults


def locate(fault: Fault, root: Path) -> Path:
    """Return the file that contains a fault's text exactly once.

    Raises
    ------
    LookupError
        When no file, or more than one, contains it.
    """
    named = root / fault.file
    if named.is_file() and named.read_text(encoding="utf-8").count(fault.before) == 1:
        return named
    counts = {path: path.read_text(encoding="utf-8").count(fault.before) for path in (root / SOURCES).rglob("*.py")}
    holders = [path for path, count in counts.items() if count]
    if len(holders) != 1 or counts[holders[0]] != 1:
        raise LookupError(f"{fault.id}: its text occurs in {len(holders)} files; update it in {SAMPLE.name}")
    return holders[0]


def problems(faults: Iterable[Fault], root: Path) -> list[str]:
    """Return what prevents seeding: missing text, wrong text that is not valid Python, missing tests."""
    found = []
    for fault in faults:
        try:
            path = locate(fault, root)
            ast.parse(path.read_text(encoding="utf-8").replace(fault.before, fault.after))
        except (LookupError, SyntaxError) as error:
            found.append(str(error))
        if fault.before == fault.after:
            found.append(f"{fault.id}: both texts are the same")
        found += [f"{fault.id}: there is no {test}" for test in fault.tests if not (root / test).is_file()]
    return found


class Copy:
    """A copy of the checkout for seeding faults, with a cache of the kernels compiled from the correct sources."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.tree = folder / "checkout"
        self.cache = folder / "kernels"
        # tests that fail without any fault; they are ignored
        self.broken: list[str] = []
        listed = ["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", "-z"]
        for name in filter(None, subprocess.check_output(listed).decode().split("\0")):
            if (root / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.tree / name)
        # some tests read the shared/ folder next to the checkout
        if (root.parent / "shared").is_dir():
            (folder / "shared").symlink_to(root.parent / "shared")

    @contextmanager
    def seeded(self, faults: Sequence[Fault]) -> Iterator[Path]:
        """Seed faults into the copy; yields the kernel cache to use, and restores the copy afterwards."""
        kept = {path: (path.read_bytes(), path.stat()) for path in {locate(fault, self.tree) for fault in faults}}
        cache = self.cache
        try:
            for count, fault in enumerate(faults, 1):
                path = locate(fault, self.tree)
                text = path.read_text(encoding="utf-8").replace(fault.before, fault.after)
                path.write_text(text, encoding="utf-8")
                # Python detects changed sources by whole seconds
                os.utime(path, (time.time() + count, time.time() + count))
                if KERNELS in path.relative_to(self.tree).parents:
                    cache = self.cache.with_name("kernels-with-fault")
            yield cache
        finally:
            for path, (content, status) in kept.items():
                path.write_bytes(content)
                os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
            shutil.rmtree(self.cache.with_name("kernels-with-fault"), ignore_errors=True)

    def failing(self, faults: Sequence[Fault], words: Sequence[str], timeout: float) -> list[str]:
        """Return the tests that fail with some faults in the copy; a timeout is "no end"."""
        results = self.tree.parent / "pytest-cache"
        shutil.rmtree(results, ignore_errors=True)
        command = [sys.executable, "-m", "pytest", "--tb=no", "-o", f"cache_dir={results}", *words]
        command += [word for test in self.broken for word in ("--deselect", test)]
        with self.seeded(faults) as cache:
            environment = {**os.environ, "PYTHONPATH": str(self.tree / "src"), "NUMBA_CACHE_DIR": str(cache)}
            # without bytecode each process would compile all sources
            environment.pop("PYTHONDONTWRITEBYTECODE", None)
            environment.pop("FLAREWRIGHT_CORPUS", None)
            try:
                ended = subprocess.run(
                    command, cwd=self.tree, env=environment, timeout=timeout, check=False, capture_output=True
                )
            except subprocess.TimeoutExpired:
                return ["no end"]
        if ended.returncode == 0:
            return []
        failed = results / "v" / "cache" / "lastfailed"
        return list(json.loads(failed.read_text())) if failed.is_file() else [f"pytest ended with {ended.returncode}"]


def by_named_tests(faults: Sequence[Fault], copies: Sequence[Copy], keep: Keep) -> None:
    """Run the named tests of each fault, one process per copy."""
    waiting: queue.SimpleQueue[Fault] = queue.SimpleQueue()
    for fault in faults:
        waiting.put(fault)
    done = 0

    def work(copy: Copy) -> None:
        nonlocal done
        while True:
            try:
                fault = waiting.get_nowait()
            except queue.Empty:
                return
            started = time.perf_counter()
            failed = copy.failing([fault], ["-n", "0", "-x", *fault.tests], TIMEOUT_S)
            verdict = Verdict(bool(failed), failed[0] if failed else "", round(time.perf_counter() - started, 1))
            keep({fault.id: verdict})
            done += 1
            word = f"caught by {verdict.by}" if verdict.caught else "not caught by its tests"
            print(f"[{done}/{len(faults)}] {fault.id}: {word} ({verdict.seconds} s)", flush=True)

    workers = [threading.Thread(target=work, args=(copy,)) for copy in copies]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


def by_whole_suite(faults: Sequence[Fault], copy: Copy, keep: Keep) -> None:
    """Run all fast tests with many faults at once, then the failing tests with each fault alone."""
    failed = copy.failing(faults, [], SUITE_TIMEOUT_S)
    print(f"all fast tests with {len(faults)} faults at once: {len(failed)} fail", flush=True)
    for fault in faults if failed else ():
        started = time.perf_counter()
        alone = copy.failing([fault], ["-n", "0", "-x", *failed], TIMEOUT_S)
        if alone:
            keep({fault.id: Verdict(True, alone[0], round(time.perf_counter() - started, 1))})
            print(f"  {fault.id}: caught by {alone[0]}", flush=True)


def run(options: argparse.Namespace) -> int:
    """Seed faults, and write the verdicts after each of them."""
    faults = [fault for fault in read_faults(options.sample) if not options.only or fault.id in options.only]
    if found := problems(faults, options.checkout):
        print(*found, sep="\n", file=sys.stderr)
        return 2
    verdicts: dict[str, Verdict] = {}
    if options.resume and options.results.is_file():
        verdicts = {name: Verdict(**one) for name, one in json.loads(options.results.read_text()).items()}

    def keep(more: dict[str, Verdict]) -> None:
        verdicts.update(more)
        rows = {name: asdict(one) for name, one in sorted(verdicts.items())}
        options.results.write_text(json.dumps(rows, indent=1) + "\n")

    with tempfile.TemporaryDirectory(prefix="seeded-faults-") as folder:
        copies = [Copy(options.checkout, Path(folder) / str(number)) for number in range(options.jobs)]
        broken = options.ignored
        if broken is None:
            broken = copies[0].failing([], [], SUITE_TIMEOUT_S)
            print(f"ignored, because they fail without any fault: {' '.join(broken) or 'none'}", flush=True)
        for copy in copies:
            copy.broken = broken
        by_named_tests([fault for fault in faults if fault.id not in verdicts], copies, keep)
        if not options.named_only:
            by_whole_suite([fault for fault in faults if not verdicts[fault.id].caught], copies[0], keep)
    caught = sum(verdicts[fault.id].caught for fault in faults)
    print(f"{caught} of {len(faults)} faults caught; written to {options.results}")
    return 0


def table(options: argparse.Namespace) -> int:
    """Print one or more results as Markdown tables by area and by kind, and each fault that one of them missed."""
    faults = read_faults(options.sample)
    runs = [json.loads(path.read_text()) for path in options.results]
    heads = [path.stem for path in options.results]

    def row(name: str, members: list[Fault]) -> str:
        counts = [sum(one.get(fault.id, {}).get("caught", False) for fault in members) for one in runs]
        return f"| {name} | {len(members)} | " + " | ".join(map(str, counts)) + " |"

    for title, key in (("area", "area"), ("kind", "kind")):
        print(f"| {title} | faults | " + " | ".join(heads) + " |\n" + "|---" * (2 + len(runs)) + "|")
        for name in sorted({getattr(fault, key) for fault in faults}):
            print(row(name, [fault for fault in faults if getattr(fault, key) == name]))
        print(row("all", faults) + "\n")
    print("| fault | " + " | ".join(heads) + " |\n" + "|---" * (1 + len(runs)) + "|")
    for fault in faults:
        caught = [one.get(fault.id, {}) for one in runs]
        if not all(one.get("caught") for one in caught):
            print(f"| {fault.id} | " + " | ".join(one.get("by") or "not caught" for one in caught) + " |")
    return 0


def check(options: argparse.Namespace) -> int:
    """Print the faults that do not fit the sources."""
    faults = read_faults(options.sample)
    found = problems(faults, options.checkout)
    print(*found, f"{len(faults)} faults, {len(found)} problems", sep="\n")
    return bool(found)


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Seed small wrong edits of the source; report which the tests catch.")
    parser.add_argument("--sample", type=Path, default=SAMPLE, help="file of faults (default: the one in this folder)")
    parser.add_argument("--checkout", type=Path, default=ROOT, help="the checkout to copy (default: this one)")
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("check", help="print the faults that do not fit the sources")
    one.set_defaults(work=check)
    one = commands.add_parser("run", help="seed the faults and run the tests")
    one.add_argument("--results", type=Path, required=True, help="JSON file to write")
    one.add_argument("--only", nargs="+", metavar="ID", help="run only these faults")
    one.add_argument("--jobs", type=int, default=2, help="number of faults at the same time (default: 2)")
    one.add_argument("--named-only", action="store_true", help="run only the tests that a fault names")
    one.add_argument(
        "--ignored",
        nargs="*",
        metavar="TEST",
        help="leave out these tests, without a first run of the suite that finds them",
    )
    one.add_argument("--resume", action="store_true", help="keep the verdicts of the results file")
    one.set_defaults(work=run)
    one = commands.add_parser("table", help="print results as a table, several in columns")
    one.add_argument("results", type=Path, nargs="+")
    one.set_defaults(work=table)
    options = parser.parse_args()
    return int(options.work(options))


if __name__ == "__main__":
    sys.exit(main())
