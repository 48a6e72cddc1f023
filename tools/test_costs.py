"""What the tests cost: CPU seconds of every test, child processes and compiling in separate columns.

    python tools/test_costs.py run out/costs -m slow      # pytest with these words; a file a process in the folder
    python tools/test_costs.py table out/costs --by file  # or folder, test; the most expensive first

`pytest --durations` shows wall-clock seconds, which depend on what else runs. CPU seconds depend less on it, and what a
test spends compiling kernels falls on whichever test calls a kernel first.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import pytest

FOLDER = "FLAREWRIGHT_TEST_COSTS"
"""Environment variable: the folder that the plugin writes to."""


class Compiling:
    """Sums the CPU seconds that this thread spends in Numba's compiler."""

    def __init__(self) -> None:
        from numba.core import event

        costs = self
        costs.seconds, costs._depth, costs._started = 0.0, 0, 0.0

        class Listener(event.Listener):
            def on_start(self, _: Any) -> None:
                costs._depth += 1
                if costs._depth == 1:
                    costs._started = time.thread_time()

            def on_end(self, _: Any) -> None:
                costs._depth -= 1
                if costs._depth == 0:
                    costs.seconds += time.thread_time() - costs._started

        event.register("numba:compile", Listener())


class Recorder:
    """A pytest plugin: one line of JSON for each phase of each test."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.compiling = Compiling()

    def now(self) -> tuple[float, float, float, float]:
        """Return CPU seconds of this process and of its children, seconds of compiling, and the clock."""
        times = os.times()
        own, children = times.user + times.system, times.children_user + times.children_system
        return own, children, self.compiling.seconds, time.perf_counter()

    def phase(self, test: str) -> Iterator[None]:
        """Record what passes between the two ends of a hook."""
        before = self.now()
        yield
        own, children, compiling, wall = (round(b - a, 3) for a, b in zip(before, self.now(), strict=True))
        row = {"test": test, "cpu": own + children, "children": children, "compiling": compiling, "wall": wall}
        self.stream.write(json.dumps(row) + "\n")

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Iterator[None]:
        """Record fixtures: they fall on the test that asks for them first."""
        yield from self.phase(item.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Record the test itself."""
        yield from self.phase(item.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> Iterator[None]:
        """Record what fixtures undo."""
        yield from self.phase(item.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Record the whole process: collecting and importing are in no test."""
        own, children, compiling, _ = self.now()
        row = {"process": own + children, "children": children, "compiling": compiling}
        self.stream.write(json.dumps(row) + "\n")
        self.stream.flush()


def pytest_configure(config: pytest.Config) -> None:
    """Record in every process that runs tests."""
    folder = os.environ.get(FOLDER)
    hands_out = config.getoption("numprocesses", default=None) and not hasattr(config, "workerinput")
    if folder and not hands_out:
        name = os.environ.get("PYTEST_XDIST_WORKER", "main")
        config.pluginmanager.register(Recorder((Path(folder) / f"{name}.jsonl").open("w", encoding="utf-8")))


def run(folder: Path, words: list[str]) -> int:
    """Run pytest with the plugin; print the CPU minutes of all processes."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.jsonl"):
        old.unlink()
    path = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, FOLDER: str(folder.resolve()), "PYTHONPATH": path}
    started = time.perf_counter()
    code = subprocess.call([sys.executable, "-m", "pytest", "-p", Path(__file__).stem, *words], env=environment)
    times = os.times()
    cpu = times.children_user + times.children_system
    print(f"{cpu / 60:.1f} CPU minutes, {time.perf_counter() - started:.0f} s of wall clock")
    return code


def table(folder: Path, by: str, most: int) -> int:
    """Print what is most expensive, and all of it together."""
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0] * 4)
    tests: dict[str, set[str]] = defaultdict(set)
    processes = []
    for path in sorted(folder.glob("*.jsonl")):
        for row in map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            if "process" in row:
                processes.append(row["process"])
                continue
            file = row["test"].split("::")[0]
            key = {"folder": file.rpartition("/")[0], "file": file, "test": row["test"]}[by]
            tests[key].add(row["test"])
            sums[key] = [a + row[name] for a, name in zip(sums[key], COLUMNS, strict=True)]
    print(f"| {by} | tests | CPU s | of it children | of it compiling | wall s |\n|---|---|---|---|---|---|")
    rows = sorted(sums.items(), key=lambda item: -item[1][0])
    whole = [sum(column) for column in zip(*sums.values(), strict=True)]
    for name, costs in [*rows[:most], ("all", whole)]:
        count = len(tests[name]) if name in tests else sum(map(len, tests.values()))
        print(f"| {name} | {count} | " + " | ".join(f"{cost:.2f}" for cost in costs) + " |")
    print(f"\nprocesses that ran tests: {', '.join(f'{each:.0f}' for each in processes)} CPU s")
    return 0


COLUMNS = ("cpu", "children", "compiling", "wall")


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="What the tests cost.")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("run", help="run pytest and record what each test costs")
    one.add_argument("folder", type=Path)
    one = commands.add_parser("table", help="print what is most expensive")
    one.add_argument("folder", type=Path)
    one.add_argument("--by", choices=("folder", "file", "test"), default="file")
    one.add_argument("--most", type=int, default=100, metavar="N", help="rows to print (default: 100)")
    asked, words = parser.parse_known_args()
    if asked.command == "run":
        return run(asked.folder, words)
    if words:
        parser.error(f"unknown: {' '.join(words)}")
    return table(asked.folder, asked.by, asked.most)


if __name__ == "__main__":
    sys.exit(main())
