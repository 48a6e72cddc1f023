"""Seeded faults: small wrong edits of the source, and which of them the tests catch (docs/seeded-faults.md).

    python tools/seeded_faults.py check
    python tools/seeded_faults.py run --results after.json
    python tools/seeded_faults.py table before.json after.json

Each fault replaces one piece of text in one source file. A fault is caught when a test fails, or does not end, on a
copy of the checkout with that fault in it. The checkout itself is never changed.
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
"""A run of one fault's tests that takes longer than this counts as a hang, and a hang as caught."""

SUITE_TIMEOUT_S = 5400
"""The same for the whole suite."""


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
        The source file, from the root of the checkout. A file that was moved since is found by its text.
    before, after : str
        The right text, which stands exactly once in the file, and the wrong one.
    effect : str
        What comes out wrong.
    tests : tuple of str
        The test files that most likely catch it, searched first.
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
        """The package that the fault lies in."""
        return self.file.split("/")[2]


@dataclass(frozen=True)
class Verdict:
    """What the tests made of a fault: caught or not, by which test, and after how many seconds."""

    caught: bool
    by: str
    seconds: float


Keep = Callable[[dict[str, Verdict]], None]
"""Takes verdicts as they come in."""


def read_faults(path: Path = SAMPLE) -> list[Fault]:
    """Read the sample.

    Raises
    ------
    SystemExit
        When two faults share an id, or one is of an unknown kind.
    """
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["fault"]
    faults = [Fault(**{**row, "tests": tuple(row["tests"])}) for row in rows]
    repeated = [name for name, times in Counter(fault.id for fault in faults).items() if times > 1]
    unknown = [fault.id for fault in faults if fault.kind not in KINDS]
    if repeated or unknown:
        sys.exit(f"{path.name}: ids used twice: {repeated}; of unknown kind: {unknown}")
    return faults


def locate(fault: Fault, root: Path) -> Path:
    """Return the file that holds a fault's text exactly once.

    Raises
    ------
    LookupError
        When no file, or more than one, holds it.
    """
    named = root / fault.file
    if named.is_file() and named.read_text(encoding="utf-8").count(fault.before) == 1:
        return named
    counts = {path: path.read_text(encoding="utf-8").count(fault.before) for path in (root / SOURCES).rglob("*.py")}
    holders = [path for path, count in counts.items() if count]
    if len(holders) != 1 or counts[holders[0]] != 1:
        raise LookupError(f"{fault.id}: its text stands in {len(holders)} files; update it in {SAMPLE.name}")
    return holders[0]


def problems(faults: Iterable[Fault], root: Path) -> list[str]:
    """Return what keeps faults from being seeded: text that is gone, wrong text that is no Python, missing tests."""
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
    """A copy of the checkout that faults are put into, with a cache of compiled kernels that fits the right sources."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.tree = folder / "checkout"
        self.cache = folder / "kernels"
        # tests that fail without any fault, and prove nothing
        self.broken: list[str] = []
        listed = ["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", "-z"]
        for name in filter(None, subprocess.check_output(listed).decode().split("\0")):
            if (root / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.tree / name)
        # some tests read material that lies beside the checkout
        if (root.parent / "shared").is_dir():
            (folder / "shared").symlink_to(root.parent / "shared")

    @contextmanager
    def seeded(self, faults: Sequence[Fault]) -> Iterator[Path]:
        """Put faults into the copy; yields the kernel cache to use, and takes them out again."""
        kept = {path: (path.read_bytes(), path.stat()) for path in {locate(fault, self.tree) for fault in faults}}
        cache = self.cache
        try:
            for count, fault in enumerate(faults, 1):
                path = locate(fault, self.tree)
                text = path.read_text(encoding="utf-8").replace(fault.before, fault.after)
                path.write_text(text, encoding="utf-8")
                # Python notices a changed source by whole seconds
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
        """Return the tests that fail with some faults in the copy; one that does not end is called "no end"."""
        results = self.tree.parent / "pytest-cache"
        shutil.rmtree(results, ignore_errors=True)
        command = [sys.executable, "-m", "pytest", "--tb=no", "-o", f"cache_dir={results}", *words]
        command += [word for test in self.broken for word in ("--deselect", test)]
        with self.seeded(faults) as cache:
            environment = {**os.environ, "PYTHONPATH": str(self.tree / "src"), "NUMBA_CACHE_DIR": str(cache)}
            # without bytecode each process would compile all sources again
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
    """Run the tests that each fault names, one process a copy."""
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
    """Run all fast tests with many faults at once, then those that fail with each fault alone."""
    failed = copy.failing(faults, [], SUITE_TIMEOUT_S)
    print(f"all fast tests with {len(faults)} faults at once: {len(failed)} fail", flush=True)
    for fault in faults if failed else ():
        started = time.perf_counter()
        alone = copy.failing([fault], ["-n", "0", "-x", *failed], TIMEOUT_S)
        if alone:
            keep({fault.id: Verdict(True, alone[0], round(time.perf_counter() - started, 1))})
            print(f"  {fault.id}: caught by {alone[0]}", flush=True)


def run(asked: argparse.Namespace) -> int:
    """Seed faults, and write after each of them which were caught."""
    faults = [fault for fault in read_faults(asked.sample) if not asked.only or fault.id in asked.only]
    if found := problems(faults, asked.checkout):
        print(*found, sep="\n", file=sys.stderr)
        return 2
    verdicts: dict[str, Verdict] = {}
    if asked.resume and asked.results.is_file():
        verdicts = {name: Verdict(**one) for name, one in json.loads(asked.results.read_text()).items()}

    def keep(more: dict[str, Verdict]) -> None:
        verdicts.update(more)
        rows = {name: asdict(one) for name, one in sorted(verdicts.items())}
        asked.results.write_text(json.dumps(rows, indent=1) + "\n")

    with tempfile.TemporaryDirectory(prefix="seeded-faults-") as folder:
        copies = [Copy(asked.checkout, Path(folder) / str(number)) for number in range(asked.jobs)]
        broken = copies[0].failing([], [], SUITE_TIMEOUT_S)
        if broken:
            print(f"left out, for they fail without any fault: {', '.join(broken)}", flush=True)
        for copy in copies:
            copy.broken = broken
        by_named_tests([fault for fault in faults if fault.id not in verdicts], copies, keep)
        if not asked.named_only:
            by_whole_suite([fault for fault in faults if not verdicts[fault.id].caught], copies[0], keep)
    caught = sum(verdicts[fault.id].caught for fault in faults)
    print(f"{caught} of {len(faults)} faults caught; written to {asked.results}")
    return 0


def table(asked: argparse.Namespace) -> int:
    """Print one or more results as a Markdown table, by area and by kind, and each fault that one of them missed."""
    faults = read_faults(asked.sample)
    runs = [json.loads(path.read_text()) for path in asked.results]
    heads = [path.stem for path in asked.results]

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


def check(asked: argparse.Namespace) -> int:
    """Print the faults that no longer fit the sources."""
    faults = read_faults(asked.sample)
    found = problems(faults, asked.checkout)
    print(*found, f"{len(faults)} faults, {len(found)} problems", sep="\n")
    return bool(found)


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Which small wrong edits of the source the tests catch.")
    parser.add_argument("--sample", type=Path, default=SAMPLE, help="the faults (default: the file beside this one)")
    parser.add_argument("--checkout", type=Path, default=ROOT, help="the checkout to copy (default: this one)")
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("check", help="print the faults that no longer fit the sources")
    one.set_defaults(work=check)
    one = commands.add_parser("run", help="seed the faults and run the tests")
    one.add_argument("--results", type=Path, required=True, help="JSON file to write")
    one.add_argument("--only", nargs="+", metavar="ID", help="only these faults")
    one.add_argument("--jobs", type=int, default=2, help="faults tried at the same time (default: 2)")
    one.add_argument("--named-only", action="store_true", help="only the tests that a fault names, not the whole suite")
    one.add_argument("--resume", action="store_true", help="keep what the results file holds already")
    one.set_defaults(work=run)
    one = commands.add_parser("table", help="print results as a table, several side by side")
    one.add_argument("results", type=Path, nargs="+")
    one.set_defaults(work=table)
    asked = parser.parse_args()
    return int(asked.work(asked))


if __name__ == "__main__":
    sys.exit(main())
