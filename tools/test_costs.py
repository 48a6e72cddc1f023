"""Costs of the tests: CPU seconds of every test, with child processes and compilation in separate columns.

    python tools/test_costs.py run out/costs -m slow      # pytest with these arguments; one file per process
    python tools/test_costs.py table out/costs --by file  # or folder, test, kernel; the most expensive first

`pytest --durations` shows wall-clock seconds, which depend on the load of the machine. CPU seconds depend less on it;
compilation of a kernel counts for the test that calls it first.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import pytest

FOLDER = "FLAREWRIGHT_TEST_COSTS"
"""Environment variable: output folder of the plugin."""


class Compiling:
    """Sums this thread's CPU seconds in Numba's compiler, and keeps those of each kernel."""

    def __init__(self) -> None:
        from numba.core import event

        costs = self
        self.seconds = 0.0
        self.kernels: list[dict[str, Any]] = []
        # start of each kernel that is being compiled, and the seconds of the kernels that it calls
        open_ones: list[list[float]] = []

        class Listener(event.Listener):
            def on_start(self, _: Any) -> None:
                open_ones.append([time.thread_time(), 0.0])

            def on_end(self, what: Any) -> None:
                started, of_callees = open_ones.pop()
                spent = time.thread_time() - started
                if open_ones:
                    open_ones[-1][1] += spent
                else:
                    costs.seconds += spent
                if not what.data:
                    # a test reports a compilation that is none
                    return
                function = what.data["dispatcher"].py_func
                name = f"{function.__module__.removeprefix('flarewright.kernels.')}.{function.__name__}"
                types = ", ".join(map(str, what.data["args"]))
                row = {"kernel": name, "types": types, "own": round(spent - of_callees, 3), "cpu": round(spent, 3)}
                costs.kernels.append(row)

        event.register("numba:compile", Listener())


class Recorder:
    """A pytest plugin that writes one line of JSON per phase of each test."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.compiling = Compiling()

    def now(self) -> tuple[float, float, float, float]:
        """Return CPU seconds of this process and its children, seconds of compilation, and the clock."""
        times = os.times()
        own, children = times.user + times.system, times.children_user + times.children_system
        return own, children, self.compiling.seconds, time.perf_counter()

    def phase(self, test: str) -> Iterator[None]:
        """Record the costs of a hook."""
        before = self.now()
        yield
        own, children, compiling, wall = (round(b - a, 3) for a, b in zip(before, self.now(), strict=True))
        row = {"test": test, "cpu": own + children, "children": children, "compiling": compiling, "wall": wall}
        self.stream.write(json.dumps(row) + "\n")
        for each in self.compiling.kernels:
            self.stream.write(json.dumps({**each, "caller": test}) + "\n")
        self.compiling.kernels.clear()

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Iterator[None]:
        """Record fixtures; they count for the first test that uses them."""
        yield from self.phase(item.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Record the test itself."""
        yield from self.phase(item.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> Iterator[None]:
        """Record the teardown of fixtures."""
        yield from self.phase(item.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Record the whole process, including collection and imports."""
        own, children, compiling, _ = self.now()
        row = {"process": own + children, "children": children, "compiling": compiling}
        self.stream.write(json.dumps(row) + "\n")
        self.stream.flush()


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugin in every process that runs tests."""
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
    """Print the most expensive rows, and the total."""
    # as other programs do when `head` has read enough
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0] * 4)
    tests: dict[str, set[str]] = defaultdict(set)
    processes = []
    for path in sorted(folder.glob("*.jsonl")):
        for row in map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            if "process" in row:
                processes.append(row["process"])
                continue
            if "kernel" in row:
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


def kernel_table(folder: Path, most: int) -> int:
    """Print the kernels that took longest to compile, without those that they call; each with its first test."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for path in sorted(folder.glob("*.jsonl")):
        for row in map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            if "kernel" in row:
                rows[row["kernel"]].append(row)
    print("| kernel | compiled | types | CPU s | with callees | first test |\n|---|---|---|---|---|---|")
    for name, each in sorted(rows.items(), key=lambda item: -sum(one["own"] for one in item[1]))[:most]:
        own, cpu = (sum(one[column] for one in each) for column in ("own", "cpu"))
        types = len({one["types"] for one in each})
        print(f"| {name} | {len(each)} | {types} | {own:.2f} | {cpu:.2f} | {each[0]['caller']} |")
    every = [one for each in rows.values() for one in each]
    own, types = sum(one["own"] for one in every), len({(one["kernel"], one["types"]) for one in every})
    print(f"| all | {len(every)} | {types} | {own:.2f} | | |")
    return 0


COLUMNS = ("cpu", "children", "compiling", "wall")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Costs of the tests.")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("run", help="run pytest and record the costs of each test")
    one.add_argument("folder", type=Path)
    one = commands.add_parser("table", help="print the most expensive tests")
    one.add_argument("folder", type=Path)
    one.add_argument("--by", choices=("folder", "file", "test", "kernel"), default="file")
    one.add_argument("--most", type=int, default=100, metavar="N", help="rows to print (default: 100)")
    args, words = parser.parse_known_args()
    if args.command == "run":
        return run(args.folder, words)
    if words:
        parser.error(f"unknown: {' '.join(words)}")
    if args.by == "kernel":
        return kernel_table(args.folder, args.most)
    return table(args.folder, args.by, args.most)


if __name__ == "__main__":
    sys.exit(main())
