"""Files of compiled kernels with digests: a fault of the cache costs a compilation, never a run.

Numba unpickles whatever it finds: an empty file raises EOFError, which a command line takes for an interruption, and a
flipped bit in machine code is executed. Here each file holds a digest of its contents. A file that does not match is
removed and its kernel compiled again; a file that cannot be written is left out. One sentence on stderr names the path.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.caching import IndexDataCacheFile
from numba.core.serialize import dumps

# Numba's stubs do not know these
_File: Any = IndexDataCacheFile
_config: Any = config
_dumps: Callable[[Any], bytes] = dumps

# first bytes of our files, and of files that Numba writes itself (a pickle)
_HEAD, _NUMBAS = b"flarewright kernel 1\n", b"\x80"
_DIGEST = sha256().digest_size
# faults that this process has reported
_reported: set[str] = set()


class CheckedFile(_File):  # type: ignore[misc]
    """Index and machine code of one kernel, each in a file with a digest.

    A file holds the digest of its body. The body holds Numba's version and the stamp of the sources, by which an
    obsolete file is recognised before its contents are unpickled, and the contents.
    """

    def save(self, key: Any, data: Any) -> None:
        """Write the machine code with its key: a rewritten index may refer to a file of another key."""
        super().save(key, (key, data))

    def load(self, key: Any) -> Any:
        """Return the machine code of a key, or None."""
        found = super().load(key)
        return found[1] if found is not None and found[0] == key else None

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._put(self._index_path, overloads)

    def _load_index(self) -> dict[Any, str]:
        return self._get(self._index_path) or {}

    def _save_data(self, name: str, data: Any) -> None:
        self._put(self._data_path(name), data)

    def _load_data(self, name: str) -> Any:
        return self._get(self._data_path(name))

    def _put(self, path: str, contents: Any) -> None:
        body = pickle.dumps((self._version, self._source_stamp, _dumps(contents)), protocol=-1)
        with self._open_for_write(path) as file:
            file.write(_HEAD + sha256(body).digest() + body)

    def _get(self, path: str) -> Any:
        """Return the contents of a file; None if it is missing, obsolete or damaged."""
        try:
            data = Path(path).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            _report_damage(path, (error.strerror or str(error)).lower())
            return None
        start = len(_HEAD) + _DIGEST
        if not data.startswith(_HEAD) or sha256(data[start:]).digest() != data[len(_HEAD) : start]:
            # releases before this format wrote Numba's
            if not data.startswith(_NUMBAS):
                _report_damage(path, "damaged")
            _remove(path)
            return None
        version, stamp, contents = pickle.loads(data[start:])
        return pickle.loads(contents) if (version, stamp) == (self._version, self._source_stamp) else None


def check_files(kernel: Any) -> None:
    """Make a kernel keep its code in a `CheckedFile`, and compile wherever its cache fails.

    Parameters
    ----------
    kernel : dispatcher
        Changed in place.
    """
    cache = kernel._cache
    plain = cache._cache_file
    cache._cache_file = checked = CheckedFile(cache.cache_path, "", plain._source_stamp)
    checked._index_path, checked._data_name_pattern = plain._index_path, plain._data_name_pattern
    load, save = cache.load_overload, cache.save_overload
    if (chosen := _config.CACHE_DIR) and not Path(cache.cache_path).is_relative_to(chosen):
        report(
            "folder",
            f"the folder {chosen} of NUMBA_CACHE_DIR cannot be written; compiled kernels are kept in "
            f"{cache.cache_path} instead",
        )

    def load_overload(sig: Any, target_context: Any) -> Any:
        try:
            return load(sig, target_context)
        except Exception as error:
            # machine code that Numba cannot load, though it is what was written
            _report_damage(checked._index_path, f"unusable ({type(error).__name__})")
            _remove(checked._index_path)
            return None

    def save_overload(sig: Any, data: Any) -> None:
        try:
            save(sig, data)
        except OSError as error:
            reason = (error.strerror or str(error) or type(error).__name__).lower()
            report(
                "full",
                f"compiled kernels cannot be kept in {cache.cache_path} ({reason}): the next run compiles again; free "
                "some space, or set NUMBA_CACHE_DIR to another folder",
            )

    cache.load_overload, cache.save_overload = load_overload, save_overload


def report_no_folder() -> None:
    """Report that no folder for compiled kernels can be written."""
    beside = Path(__file__).parents[1]
    tried = f"NUMBA_CACHE_DIR ({_config.CACHE_DIR})" if _config.CACHE_DIR else f"{beside} and the user's cache folder"
    report("none", f"compiled kernels cannot be kept, as {tried} cannot be written: every run compiles again; set "
                   "NUMBA_CACHE_DIR to a folder that can be written")  # fmt: skip


def report(fault: str, sentence: str) -> None:
    """Print a sentence to stderr, once for each fault."""
    if fault in _reported:
        return
    _reported.add(fault)
    # stderr may be absent or closed
    with suppress(OSError, ValueError):
        if sys.stderr is not None:
            print(f"flarewright: {sentence}", file=sys.stderr)


def _report_damage(path: str, what: str) -> None:
    report("damage", f"{path} in the cache of compiled kernels is {what}; its kernel is compiled again")


def _remove(path: str) -> None:
    with suppress(OSError):
        os.remove(path)
