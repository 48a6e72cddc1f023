"""The first run: two processes compile for one picture, and a failing helper does not stop the command.

A process takes half a second to start, and a command with an empty cache ten seconds. The fast tests therefore watch
commands in this process, where everything is compiled, and compile two small roots into an empty cache. The slow tests
do the same with whole commands, each in a separate process.
"""

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import nullcontext
from dataclasses import dataclass
from inspect import signature
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from tools.record_roots import kernels, name_of, text_of

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr
from flarewright.kernels.jit import decorators, warmup, warmup_processes
from flarewright.kernels.jit.roots import divide_roots, drawing_roots, roots, tracing_roots
from flarewright.kernels.jit.warmup import compile_together
from flarewright.render.scattering import scatter_pass


@pytest.fixture(autouse=True)
def _helpers_may_start(monkeypatch):
    """Undo the setting of tests/conftest.py that forbids helpers."""
    monkeypatch.delenv("FLAREWRIGHT_HELPER", raising=False)


# run a command and print what it called, compiled and planned
WATCHED = """
import json, sys
sys.path.append({root!r})
from flarewright.cli.app import run
from flarewright.kernels.jit import warmup
from flarewright.kernels.jit import warmup_processes
from flarewright.kernels.jit.roots import roots
from tools.record_roots import called, kernels, name_of
warmup_processes.cores = lambda: int(sys.argv[1])
import flarewright.render.warmup as plan
plan.cores = warmup_processes.cores
planned = set()
together = plan.compile_together
plan.compile_together = lambda names, *others: (planned.update(names), together(names, *others))
code = run(sys.argv[2:])
compiled = {{name_of(each.py_func): sum(each.stats.cache_misses.values()) for each in kernels()}}
print(json.dumps({{"code": code, "called": called(), "compiled": compiled, "planned": sorted(planned)}}))
"""


# open the editor, wait for its first picture and print the number of compilations
EDITOR = """
import sys
sys.path.append({root!r})
from tools.record_roots import first_picture, kernels
first_picture()
print(sum(sum(each.stats.cache_misses.values()) for each in kernels()))
"""


@dataclass(frozen=True)
class Watching:
    """What a command did: names of roots, numbers of compilations by kernel, and lines on stderr."""

    called: set
    planned: set
    compiled: dict
    remarks: list


def watched(*words, cores=1, cache=None):
    environment = {**os.environ, **({} if cache is None else {"NUMBA_CACHE_DIR": str(cache)})}
    code = WATCHED.format(root=str(Path(__file__).parents[2]))
    done = subprocess.run(
        [sys.executable, "-c", code, str(cores), *map(str, words)],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    output = json.loads(done.stdout.splitlines()[-1])
    assert output["code"] == 0
    called = named({tuple(each) for each in output["called"]})
    return Watching(called, set(output["planned"]), output["compiled"], done.stderr.splitlines())


def named(called):
    """Return the names of the roots among the called kernels and types; all must be in the table."""
    names = {(root.kernel, root.types): name for name, root in roots().items()}
    unlisted = [each for each in called if each not in names]
    assert not unlisted, f"not in roots.json, run tools/record_roots.py: {unlisted}"
    return {names[each] for each in called}


class _Watched:
    """A root that records the argument types of its calls."""

    def __init__(self, kernel):
        self.kernel, self.called = kernel, set()

    def __call__(self, *arguments):
        self.called.add(", ".join(text_of(self.kernel.typeof_pyval(each)) for each in arguments))
        return self.kernel(*arguments)

    def __getattr__(self, name):
        return getattr(self.kernel, name)


def _replace_everywhere(others):
    """Replace objects by others, which the dictionary holds by their ids, in all modules of the package."""
    for module in [each for name, each in sys.modules.items() if name.partition(".")[0] == "flarewright"]:
        for name, value in [(name, value) for name, value in vars(module).items() if id(value) in others]:
            setattr(module, name, others[id(value)])


@pytest.fixture
def watched_here(monkeypatch):
    """Run a command in this process and return what `watched` returns, without compilations and remarks."""
    found = [_Watched(each) for each in {id(each): each for each in map(warmup.kernel, roots())}.values()]
    planned = set()
    # pretend that no root is compiled
    monkeypatch.setattr("flarewright.render.warmup.absent", list)
    monkeypatch.setattr("flarewright.render.warmup.compile_together", lambda names, *_: planned.update(names))
    monkeypatch.setattr("flarewright.cli.app.head_start", lambda rings: nullcontext())
    # few sample points of the scatter pass: the number does not change which kernels are called
    for name in ("FINE", "COARSE"):
        monkeypatch.setattr(scatter_pass, name, scatter_pass.Sampling(rays=6, rings=6, spokes=6, fan=6))

    def command(*words):
        assert run(list(map(str, words))) == 0
        called = {(name_of(root.kernel.py_func), types) for root in found for types in root.called}
        return Watching(named(called), planned, {}, [])

    _replace_everywhere({id(root.kernel): root for root in found})
    yield command
    _replace_everywhere({id(root): root.kernel for root in found})


# kernels of measurements and searches are compiled at their first call
LATER = {"ghost_model", "design"}


def test_the_table_lists_the_kernels_of_every_render():
    folder = Path(warmup.__file__).parents[1]
    for path in folder.rglob("[a-z]*.py"):
        if path.parent.name not in {*LATER, "jit"}:
            importlib.import_module(".".join(("flarewright.kernels", *path.relative_to(folder).with_suffix("").parts)))
    sources = {name_of(each.py_func) for each in kernels()}
    sources = {name for name in sources if name.partition(".")[0] not in LATER}
    assert sources == {root.kernel for root in roots().values()}, "run tools/record_roots.py"
    for name in roots():
        parameters = signature(warmup.kernel(name).py_func).parameters
        assert len(warmup.types(name)) == len(parameters), f"{name} has changed: run tools/record_roots.py"


def test_types_are_read_as_they_are_written():
    for name, root in roots().items():
        assert ", ".join(map(text_of, warmup.types(name))) == root.types


SMALL = ("heliar-tronnier", "--ideal", "--light", "12,7", "--size", "64x36", "--wavelengths", "3")


@pytest.mark.slow
def test_a_cold_command_writes_what_a_warm_one_writes(tmp_path):
    cold, warm = tmp_path / "cold.exr", tmp_path / "warm.exr"
    first_run = watched("render", *SMALL, "-o", cold, cores=2, cache=tmp_path / "cache")
    again = watched("render", *SMALL, "-o", warm)
    for one, other in zip(read_exr(cold).layers, read_exr(warm).layers, strict=True):
        assert one.name == other.name
        assert one.pixels.tobytes() == other.pixels.tobytes()
    first, *others = (line.replace("cold.", "warm.") for line in first_run.remarks)
    assert first.startswith("flarewright: first run: the kernels are compiled once")
    assert others == again.remarks
    # this process loaded the helper's share and compiled its share; no other kernel was compiled
    called = {roots()[name].kernel for name in first_run.called}
    helped = {roots()[name].kernel for name in tracing_roots()}
    assert {kernel for kernel, count in first_run.compiled.items() if count} == called - helped
    # the light is outside the picture, so the core of its starburst is compiled and not drawn; small pictures have no
    # steps of lateral colour to fill
    assert again.called == first_run.called - {"deposit_core", "rays_between"}
    cached = {path.name.split("-")[0] for path in (tmp_path / "cache").rglob("*.nbi")}
    assert cached == {kernel.partition(".")[2] for kernel in called}


@pytest.mark.slow
def test_after_a_warm_up_commands_compile_nothing(tmp_path):
    cache = tmp_path / "cache"
    watched("warm-up", cores=2, cache=cache)
    lens = ("takumar-50-f1.4", "--light", "-9,5", "--size", "192x108", "-o", tmp_path / "a.exr")
    predicted = ("predict", "heliar-tronnier", "--samples", "5", "--check", "0", "--json")
    for words in (("render", *lens), ("ghosts", *lens[:3]), predicted, ("render", *lens, "--fstop", "16")):
        done = watched(*words, cores=2, cache=cache)
        assert done.called
        assert not {kernel for kernel, count in done.compiled.items() if count}, words
    code = EDITOR.format(root=str(Path(__file__).parents[2]))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "FLAREWRIGHT_STATE": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split() == ["0"]


@pytest.mark.parametrize("size", ["64x36", pytest.param("192x108", marks=pytest.mark.slow)])
def test_a_command_plans_every_root_that_it_calls(size, tmp_path, request):
    # with the default of seven wavelengths some ghosts are drawn at a few of them
    lens = ("heliar-tronnier", "--ideal", "--light", "12,7")
    words = ("render", *lens, "--size", size, "-o", tmp_path / "a.exr")
    if size == "64x36":
        done = request.getfixturevalue("watched_here")(*words)
    else:
        done = watched(*words, cores=2, cache=tmp_path / "cache")
    assert "seen_rays" in done.called
    # the light is outside the picture, so the core of its starburst is not drawn; in small pictures no colour steps are
    # filled (a process that compiles its own plan counts as calling all of it)
    assert done.planned - done.called == ({"deposit_core", "rays_between"} if size == "64x36" else set())
    assert done.called <= done.planned


@pytest.mark.parametrize(
    ("words", "unused"),
    [
        pytest.param(
            ("render", *SMALL, "-o"),
            {"draw_matrix_ghosts", "blend_fan_wings", "draw_ringing"},
            marks=pytest.mark.slow,
        ),
        (("render", *SMALL, "--blades", "0", "--quality", "draft", "-o"), {"draw_bundle", "blend_blade_wings"}),
        pytest.param(
            ("render", "canon-28-80", *SMALL[1:], "--quality", "draft", "-o"),
            {"draw_bundle", "blend_fan_wings"},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            ("render", *SMALL, "--scatter", "abg", "--quality", "draft", "-o"),
            {"draw_bundle", "blend_fan_wings"},
            marks=pytest.mark.slow,
        ),
        (
            ("ghosts", "heliar-tronnier", "--light", "12,7", "--fstop", "16", "--json"),
            {"draw_matrix_ghosts", "blend_blade_wings", "blend_fan_wings"},
        ),
        (("render", *SMALL, "--fstop", "16", "--ringing", "collins", "-o"), {"draw_matrix_ghosts", "blend_fan_wings"}),
    ],
    ids=["final", "draft", "crowded draft", "scatter", "ghosts", "ringing"],
)
@pytest.mark.parametrize("where", ["here", pytest.param("in its process", marks=pytest.mark.slow)])
def test_roots_are_called_with_the_types_of_the_table(words, unused, where, tmp_path, request):
    words = (*words, *([tmp_path / "a.exr"] if words[-1] == "-o" else []))
    done = request.getfixturevalue("watched_here")(*words) if where == "here" else watched(*words)
    assert done.called
    assert not done.called & unused


SOME = ["add_doubled", "collect"]


@pytest.fixture
def cold(tmp_path, monkeypatch):
    """Provide two small uncompiled roots and an empty cache."""
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache))
    monkeypatch.setattr(config, "CACHE_DIR", str(cache))
    fresh = {name: decorators.compiled(warmup.kernel(name).py_func) for name in SOME}
    monkeypatch.setattr(warmup, "kernel", fresh.__getitem__)
    # a helper pays for two small roots only if it starts at once
    monkeypatch.setattr("flarewright.kernels.jit.roots.START_S", 0.0)
    assert warmup.absent(SOME) == SOME
    return cache


def held():
    """Return the number of compiled types of each small root, and the roots absent from the cache."""
    return [len(warmup.kernel(name).signatures) for name in SOME], warmup.absent(["collect", "add_doubled"])


def pictures():
    """Return the bytes of two pictures made by the small roots."""
    rng = np.random.default_rng(5)
    plane, fine = rng.random((4, 1, 3, 8), dtype=np.float32), np.empty((4, 6, 3), np.float32)
    warmup.kernel("collect")(plane, fine)
    doubled = fine.copy()
    warmup.kernel("add_doubled")(rng.random((2, 3, 3), dtype=np.float32), doubled)
    return fine.tobytes(), doubled.tobytes()


def test_a_helper_fills_the_cache(request, capfd):
    warm = pictures()
    cache = request.getfixturevalue("cold")
    compile_together(SOME, 2)
    assert held() == ([1, 0], [])
    # this process loads the helper's share and has compiled its share; no other kernel is compiled
    assert pictures() == warm
    counts = {name: warmup.kernel(name).stats for name in SOME}
    assert {name: sum(each.cache_misses.values()) for name, each in counts.items()} == {"add_doubled": 1, "collect": 0}
    assert sum(counts["collect"].cache_hits.values()) == 1
    assert {path.name.split("-")[0] for path in cache.rglob("*.nbi")} == {
        roots()[name].kernel.partition(".")[2] for name in SOME
    }
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("failure", ["no interpreter", "failing", "hanging", "not allowed"])
@pytest.mark.usefixtures("cold")
def test_a_command_without_its_helper_resumes_alone(failure, monkeypatch, capfd):
    def process_running(code):
        return lambda share: subprocess.Popen([sys.executable, "-S", "-c", code], stdin=-1, stdout=-3, stderr=-3)

    if failure == "no interpreter":
        monkeypatch.setattr(sys, "executable", "")
    elif failure == "failing":
        monkeypatch.setattr(warmup_processes, "start", process_running("raise SystemExit(3)"))
    elif failure == "hanging":
        monkeypatch.setattr(warmup_processes, "PATIENCE_S", 0.2)
        monkeypatch.setattr(warmup_processes, "start", process_running("import time; time.sleep(600)"))
    else:

        def refuse(*arguments, **options):
            raise PermissionError("no processes here")

        monkeypatch.setattr(warmup_processes.subprocess, "Popen", refuse)
    started = time.monotonic()
    compile_together(SOME, 2)
    # this process has compiled its share; the helper's root is compiled at its first call
    assert held() == ([1, 0], ["collect"])
    assert time.monotonic() - started < 60.0
    assert capfd.readouterr() == ("", "")


TOGETHER = """
import sys
from flarewright.kernels.jit import roots, warmup
from flarewright.kernels.jit import warmup_processes
# a helper pays for two small roots only if it starts at once
roots.START_S = 0.0
if sys.argv[1] == "no interpreter":
    sys.executable = ""
elif sys.argv[1] == "failing":
    warmup_processes.start = lambda share: warmup_processes.subprocess.Popen(
        [sys.executable, "-c", "raise SystemExit(3)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "hanging":
    warmup_processes.PATIENCE_S = 0.5
    warmup_processes.start = lambda share: warmup_processes.subprocess.Popen(
        [sys.executable, "-c", "import time; time.sleep(600)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "not allowed":
    def refuse(*arguments, **options):
        raise PermissionError("no processes here")
    warmup_processes.subprocess.Popen = refuse
warmup.compile_together(["add_doubled", "collect"], 2)
some = ["collect", "add_doubled"]
print([len(warmup.kernel(name).signatures) for name in reversed(some)], warmup.absent(some))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("failure", "output"),
    [("none", "[1, 0] []")]
    + [(failure, "[1, 0] ['collect']") for failure in ("no interpreter", "failing", "hanging", "not allowed")],
)
def test_a_command_in_its_process_resumes_with_and_without_its_helper(failure, output, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", TOGETHER, failure], capture_output=True, text=True, check=True, timeout=60,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
    )  # fmt: skip
    assert (done.stdout.strip(), done.stderr) == (output, "")


@pytest.mark.parametrize("seconds", [0.1, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_helper_ends_with_the_command(seconds, tmp_path, monkeypatch):
    """While it starts, and while it compiles: a helper that finishes its work ends with 0."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    helper = warmup_processes.start(["build_mesh"])
    time.sleep(seconds)
    assert helper.poll() is None
    # the system does this when the parent process ends, even when it is killed
    helper.stdin.close()
    assert helper.wait(timeout=20) == 1


def test_no_helper_starts_where_nothing_is_compiled(monkeypatch):
    def start(share):
        raise AssertionError("a process was started")

    monkeypatch.setattr(warmup_processes, "start", start)
    # one process; a cache that holds all roots; a process that is a helper
    compile_together(SOME, 1)
    monkeypatch.setattr(warmup, "absent", lambda names: [])
    compile_together(SOME, 2)
    monkeypatch.setattr(warmup, "absent", list)
    monkeypatch.setenv("FLAREWRIGHT_HELPER", "1")
    compile_together(SOME, 2)


AHEAD = """
import sys
from pathlib import Path
from flarewright.kernels.jit import warmup
from flarewright.kernels.jit import warmup_processes
warmup_processes.cores = lambda: 2
warmup_processes.tracing_roots = lambda: ["collect"]
with warmup_processes.head_start():
    (helper,) = warmup_processes.ahead()
    warmup.compile_together(["add_doubled", "collect"], int(sys.argv[1]))
    print([len(warmup.kernel(name).signatures) for name in ("add_doubled", "collect")], warmup.absent(["collect"]))
print(warmup_processes.ahead(), helper.process.poll() is not None)
index = Path(sys.argv[2])
index.parent.mkdir()
index.touch()
with warmup_processes.head_start():
    print(warmup_processes.ahead())
"""
# path of Numba's cache index of a compiled pre-pass
INDEX = f"tracing_0/pupil_prepass.find_box-57.py{sys.version_info.major}{sys.version_info.minor}.nbi"


class IdleHelper(subprocess.Popen):
    """A process that does nothing, as a real helper takes half a second; waiting for it compiles its share here."""

    def __init__(self, share):
        super().__init__([sys.executable, "-S", "-c", ""], stdin=subprocess.PIPE)
        self.share = list(share)

    def wait(self, timeout=None):
        while self.share:
            name = self.share.pop()
            decorators.compiled(warmup.kernel(name).py_func).compile(warmup.types(name))
        return super().wait(timeout)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_command_uses_its_head_start(processes, cold, monkeypatch):
    monkeypatch.setattr(warmup_processes, "cores", lambda: 2)
    monkeypatch.setattr(warmup_processes, "tracing_roots", lambda: ["collect"])
    # with one process the command only waits for the helper's end
    monkeypatch.setattr(warmup_processes, "start", lambda share: IdleHelper(share if processes == 2 else ()))
    with warmup_processes.head_start():
        (helper,) = warmup_processes.ahead()
        assert helper.names == ("collect",)
        compile_together(SOME, processes)
        # the command has waited for the helper
        assert helper.process.poll() == 0
        assert held() == ([1, 0], ["collect"] if processes == 1 else [])
    assert warmup_processes.ahead() == ()
    # with a warm cache no helper starts ahead
    index = cold / INDEX
    index.parent.mkdir(exist_ok=True)
    index.touch()
    with warmup_processes.head_start():
        assert warmup_processes.ahead() == ()


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["1", "2"])
def test_a_command_in_its_process_uses_its_head_start(processes, tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", AHEAD, processes, str(tmp_path / INDEX)],
        capture_output=True, text=True, check=True, timeout=60, env=environment,
    )  # fmt: skip
    # with a warm cache no helper starts ahead
    assert done.stdout.splitlines() == ["[1, 0] []", "() True", "()"]


def test_a_head_start_needs_a_cache_that_is_surely_cold(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert warmup_processes._cache_is_cold()
    held = tmp_path / INDEX
    held.parent.mkdir()
    held.touch()
    assert not warmup_processes._cache_is_cold()
    # an index of older sources
    os.utime(held, (0, 0))
    assert warmup_processes._cache_is_cold()
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not warmup_processes._cache_is_cold()
    monkeypatch.delenv("NUMBA_DISABLE_JIT")
    # Numba caches in a folder that only Numba knows
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert not warmup_processes._cache_is_cold()


@pytest.mark.parametrize("rings", [False, True])
def test_a_helper_draws_where_the_command_draws_rings(rings, monkeypatch):
    started = []

    def start(share):
        started.append(set(share))
        raise OSError

    monkeypatch.setattr(warmup_processes, "start", start)
    monkeypatch.setattr(warmup_processes, "_cache_is_cold", lambda: True)
    for cores in (2, 3):
        monkeypatch.setattr(warmup_processes, "cores", lambda cores=cores: cores)
        with warmup_processes.head_start(rings):
            pass
    traced, more = set(tracing_roots()), set(drawing_roots()) if rings else set()
    assert {"build_mesh", "find_box"} <= traced
    assert {"draw_bundle", "node_densities", "trace_nodes"} <= set(drawing_roots())
    # one helper on two cores, two helpers on more
    assert started[0] == traced | more
    assert len(started) == 3
    assert started[1] | started[2] == traced
    assert not started[1] & started[2]


@pytest.mark.parametrize(
    ("words", "rings"),
    [
        ("render heliar-tronnier --light 1,2 --fstop 8 -o a.exr", True),
        ("render --fstop=8 heliar-tronnier -o a.exr", True),
        ("render heliar-tronnier --light 1,2 -o a.exr", False),
        ("render heliar-tronnier --fstop 8 --ringing off -o a.exr", False),
        ("render heliar-tronnier --fstop 8 --quality=draft -o a.exr", False),
        ("ghosts heliar-tronnier --fstop 8", False),
    ],
)
def test_the_arguments_decide_whether_rings_are_compiled(words, rings, monkeypatch):
    requested = []
    monkeypatch.setattr("flarewright.cli.app.head_start", lambda rings: requested.append(rings) or nullcontext())
    monkeypatch.setattr("flarewright.cli.app._call", lambda words: 0)
    assert run(words.split()) == 0
    assert requested == [rings]


@pytest.mark.parametrize(
    "words", [["render", "--help"], ["lenses"], ["ghosts", "-h"], ["render", "no-such-lens", "--threads", "1"]]
)
def test_commands_that_trace_nothing_start_no_helper(words, monkeypatch, capsys):
    def begin():
        raise AssertionError("a process was started")

    monkeypatch.setattr("flarewright.cli.app.head_start", begin)
    assert run(words) in (0, 2)


def test_an_error_is_reported_at_once_and_leaves_no_helper(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(warmup_processes, "cores", lambda: 2)
    started = []
    start = warmup_processes.start
    monkeypatch.setattr(warmup_processes, "start", lambda share: started.append(start(share)) or started[-1])
    assert run(["render", "no-such-lens", "--light", "1,2", "-o", str(tmp_path / "a.exr")]) == 2
    assert "no-such-lens" in capsys.readouterr().err
    assert [process.poll() is None for process in started] == [False]


def test_where_nothing_is_compiled_nothing_is_absent(cold, monkeypatch):
    monkeypatch.setattr(config, "DISABLE_JIT", 1)
    plain = {name: decorators.compiled(warmup.kernel(name).py_func) for name in SOME}
    assert not any(hasattr(each, "py_func") for each in plain.values())
    assert decorators.inner(held) is held
    monkeypatch.setattr(warmup, "kernel", plain.__getitem__)
    assert warmup.absent(SOME) == []


@pytest.mark.slow
def test_python_without_a_compiler_has_nothing_absent(tmp_path):
    code = "from flarewright.kernels.jit.warmup import absent; print(absent(['collect', 'mesh']))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == "[]"


def test_a_kernel_works_where_nothing_can_be_cached(monkeypatch):
    def refuse(self):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr("numba.core.dispatcher.Dispatcher.enable_caching", refuse)
    kernel = decorators.compiled(warmup.kernel("collect").py_func)
    monkeypatch.setattr(warmup, "kernel", lambda name: kernel)
    pixels = np.empty((1, 2, 3), np.float32)
    kernel(np.ones((1, 1, 3, 8), np.float32), pixels)
    assert (pixels.sum(), warmup.absent(["collect"])) == (6.0, [])


@pytest.mark.slow
def test_kernels_work_where_nothing_can_be_cached():
    code = """
import numba.core.dispatcher as dispatcher

def refuse(self):
    raise RuntimeError("cannot cache function: no locator available")

dispatcher.Dispatcher.enable_caching = refuse
import numpy as np
from flarewright.kernels.jit.warmup import absent
from flarewright.kernels.raster.pyramid import collect
pixels = np.empty((1, 2, 3), np.float32)
collect(np.ones((1, 1, 3, 8), np.float32), pixels)
print(pixels.sum(), absent(["collect"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "6.0 []"


@pytest.mark.parametrize("where", ["here", pytest.param("in its process", marks=pytest.mark.slow)])
def test_a_kernel_is_recompiled_when_a_callee_has_changed(where, tmp_path, monkeypatch):
    package = tmp_path / "formulas"
    for folder in (package, package / "jit", package / "tracing", package / "raster"):
        folder.mkdir()
        (folder / "__init__.py").touch()
    for name in ("decorators", "cache_stamp", "cache_loading", "pipeline", "linking"):
        shutil.copy(Path(warmup.__file__).with_name(f"{name}.py"), package / "jit")
    # a callee in another folder than its caller
    held = package / "raster" / "held.py"
    (package / "tracing" / "root.py").write_text(
        "from ..jit.decorators import compiled\nfrom ..raster.held import doubled\n\n"
        "@compiled\ndef root(x):\n    return doubled(x)\n"
    )
    code = "from formulas.tracing.root import root; print(root(1.0), sum(root.stats.cache_hits.values()))"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    # Python compares the times of sources in whole seconds
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(tmp_path)

    def output(factor: float) -> str:
        text = f"from ..jit.decorators import inlined\n\n@inlined\ndef doubled(x):\n    return {factor:.2f} * x\n"
        if not held.exists() or held.read_text() != text:
            held.write_text(text)
        if where != "here":
            done = subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment, cwd=tmp_path
            )
            return done.stdout.strip()
        try:
            root = importlib.import_module("formulas.tracing.root").root
            return f"{root(1.0)} {sum(root.stats.cache_hits.values())}"
        finally:
            for name in [name for name in sys.modules if name.partition(".")[0] == "formulas"]:
                del sys.modules[name]

    assert [output(2.0), output(2.0), output(3.0)] == ["2.0 0", "2.0 1", "3.0 0"]


MEASURING = sorted(Path(warmup.__file__).parents[1].glob("ghost_model/[a-z]*.py"))


@pytest.mark.parametrize("path", MEASURING, ids=lambda path: path.stem)
def test_no_kernel_calls_a_kernel_that_python_calls(path):
    """The last bits of a fit change its ghosts, so they must not depend on whether kernels were compiled or loaded."""
    module = importlib.import_module(f"flarewright.kernels.ghost_model.{path.stem}")
    own = [each for each in vars(module).values() if hasattr(each, "py_func") and each.__module__ == module.__name__]
    assert own
    for kernel in own:
        used = [kernel.py_func.__globals__.get(name) for name in kernel.py_func.__code__.co_names]
        called = [each for each in used if hasattr(each, "py_func")]
        assert not [each for each in called if isinstance(each._cache, FunctionCache)], kernel


@pytest.mark.parametrize("processes", [1, 2, 3, 4, 20])
def test_shares_hold_every_root_once(processes):
    shares = divide_roots(roots(), processes)
    assert sorted(name for share in shares for name in share) == sorted(roots())
    assert 1 <= len(shares) <= processes
    assert all(shares)
    # Numba writes the cache index of a kernel without a lock
    homes = [(roots()[name].kernel, k) for k, share in enumerate(shares) for name in share]
    assert len(set(homes)) == len({root.kernel for root in roots().values()})


def test_only_commands_start_processes():
    sources = Path(warmup.__file__).parents[2]
    users = [path for path in sources.rglob("*.py") if "import compile_for_" in path.read_text(encoding="utf-8")]
    named = {path.relative_to(sources).as_posix() for path in users}
    assert {"cli/render/ghosts_command.py", "cli/render/command.py", "cli/predict/command.py"} <= named
    assert {name.split("/")[0] for name in named} == {"cli"}


def test_python_cannot_call_an_inner_kernel():
    def half(x):
        return 0.5 * x

    kernel = decorators.inner(half)
    for _ in range(2):
        for _ in range(2):
            with pytest.raises(TypeError, match=r"^half is for kernels; Python may call its py_func$"):
                kernel(3.0)
        kernel.compile("(f8,)")
    assert kernel.py_func(3.0) == 1.5


@pytest.mark.slow
def test_python_cannot_call_an_inner_kernel_of_the_package():
    # without the guard this would crash the process instead of raising
    code = """
import numpy as np
from flarewright.kernels.tracing.clip import blade_value

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


def test_a_linked_kernel_computes_what_numba_alone_computes(monkeypatch):
    alone, finished = [], JITCodeLibrary._finalize_specific

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

    monkeypatch.setattr(JITCodeLibrary, "_finalize_specific", count)
    values = np.linspace(0.0, 3.0, 40)
    ours = decorators.for_python(decorators.inner(folded))
    linked = njit(outer_of(decorators.inner(folded)))(values)
    assert sum("folded" in name for name in alone) == 0
    plain = njit(outer_of(njit(folded)))(values)
    assert sum("folded" in name for name in alone) == 1
    assert (linked, ours(4.0, 3)) == (plain, 5.0)
    with pytest.raises(ValueError, match=r"^nothing left$"):
        ours(4.0, 0)


@pytest.mark.slow
def test_linked_kernels_compute_what_numba_alone_computes():
    """The compiler's output depends on earlier compilations, so the same test also runs in a fresh process."""
    test = f"{__file__}::{test_a_linked_kernel_computes_what_numba_alone_computes.__name__}"
    words = [sys.executable, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", test]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
