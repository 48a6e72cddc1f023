"""Setup of all tests: helper modules importable by name, and a cache of compiled kernels for the current sources."""

import atexit
import gc
import hashlib
import os
import shutil
import signal
import sys
import tempfile
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

HERE = Path(__file__).parent
# helpers lie beside the tests of their folder; module names are unique
sys.path[:0] = sorted({str(path.parent) for path in HERE.rglob("*.py")} - {str(HERE)})
# what judges a fit is in benchmarks/
sys.path.append(str(HERE.parent))

# Numba notices a changed kernel but not a changed callee, so the name of the cache folder is a digest of all kernels
_sources = sorted((HERE.parent / "src" / "flarewright" / "kernels").rglob("*.py"))
_digest = hashlib.sha256(b"".join(path.read_bytes() for path in _sources)).hexdigest()[:16]
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / f"flarewright-kernels-{_digest}"))
# as on the command line: the program shares its work among its threads, and BLAS threads would only spin beside them
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# as on the command line: the imported modules live until the end
gc.set_threshold(100_000)
# the developer's own library of lenses is no part of a test
if "FLAREWRIGHT_STATE" not in os.environ:
    os.environ["FLAREWRIGHT_STATE"] = tempfile.mkdtemp(prefix="flarewright-tests-")
    atexit.register(shutil.rmtree, os.environ["FLAREWRIGHT_STATE"], ignore_errors=True)
# a shell ignores Ctrl-C for what it starts in the background, and the tests press it
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# the test process compiles missing kernels itself, without helpers; tests/contracts tests the helpers (docs/adr/0007)
os.environ.setdefault("FLAREWRIGHT_HELPER", "1")


@contextmanager
def _locked(path, mode="ab"):
    """Hold a lock on a file, which the system releases when the process ends; without `fcntl` hold none."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with path.open(mode) as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield


def pytest_configure(config):
    """Let one process compile each kernel; the others wait for it and load its machine code.

    Numba reads, changes and writes a kernel's cache index without a lock: two processes that compile the same kernel
    for different types can lose each other's code.
    """
    if config.getoption("numprocesses", default=None) and not hasattr(config, "workerinput"):
        # the controller process of pytest-xdist compiles nothing
        return
    from numba.core.dispatcher import Dispatcher

    from flarewright.kernels.jit.warmup import without_garbage_collection

    compile_alone = without_garbage_collection()(Dispatcher.compile)

    def compile_once(self, sig):
        if self._cache.cache_path is None:
            # an inner kernel: not cached, its code is in its callers
            return compile_alone(self, sig)
        index = Path(self._cache._cache_file._index_path)
        index.parent.mkdir(parents=True, exist_ok=True)
        with _locked(index.with_suffix(".lock")):
            return compile_alone(self, sig)

    Dispatcher.compile = compile_once


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let one process rewrite the assertions of a file of tests; the others wait for it and load its byte code."""
    if not isinstance(collector, pytest.Module) or sys.dont_write_bytecode:
        return (yield)
    with _locked(collector.path, "rb"):
        return (yield)


# folders whose tests call the same kernels lie together: first those that draw, last those that measure
ORDER = (
    "render", "physics", "kernels/tracing", "kernels/raster", "kernels/paraxial", "golden", "predict", "optics", "cli",
    "workflow", "editor", "bridges", "plates", "jobs", "trust", "io", "contracts", "kernels", "design", "measure",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    """Sort the tests by `ORDER`; those of other folders come last."""
    places = {HERE / name: place for place, name in enumerate(ORDER)}
    items.sort(key=lambda item: min((places[one] for one in item.path.parents if one in places), default=len(ORDER)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Deal files out from both ends of the order, so that processes compile and load different kernels."""
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class FromBothEnds(LoadFileScheduling):
        def _assign_work_unit(self, node):
            if self.nodes.index(node) % 2 == 1:
                self.workqueue.move_to_end(next(reversed(self.workqueue)), last=False)
            super()._assign_work_unit(node)

    return FromBothEnds(config, log)


def pytest_collection_finish():
    """Exclude the collected tests from garbage collection, at the end of the process as well: they stay until then."""
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _one_tree_of_commands():
    """Cache the commands of each first word, as the program and as Typer build them: longer than most commands take.

    Typer builds the check of an option when it first reads it. Tests that start a process, such as
    `test_the_package_runs_as_a_module`, build everything as a user's process does.
    """
    import typer.main

    from flarewright.cli import app, command_tree

    trees = cache(command_tree.command_tree)
    first_words = {command.words.split()[0] for command in command_tree.COMMANDS}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "command_tree", lambda words: trees(tuple(one for one in words[:1] if one in first_words)))
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield


@pytest.fixture
def default_signals(monkeypatch):
    """Give the signals that end a command their default handlers during a test; none has been received."""
    monkeypatch.setattr("flarewright.cli.common._received", [])
    before = [(one, signal.signal(one, signal.SIG_DFL)) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    yield
    for one, handler in before:
        signal.signal(one, handler)
