"""Compare the workers of a cluster with this process: versions, and folders that all of them see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...errors import FlarewrightError
from ...sentences import listed
from .worker_side import Facts

# workers that a sentence names
_NAMED = 3
# answers of a worker without this module, as Dask words them: it has no Flarewright, or an older one
_UNKNOWN = ("ModuleNotFoundError", "ImportError", "AttributeError")


def refuse_other_versions(here: Facts, workers: Mapping[str, Any]) -> None:
    """Raise an error if a worker has no Flarewright, or another version.

    Parameters
    ----------
    here : Facts
    workers : mapping of str to Facts or Exception
        What each worker answered, by address.

    Raises
    ------
    FlarewrightError
        The sentence names the first workers, and their version.
    """
    lacking: dict[str, list[str]] = {}
    for address, found in workers.items():
        if isinstance(found, Exception) and str(found).startswith(_UNKNOWN):
            lacking.setdefault("no flarewright, or a version without clusters", []).append(address)
        elif isinstance(found, BaseException):
            raise FlarewrightError(
                f"the worker {address} does not answer ({str(found)[:120] or type(found).__name__}); restart it"
            )
        elif found.flarewright != here.flarewright:
            lacking.setdefault(f"flarewright {found.flarewright}", []).append(f"{address} on {found.host}")
    for have, addresses in lacking.items():
        raise FlarewrightError(
            f"{_listed('worker', addresses)} {'have' if len(addresses) > 1 else 'has'} {have}, and this machine "
            f"{here.flarewright}; install version {here.flarewright} there, and restart {_them(addresses)}"
        )


def differences(here: Facts, workers: Sequence[Facts]) -> list[str]:
    """Return remarks on other differences, each with its values; the last bits of pixels can depend on them.

    Examples
    --------
    >>> differences(Facts("1", {"numpy": "2.1"}, "a", 1), [Facts("1", {"numpy": "2.2"}, "b", 2)])
    ['numpy is 2.1 here and 2.2 on 1 of 1 workers; the last bits of pixels can differ']
    """
    found = []
    for name, value in here.versions.items():
        others = [each.versions.get(name, "missing") for each in workers if each.versions.get(name) != value]
        if others:
            values = ", ".join(sorted(set(others))[:_NAMED])
            found.append(
                f"{name} is {value} here and {values} on {len(others)} of {len(workers)} workers; the last bits of "
                "pixels can differ"
            )
    return found


def check_threads(threads: Mapping[str, int], address: str) -> None:
    """Raise an error for workers of several threads: an item occupies a process.

    Parameters
    ----------
    threads : mapping of str to int
        Of each worker, by address.
    address : str
        Of the scheduler.
    """
    wide = [worker for worker, number in threads.items() if number > 1]
    if wide:
        number = threads[wide[0]]
        raise FlarewrightError(
            f"{_listed('worker', wide)} {'have' if len(wide) > 1 else 'has'} {number} threads, and a process works off "
            f"one item at a time; restart with: dask worker {address} --nworkers {number} --nthreads 1"
        )


def _listed(noun: str, names: Sequence[str]) -> str:
    return f"{noun}{'s'[: len(names) > 1]} {listed(names, _NAMED)}"


def _them(names: Sequence[str]) -> str:
    return "them" if len(names) > 1 else "it"
