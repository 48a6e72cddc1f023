"""Common ground of all tests: helpers importable by name, and one cache of compiled kernels that fits the sources."""

import hashlib
import os
import sys
import tempfile
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / part) for part in ("physics", "design", "measure", "predict")]

# Numba notices a changed kernel but not a changed kernel that it calls, so the cache is named after all their sources
_sources = sorted((HERE.parent / "src" / "flarewright" / "kernels").rglob("*.py"))
_digest = hashlib.sha256(b"".join(path.read_bytes() for path in _sources)).hexdigest()[:16]
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / f"flarewright-kernels-{_digest}"))
# as for the command line: the program's own threads share the work, and others beside them would spin
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# what a command lacks is compiled by the test's process, once for all; tests/contracts has helpers (docs/adr/0007)
os.environ.setdefault("FLAREWRIGHT_HELPER", "1")


@contextmanager
def _locked(path):
    """Hold a file's lock, which ends with the process at the latest; where the system has none, hold nothing."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with path.open("ab") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield


def pytest_configure(config):
    """Have each kernel compiled by one process; the others wait for it and load its machine code.

    Numba also reads, changes and writes the index of a kernel without a lock, so that two processes that compile the
    same kernel for other types can lose each other's code.
    """
    if config.getoption("numprocesses", default=None) and not hasattr(config, "workerinput"):
        # the process that only hands out tests compiles nothing
        return
    from numba.core.dispatcher import Dispatcher

    compile_alone = Dispatcher.compile

    def compile_once(self, sig):
        if self._cache.cache_path is None:
            # nothing of it is cached: its callers hold its code
            return compile_alone(self, sig)
        index = Path(self._cache._cache_file._index_path)
        index.parent.mkdir(parents=True, exist_ok=True)
        with _locked(index.with_suffix(".lock")):
            return compile_alone(self, sig)

    Dispatcher.compile = compile_once


@pytest.fixture(scope="session", autouse=True)
def _one_tree_of_commands():
    """Keep the commands that Typer builds at every call: building them costs more than most commands of the tests do.

    Tests that start a process, as `test_the_package_runs_as_a_module`, build the tree as a user's process does.
    """
    import typer.main

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield
