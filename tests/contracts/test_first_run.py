"""The first run: two processes compile for one picture, and whatever happens to a helper, there is a picture."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flarewright.io.exr import read_exr
from flarewright.kernels import first_run
from flarewright.kernels.first_run import ROOTS, compile_together, divided

# a command, and what it compiled, loaded and was asked for
WATCHED = """
import json, sys
from flarewright.cli.app import run
from flarewright.kernels import first_run
first_run.cores = lambda: int(sys.argv[1])
import flarewright.render.first_run as plan
plan.cores = first_run.cores
code = run(sys.argv[2:])
found = {}
for name in first_run.ROOTS:
    if name == "draw masked":
        continue  # the kernel of "draw"
    kernel = first_run.kernel(name)
    found[name] = {
        "called": [str(types) for types in kernel.signatures],
        "compiled": kernel.stats.cache_misses.get(first_run.types(name), 0),
        "expected": str(first_run.types(name)),
    }
print(json.dumps({"code": code, "roots": found}))
"""


def watched(*words, cores=1, cache=None):
    environment = {**os.environ, **({} if cache is None else {"NUMBA_CACHE_DIR": str(cache)})}
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, str(cores), *map(str, words)],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["code"] == 0
    return told["roots"], done.stderr


SMALL = ("heliar-tronnier", "--light", "12,7", "--size", "64x36", "--wavelengths", "3", "--no-png")


def test_a_cold_command_writes_what_a_warm_one_writes(tmp_path):
    cold, warm = tmp_path / "cold.exr", tmp_path / "warm.exr"
    roots, remarks = watched("render", *SMALL, "-o", cold, cores=2, cache=tmp_path / "cache")
    again, same_remarks = watched("render", *SMALL, "-o", warm)
    for one, other in zip(read_exr(cold).layers, read_exr(warm).layers, strict=True):
        assert one.name == other.name
        assert one.pixels.tobytes() == other.pixels.tobytes()
    assert remarks.replace("cold.exr", "warm.exr") == same_remarks
    # the helper's share was loaded, and this process compiled its own
    mine, helpers = divided([name for name in roots if roots[name]["called"]], 2)
    assert {name for name in roots if roots[name]["compiled"]} == set(mine)
    assert {name for name in again if again[name]["called"]} == {*mine, *helpers}


@pytest.mark.parametrize(
    ("words", "unused"),
    [
        (("render", *SMALL, "-o"), {"matrices", "fan wings", "draw ringing"}),
        (("render", *SMALL, "--blades", "0", "--quality", "draft", "-o"), {"draw", "densities", "blade wings"}),
        (("render", "canon-28-80", *SMALL[1:], "--quality", "draft", "-o"), {"draw", "densities", "fan wings"}),
        (("render", *SMALL, "--scatter", "abg", "--quality", "draft", "-o"), {"draw", "densities", "fan wings"}),
        (("ghosts", "heliar-tronnier", "--light", "12,7", "--json"), {"matrices", "blade wings", "fan wings"}),
        (("render", *SMALL, "--fstop", "16", "--ringing", "collins", "-o"), {"matrices", "fan wings"}),
    ],
    ids=["final", "draft", "crowded draft", "scatter", "ghosts", "ringing"],
)
def test_roots_are_called_with_the_types_that_the_table_says(words, unused, tmp_path):
    roots, _ = watched(*words, *([tmp_path / "a.exr"] if words[-1] == "-o" else []))
    for name, root in roots.items():
        if name in unused:
            assert not root["called"], name
        elif root["called"]:
            assert root["expected"] in root["called"], name


SOME = ["double", "pixels"]

TOGETHER = """
import sys
from flarewright.kernels import first_run
# two small roots are worth a helper only where it costs nothing
first_run._START = 0.0
if sys.argv[1] == "no interpreter":
    sys.executable = ""
elif sys.argv[1] == "failing":
    first_run._start = lambda share: first_run.subprocess.Popen(
        [sys.executable, "-c", "raise SystemExit(3)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "hanging":
    first_run.PATIENCE_S = 0.5
    first_run._start = lambda share: first_run.subprocess.Popen(
        [sys.executable, "-c", "import time; time.sleep(600)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "not allowed":
    def refuse(*arguments, **options):
        raise PermissionError("no processes here")
    first_run.subprocess.Popen = refuse
first_run.compile_together(["double", "pixels"], 2)
print([len(first_run.kernel(name).signatures) for name in ("double", "pixels")], first_run.absent(["pixels", "double"]))
"""


def together(how, cache):
    done = subprocess.run(
        [sys.executable, "-c", TOGETHER, how], capture_output=True, text=True, check=True, timeout=60,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.strip()


def test_a_helper_fills_the_cache(tmp_path):
    assert together("well", tmp_path) == "[1, 0] []"


@pytest.mark.parametrize("how", ["no interpreter", "failing", "hanging", "not allowed"])
def test_without_its_helper_a_command_goes_on_alone(how, tmp_path):
    # its own share is compiled; the helper's waits for its first call
    assert together(how, tmp_path) == "[1, 0] ['pixels']"


def test_a_helper_ends_with_the_command(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    helper = first_run._start(["mesh"])
    time.sleep(1.0)
    assert helper.poll() is None
    # what the system does when a process ends, however it ends
    helper.stdin.close()
    assert helper.wait(timeout=20) == 1


def test_nobody_helps_where_nothing_is_compiled(monkeypatch):
    def start(share):
        raise AssertionError("a process was started")

    monkeypatch.setattr(first_run, "_start", start)
    # one process, a helper itself, a cache that holds all
    compile_together(SOME, 1)
    monkeypatch.setattr(first_run, "absent", lambda names: [])
    compile_together(SOME, 2)
    monkeypatch.setattr(first_run, "absent", list)
    monkeypatch.setenv("FLAREWRIGHT_HELPER", "1")
    compile_together(SOME, 2)


def test_python_without_a_compiler_has_nothing_absent(tmp_path):
    code = "from flarewright.kernels.first_run import absent; print(absent(['pixels', 'mesh']))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == "[]"


def test_kernels_work_where_nothing_can_be_cached():
    code = """
import numba.core.dispatcher as dispatcher

def refuse(self):
    raise RuntimeError("cannot cache function: no locator available")

dispatcher.Dispatcher.enable_caching = refuse
import numpy as np
from flarewright.kernels.first_run import absent
from flarewright.kernels.collect import collect
pixels = np.empty((1, 2, 3), np.float32)
collect(np.ones((1, 1, 3, 8), np.float32), pixels)
print(pixels.sum(), absent(["pixels"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "6.0 []"


@pytest.mark.parametrize("processes", [1, 2, 3, 4, 20])
def test_shares_hold_every_root_once(processes):
    shares = divided(list(ROOTS), processes)
    assert sorted(name for share in shares for name in share) == sorted(ROOTS)
    assert 1 <= len(shares) <= processes
    assert all(shares)


def test_only_commands_start_processes():
    sources = Path(first_run.__file__).parents[1]
    users = [path for path in sources.rglob("*.py") if "import compile_for_" in path.read_text(encoding="utf-8")]
    named = {path.relative_to(sources).as_posix() for path in users}
    assert {"cli/ghosts.py", "cli/render.py"} <= named
    assert {name.split("/")[0] for name in named} == {"cli"}


def test_python_cannot_call_what_only_kernels_call():
    # without its guard this would be a crash, not an exception
    code = """
import numpy as np
from flarewright.kernels.clip import blade_value

def twice():
    for _ in range(2):
        try:
            blade_value(np.zeros((3, 4)), 0, 0.0, 0.0)
        except TypeError as error:
            print(error)

twice()
blade_value.compile("(f8[:,::1], i8, f8, f8)")
twice()
print(blade_value.py_func(np.ones((3, 4)), 0, 0.0, 0.0))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["blade_value is for kernels; Python may call its py_func"] * 4 + ["-1.0"]


def test_linked_kernels_say_what_numba_alone_says():
    # in a process of its own: what the compiler makes depends on what it has made before
    code = """
from math import sqrt
import numpy as np
from numba import njit
from numba.core.codegen import JITCodeLibrary
from flarewright.kernels import _jit

alone = []
finished = JITCodeLibrary._finalize_specific

def count(library):
    alone.append(library.name)
    return finished(library)

def folded(x, k):
    if k == 0:
        raise ValueError("nothing left")
    return sqrt(x) + np.float64(k)

def outer_of(step):
    def outer(values):
        total = 0.0
        for k in range(len(values)):
            total += step(values[k], k + 1)
        return total
    return outer

JITCodeLibrary._finalize_specific = count
values = np.linspace(0.0, 3.0, 40)
ours = _jit.for_python(_jit.inner(folded))
linked = njit(outer_of(_jit.inner(folded)))(values)
print(sum("folded" in name for name in alone))
plain = njit(outer_of(njit(folded)))(values)
print(sum("folded" in name for name in alone))
print(linked == plain, ours(4.0, 3))
try:
    ours(4.0, 0)
except ValueError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["0", "1", "True 5.0", "nothing left"]
