"""The words of `--cluster`: local, local:4, tcp://HOST:PORT, slurm:FILE."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...errors import ProjectError

MOST_WORKERS = 1024
"""Largest number of worker processes on this machine."""

_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9a-fA-F:.%]+\]|[\w.-]+):(\d{1,5})", re.ASCII)
_FORMS = "local, local:4, tcp://HOST:PORT or slurm:FILE"


@dataclass(frozen=True)
class LocalChoice:
    """Worker processes on this machine.

    Attributes
    ----------
    workers : int or None
        None: as many as without a cluster.
    """

    workers: int | None = None


@dataclass(frozen=True)
class RunningChoice:
    """A Dask cluster that runs already.

    Attributes
    ----------
    address : str
        Of its scheduler: "tcp://HOST:PORT", or tls://.
    """

    address: str


@dataclass(frozen=True)
class SlurmChoice:
    """Workers in jobs of SLURM.

    Attributes
    ----------
    file : str
        TOML file of `slurm_file.SlurmSettings`.
    """

    file: str


def parse_cluster(text: str) -> LocalChoice | RunningChoice | SlurmChoice:
    """Return the cluster of a text.

    Raises
    ------
    ProjectError
        It is no cluster.

    Examples
    --------
    >>> parse_cluster("local:4"), parse_cluster("tcp://10.0.0.1:8786")
    (LocalChoice(workers=4), RunningChoice(address='tcp://10.0.0.1:8786'))
    """
    words = text.strip()
    kind, colon, rest = words.partition(":")
    if words == "local":
        return LocalChoice()
    if kind == "local":
        if not re.fullmatch(r"\d{1,9}", rest, re.ASCII) or not 1 <= int(rest) <= MOST_WORKERS:
            raise ProjectError(
                f"cluster {text[:120]!r}: {rest[:60]!r} is no number of worker processes from 1 to {MOST_WORKERS}; "
                "write for example local:4, or local for one per core"
            )
        return LocalChoice(int(rest))
    if kind == "slurm":
        if not rest.strip():
            raise ProjectError(f"cluster {text[:120]!r} names no file; write slurm:FILE, a TOML file of its settings")
        return SlurmChoice(rest.strip())
    if kind in ("tcp", "tls"):
        match = _ADDRESS.fullmatch(words)
        if match is None or not 1 <= int(match[1]) <= 65535:
            raise ProjectError(
                f"cluster {text[:120]!r} is no address of a Dask scheduler; write for example tcp://10.0.0.1:8786"
            )
        return RunningChoice(words)
    hint = f"tcp://{words}, " if colon and re.fullmatch(r"\d{1,5}", rest, re.ASCII) else ""
    raise ProjectError(f"cluster {text[:120]!r} is unknown; write {hint}{_FORMS}")
