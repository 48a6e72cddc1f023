"""The first run: two processes compile for one picture, and whatever happens to a helper, there is a picture.

A process costs half a second before it does anything, and a command whose cache is empty ten. So the fast tests watch
commands in this process, where all is compiled, and compile two small roots into an empty cache; the slow tests do the
same with whole commands, each in its process.
"""

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import nullcontext
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary

from flarewright.cli.app import run
from flarewright.io.exr import read_exr
from flarewright.kernels import _jit, first_run, helpers
from flarewright.kernels.first_run import ROOTS, compile_together, divided


@pytest.fixture(autouse=True)
def _helpers_may_start(monkeypatch):
    """Undo what tests/conftest.py does for all other tests."""
    monkeypatch.delenv("FLAREWRIGHT_HELPER", raising=False)


# a command, and what it compiled, loaded and was asked for
WATCHED = """
import json, sys
from flarewright.cli.app import run
from flarewright.kernels import first_run, helpers
helpers.cores = lambda: int(sys.argv[1])
import flarewright.render.first_run as plan
plan.cores = helpers.cores
planned = set()
together = plan.compile_together
plan.compile_together = lambda names, *others: (planned.update(names), together(names, *others))
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
        "planned": name in planned,
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


class _Watched:
    """A root that records the types of its calls."""

    def __init__(self, kernel):
        self.kernel, self.called = kernel, set()

    def __call__(self, *arguments):
        self.called.add(tuple(self.kernel.typeof_pyval(each) for each in arguments))
        return self.kernel(*arguments)

    def __getattr__(self, name):
        return getattr(self.kernel, name)


def _everywhere(one, other):
    """Put one object in the place of another in all modules of the package."""
    for module in [each for name, each in sys.modules.items() if name.partition(".")[0] == "flarewright"]:
        for name in [name for name, value in vars(module).items() if value is one]:
            setattr(module, name, other)


@pytest.fixture
def watched_here(monkeypatch):
    """Run a command in this process; returns what `watched` finds of each root but for what was compiled."""
    found = {name: _Watched(first_run.kernel(name)) for name in ROOTS if name != "draw masked"}
    planned = set()
    # as if nothing were compiled
    monkeypatch.setattr("flarewright.render.first_run.absent", list)
    monkeypatch.setattr("flarewright.render.first_run.compile_together", lambda names, *_: planned.update(names))
    monkeypatch.setattr("flarewright.cli.app.head_start", lambda rings: nullcontext())
    # scatter is gathered at a few places: which kernels are called does not depend on how many
    for name in ("RINGS", "SPOKES", "FAN"):
        monkeypatch.setattr(f"flarewright.render.scatter.{name}", 6)

    def command(*words):
        assert run(list(map(str, words))) == 0
        return {
            name: {
                "called": [str(types) for types in root.called],
                "expected": str(first_run.types(name)),
                "planned": name in planned,
            }
            for name, root in found.items()
        }

    for root in found.values():
        _everywhere(root.kernel, root)
    yield command
    for root in found.values():
        _everywhere(root, root.kernel)


SMALL = ("heliar-tronnier", "--ideal", "--light", "12,7", "--size", "64x36", "--wavelengths", "3", "--no-png")


@pytest.mark.slow
def test_a_cold_command_writes_what_a_warm_one_writes(tmp_path):
    cold, warm = tmp_path / "cold.exr", tmp_path / "warm.exr"
    roots, remarks = watched("render", *SMALL, "-o", cold, cores=2, cache=tmp_path / "cache")
    again, same_remarks = watched("render", *SMALL, "-o", warm)
    for one, other in zip(read_exr(cold).layers, read_exr(warm).layers, strict=True):
        assert one.name == other.name
        assert one.pixels.tobytes() == other.pixels.tobytes()
    first, *others = remarks.replace("cold.exr", "warm.exr").splitlines()
    assert first.startswith("flarewright: first run: the kernels are compiled once")
    assert others == same_remarks.splitlines()
    # the helper's share was loaded, this process compiled its own, and nobody anything else
    called = {name for name in roots if roots[name]["called"]}
    assert {name for name in roots if roots[name]["compiled"]} == called - {"mesh", "nodes", "prepass"}
    assert {name for name in again if again[name]["called"]} == called
    kernels = {path.name.split("-")[0] for path in (tmp_path / "cache").rglob("*.nbi")}
    assert kernels == {ROOTS[name][0] for name in called}


@pytest.mark.parametrize("size", ["64x36", pytest.param("192x108", marks=pytest.mark.slow)])
def test_what_a_command_calls_is_compiled_while_its_helper_works(size, tmp_path, request):
    # at seven wavelengths some ghosts are drawn at a few of them
    lens = ("heliar-tronnier", "--ideal", "--light", "12,7")
    words = ("render", *lens, "--size", size, "--no-png", "-o", tmp_path / "a.exr")
    if size == "64x36":
        roots = request.getfixturevalue("watched_here")(*words)
    else:
        roots, _ = watched(*words, cores=2, cache=tmp_path / "cache")
    assert roots["seen"]["called"]
    assert {name for name in roots if roots[name]["called"]} == {name for name in roots if roots[name]["planned"]}


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
@pytest.mark.parametrize("where", ["here", pytest.param("in its process", marks=pytest.mark.slow)])
def test_roots_are_called_with_the_types_that_the_table_says(words, unused, where, tmp_path, request):
    words = (*words, *([tmp_path / "a.exr"] if words[-1] == "-o" else []))
    roots = request.getfixturevalue("watched_here")(*words) if where == "here" else watched(*words)[0]
    assert any(root["called"] for root in roots.values())
    for name, root in roots.items():
        if name in unused:
            assert not root["called"], name
        elif root["called"]:
            assert root["expected"] in root["called"], name


SOME = ["double", "pixels"]


@pytest.fixture
def cold(tmp_path, monkeypatch):
    """Small roots as a process has them whose cache is empty."""
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache))
    monkeypatch.setattr(config, "CACHE_DIR", str(cache))
    fresh = {name: _jit.compiled(first_run.kernel(name).py_func) for name in SOME}
    monkeypatch.setattr(first_run, "kernel", fresh.__getitem__)
    # two small roots are worth a helper only where it costs nothing
    monkeypatch.setattr(first_run, "_START", 0.0)
    assert first_run.absent(SOME) == SOME
    return cache


def held():
    """Return of how many types this process has each small root, and what the cache lacks."""
    return [len(first_run.kernel(name).signatures) for name in SOME], first_run.absent(["pixels", "double"])


def pictures():
    """Return what the small roots make of two pictures, in bytes."""
    rng = np.random.default_rng(5)
    plane, fine = rng.random((4, 1, 3, 8), dtype=np.float32), np.empty((4, 6, 3), np.float32)
    first_run.kernel("pixels")(plane, fine)
    doubled = fine.copy()
    first_run.kernel("double")(rng.random((2, 3, 3), dtype=np.float32), doubled)
    return fine.tobytes(), doubled.tobytes()


def test_a_helper_fills_the_cache(request, capfd):
    warm = pictures()
    cache = request.getfixturevalue("cold")
    compile_together(SOME, 2)
    assert held() == ([1, 0], [])
    # the helper's share is loaded, this process has compiled its own, and nobody anything else
    assert pictures() == warm
    counts = {name: first_run.kernel(name).stats for name in SOME}
    assert {name: sum(each.cache_misses.values()) for name, each in counts.items()} == {"double": 1, "pixels": 0}
    assert sum(counts["pixels"].cache_hits.values()) == 1
    assert {path.name.split("-")[0] for path in cache.rglob("*.nbi")} == {ROOTS[name][0] for name in SOME}
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("how", ["no interpreter", "failing", "hanging", "not allowed"])
@pytest.mark.usefixtures("cold")
def test_without_its_helper_a_command_goes_on_alone(how, monkeypatch, capfd):
    def instead(code):
        return lambda share: subprocess.Popen([sys.executable, "-S", "-c", code], stdin=-1, stdout=-3, stderr=-3)

    if how == "no interpreter":
        monkeypatch.setattr(sys, "executable", "")
    elif how == "failing":
        monkeypatch.setattr(helpers, "start", instead("raise SystemExit(3)"))
    elif how == "hanging":
        monkeypatch.setattr(helpers, "PATIENCE_S", 0.2)
        monkeypatch.setattr(helpers, "start", instead("import time; time.sleep(600)"))
    else:

        def refuse(*arguments, **options):
            raise PermissionError("no processes here")

        monkeypatch.setattr(helpers.subprocess, "Popen", refuse)
    begun = time.monotonic()
    compile_together(SOME, 2)
    # its own share is compiled; the helper's waits for its first call
    assert held() == ([1, 0], ["pixels"])
    assert time.monotonic() - begun < 60.0
    assert capfd.readouterr() == ("", "")


TOGETHER = """
import sys
from flarewright.kernels import first_run, helpers
# two small roots are worth a helper only where it costs nothing
first_run._START = 0.0
if sys.argv[1] == "no interpreter":
    sys.executable = ""
elif sys.argv[1] == "failing":
    helpers.start = lambda share: helpers.subprocess.Popen(
        [sys.executable, "-c", "raise SystemExit(3)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "hanging":
    helpers.PATIENCE_S = 0.5
    helpers.start = lambda share: helpers.subprocess.Popen(
        [sys.executable, "-c", "import time; time.sleep(600)"], stdin=-1, stdout=-3, stderr=-3)
elif sys.argv[1] == "not allowed":
    def refuse(*arguments, **options):
        raise PermissionError("no processes here")
    helpers.subprocess.Popen = refuse
first_run.compile_together(["double", "pixels"], 2)
print([len(first_run.kernel(name).signatures) for name in ("double", "pixels")], first_run.absent(["pixels", "double"]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "told"),
    [("well", "[1, 0] []")]
    + [(how, "[1, 0] ['pixels']") for how in ("no interpreter", "failing", "hanging", "not allowed")],
)
def test_a_command_in_its_process_goes_on_with_and_without_its_helper(how, told, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", TOGETHER, how], capture_output=True, text=True, check=True, timeout=60,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
    )  # fmt: skip
    assert (done.stdout.strip(), done.stderr) == (told, "")


@pytest.mark.parametrize("seconds", [0.1, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_helper_ends_with_the_command(seconds, tmp_path, monkeypatch):
    """While it gets ready, and while it compiles: after all its work it would end with 0."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    helper = helpers.start(["mesh"])
    time.sleep(seconds)
    assert helper.poll() is None
    # what the system does when a process ends, however it ends
    helper.stdin.close()
    assert helper.wait(timeout=20) == 1


def test_nobody_helps_where_nothing_is_compiled(monkeypatch):
    def start(share):
        raise AssertionError("a process was started")

    monkeypatch.setattr(helpers, "start", start)
    # one process, a helper itself, a cache that holds all
    compile_together(SOME, 1)
    monkeypatch.setattr(first_run, "absent", lambda names: [])
    compile_together(SOME, 2)
    monkeypatch.setattr(first_run, "absent", list)
    monkeypatch.setenv("FLAREWRIGHT_HELPER", "1")
    compile_together(SOME, 2)


AHEAD = """
import sys
from pathlib import Path
from flarewright.kernels import first_run, helpers
helpers.cores = lambda: 2
helpers.TRACING = (("pixels",),)
with helpers.head_start():
    (helper,) = helpers.ahead()
    first_run.compile_together(["double", "pixels"], int(sys.argv[1]))
    print([len(first_run.kernel(name).signatures) for name in ("double", "pixels")], first_run.absent(["pixels"]))
print(helpers.ahead(), helper.process.poll() is not None)
index = Path(sys.argv[2])
index.parent.mkdir()
index.touch()
with helpers.head_start():
    print(helpers.ahead())
"""
# what Numba leaves of a compiled pre-pass
INDEX = f"kernels/prepass.find_box-57.py{sys.version_info.major}{sys.version_info.minor}.nbi"


@pytest.mark.parametrize("processes", [1, 2])
def test_a_head_start_is_made_use_of(processes, cold, monkeypatch):
    monkeypatch.setattr(helpers, "cores", lambda: 2)
    monkeypatch.setattr(helpers, "TRACING", (("pixels",),))
    if processes == 1:
        # the same process begins either way: of this one only the end is awaited, for a true helper costs half a second
        idle = [sys.executable, "-S", "-c", ""]
        monkeypatch.setattr(helpers, "start", lambda share: subprocess.Popen(idle, stdin=subprocess.PIPE))
    with helpers.head_start():
        (helper,) = helpers.ahead()
        assert helper.names == ("pixels",)
        compile_together(SOME, processes)
        # the command has waited for it
        assert helper.process.poll() == 0
        assert held() == ([1, 0], ["pixels"] if processes == 1 else [])
    assert helpers.ahead() == ()
    # and a second time nobody begins before the command knows better
    index = cold / INDEX
    index.parent.mkdir(exist_ok=True)
    index.touch()
    with helpers.head_start():
        assert helpers.ahead() == ()


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["1", "2"])
def test_a_head_start_is_made_use_of_by_a_process(processes, tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", AHEAD, processes, str(tmp_path / INDEX)],
        capture_output=True, text=True, check=True, timeout=60, env=environment,
    )  # fmt: skip
    # and a second time nobody begins before the command knows better
    assert done.stdout.splitlines() == ["[1, 0] []", "() True", "()"]


def test_a_head_start_needs_a_cold_cache_that_can_be_told(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert helpers._surely_cold()
    held = tmp_path / INDEX
    held.parent.mkdir()
    held.touch()
    assert not helpers._surely_cold()
    # of older sources
    os.utime(held, (0, 0))
    assert helpers._surely_cold()
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not helpers._surely_cold()
    monkeypatch.delenv("NUMBA_DISABLE_JIT")
    # Numba caches somewhere else, which only Numba knows
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert not helpers._surely_cold()


@pytest.mark.parametrize(("rings", "more"), [(False, set()), (True, {"draw", "densities"})])
def test_a_helper_draws_where_the_command_draws_rings(rings, more, monkeypatch):
    begun = []

    def start(share):
        begun.append(set(share))
        raise OSError

    monkeypatch.setattr(helpers, "start", start)
    monkeypatch.setattr(helpers, "_surely_cold", lambda: True)
    for cores in (2, 3):
        monkeypatch.setattr(helpers, "cores", lambda cores=cores: cores)
        with helpers.head_start(rings):
            pass
    assert begun == [{"mesh", "nodes", "prepass"} | more, {"mesh", "nodes"}, {"prepass"}]


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
def test_rings_are_told_by_the_words(words, rings, monkeypatch):
    asked = []
    monkeypatch.setattr("flarewright.cli.app.head_start", lambda rings: asked.append(rings) or nullcontext())
    monkeypatch.setattr("flarewright.cli.app._call", lambda words: 0)
    assert run(words.split()) == 0
    assert asked == [rings]


@pytest.mark.parametrize(
    "words", [["render", "--help"], ["lenses"], ["ghosts", "-h"], ["render", "no-such-lens", "--threads", "1"], []]
)
def test_commands_that_trace_nothing_start_nobody(words, monkeypatch, capsys):
    def begin():
        raise AssertionError("a process was started")

    monkeypatch.setattr("flarewright.cli.app.head_start", begin)
    assert run(words) in (0, 2)


def test_a_mistake_is_told_at_once_and_leaves_no_helper(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(helpers, "cores", lambda: 2)
    begun = []
    start = helpers.start
    monkeypatch.setattr(helpers, "start", lambda share: begun.append(start(share)) or begun[-1])
    assert run(["render", "no-such-lens", "--light", "1,2", "-o", str(tmp_path / "a.exr")]) == 2
    assert "no-such-lens" in capsys.readouterr().err
    assert [process.poll() is None for process in begun] == [False]


def test_where_nothing_is_compiled_nothing_is_absent(cold, monkeypatch):
    monkeypatch.setattr(config, "DISABLE_JIT", 1)
    plain = {name: _jit.compiled(first_run.kernel(name).py_func) for name in SOME}
    assert not any(hasattr(each, "py_func") for each in plain.values())
    assert _jit.inner(held) is held
    monkeypatch.setattr(first_run, "kernel", plain.__getitem__)
    assert first_run.absent(SOME) == []


@pytest.mark.slow
def test_python_without_a_compiler_has_nothing_absent(tmp_path):
    code = "from flarewright.kernels.first_run import absent; print(absent(['pixels', 'mesh']))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == "[]"


def test_a_kernel_works_where_nothing_can_be_cached(monkeypatch):
    def refuse(self):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr("numba.core.dispatcher.Dispatcher.enable_caching", refuse)
    kernel = _jit.compiled(first_run.kernel("pixels").py_func)
    monkeypatch.setattr(first_run, "kernel", lambda name: kernel)
    pixels = np.empty((1, 2, 3), np.float32)
    kernel(np.ones((1, 1, 3, 8), np.float32), pixels)
    assert (pixels.sum(), first_run.absent(["pixels"])) == (6.0, [])


@pytest.mark.slow
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


@pytest.mark.parametrize("where", ["here", pytest.param("in its process", marks=pytest.mark.slow)])
def test_a_kernel_is_compiled_anew_when_one_that_it_holds_has_changed(where, tmp_path, monkeypatch):
    package = tmp_path / "formulas"
    package.mkdir()
    for name in ("_jit", "_fresh", "_cached", "_compiler", "_inner"):
        shutil.copy(Path(first_run.__file__).with_name(f"{name}.py"), package)
    (package / "__init__.py").touch()
    held = package / "held.py"
    (package / "root.py").write_text(
        "from ._jit import compiled\nfrom .held import doubled\n\n@compiled\ndef root(x):\n    return doubled(x)\n"
    )
    code = "from formulas.root import root; print(root(1.0), sum(root.stats.cache_hits.values()))"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    # Python tells changed sources by whole seconds
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(tmp_path)

    def told(factor: float) -> str:
        text = f"from ._jit import inlined\n\n@inlined\ndef doubled(x):\n    return {factor:.2f} * x\n"
        if not held.exists() or held.read_text() != text:
            held.write_text(text)
        if where != "here":
            done = subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment, cwd=tmp_path
            )
            return done.stdout.strip()
        try:
            root = importlib.import_module("formulas.root").root
            return f"{root(1.0)} {sum(root.stats.cache_hits.values())}"
        finally:
            for name in [name for name in sys.modules if name.partition(".")[0] == "formulas"]:
                del sys.modules[name]

    assert [told(2.0), told(2.0), told(3.0)] == ["2.0 0", "2.0 1", "3.0 0"]


@pytest.mark.parametrize(
    "path", sorted(Path(first_run.__file__).parent.glob("measure_*.py")), ids=lambda path: path.stem
)
def test_what_python_calls_no_kernel_calls(path):
    """A fit's last bits make other ghosts: they must not depend on whether its kernels were compiled or loaded."""
    module = importlib.import_module(f"flarewright.kernels.{path.stem}")
    own = [each for each in vars(module).values() if hasattr(each, "py_func") and each.__module__ == module.__name__]
    assert own
    for kernel in own:
        used = [kernel.py_func.__globals__.get(name) for name in kernel.py_func.__code__.co_names]
        called = [each for each in used if hasattr(each, "py_func")]
        assert not [each for each in called if isinstance(each._cache, FunctionCache)], kernel


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


def test_python_cannot_call_a_kernel_of_kernels():
    def half(x):
        return 0.5 * x

    kernel = _jit.inner(half)
    for _ in range(2):
        for _ in range(2):
            with pytest.raises(TypeError, match=r"^half is for kernels; Python may call its py_func$"):
                kernel(3.0)
        kernel.compile("(f8,)")
    assert kernel.py_func(3.0) == 1.5


@pytest.mark.slow
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


def test_a_linked_kernel_says_what_numba_alone_says(monkeypatch):
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
    ours = _jit.for_python(_jit.inner(folded))
    linked = njit(outer_of(_jit.inner(folded)))(values)
    assert sum("folded" in name for name in alone) == 0
    plain = njit(outer_of(njit(folded)))(values)
    assert sum("folded" in name for name in alone) == 1
    assert (linked, ours(4.0, 3)) == (plain, 5.0)
    with pytest.raises(ValueError, match=r"^nothing left$"):
        ours(4.0, 0)


@pytest.mark.slow
def test_linked_kernels_say_what_numba_alone_says():
    """What the compiler makes depends on what it has made before, so the same test runs in a process of its own."""
    test = f"{__file__}::{test_a_linked_kernel_says_what_numba_alone_says.__name__}"
    words = [sys.executable, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", test]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
