"""Connections with the scheduler of a cluster: of this machine, a running one, or one whose workers are jobs."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from ...errors import FlarewrightError, optional
from .choice import LocalChoice, RunningChoice, SlurmChoice
from .local_workers import LocalWorkers
from .slurm_file import SlurmSettings
from .worker_side import LocalWorker

# time for a scheduler to answer, for the first worker of a running cluster, and without any worker later
_ANSWER_S, _FIRST_WORKER_S, _NO_WORKER_S = 5.0, 20.0, 300.0
# time for SLURM to judge a job
_SLURM_S = 60.0
# time to leave a cluster
_LEAVE_S = 5.0
# time after which a silent local worker counts as lost: never, for its process is watched, and an item can take hours
_SILENT_S = 1e8
# time between two announcements that jobs wait
_WAITING_S = 60.0


class Connection(Protocol):
    """A client with what is known about its workers."""

    client: Any

    def grow(self, workers: int, threads: int | None) -> None:
        """Have at least this number of workers if they are ours."""
        ...

    def watch(self) -> None:
        """Check the workers while items are worked off; raise FlarewrightError if there are none that can."""
        ...

    def note_result(self) -> None:
        """Note a finished item."""
        ...

    def close(self) -> None:
        """Leave the cluster, and end what was started for it."""
        ...


def connect(
    choice: LocalChoice | RunningChoice | SlurmChoice, settings: SlurmSettings | None, announce: Callable[[str], None]
) -> Connection:
    """Connect with a cluster.

    Parameters
    ----------
    choice : LocalChoice, RunningChoice or SlurmChoice
    settings : SlurmSettings or None
        Those in the file of a SlurmChoice.
    announce : callable
        Receives the dashboard's address, and what happens to workers, a sentence each.

    Raises
    ------
    FlarewrightError
        A package is missing, or there is no such cluster.
    """
    match choice:
        case LocalChoice():
            return LocalConnection(announce)
        case RunningChoice():
            return RunningConnection(choice.address, announce)
        case SlurmChoice():
            assert settings is not None
            return SlurmConnection(choice.file, settings, announce)


class LocalConnection:
    """A scheduler in this process, with worker processes of this machine; no other account can connect.

    Parameters
    ----------
    announce : callable
    """

    def __init__(self, announce: Callable[[str], None]) -> None:
        distributed = optional("distributed", "cluster", "--cluster")
        security = _own_security(distributed)
        self._scratch = tempfile.TemporaryDirectory(prefix="flarewright-", ignore_cleanup_errors=True)
        try:
            self._cluster = distributed.LocalCluster(
                n_workers=0, processes=True, security=security, host="127.0.0.1", dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL + 1, scheduler_kwargs={"worker_ttl": _SILENT_S},
            )  # fmt: skip
        # no free port, or no permission to open one
        except Exception as error:
            self._scratch.cleanup()
            raise FlarewrightError(
                f"no local cluster can be started{_reason(error)}; omit --cluster for plain processes"
            ) from None
        self.client = distributed.Client(self._cluster, security=security, set_as_default=False)
        start = LocalWorker(self._cluster.scheduler_address, security, 0, self._scratch.name)
        self._workers = LocalWorkers(start, announce)
        _announce_dashboard(self._cluster, announce)

    def grow(self, workers: int, threads: int | None) -> None:
        """Start worker processes until there are as many."""
        self._workers.grow(workers, threads)

    def watch(self) -> None:
        """Replace worker processes that were lost."""
        self._workers.watch()

    def note_result(self) -> None:
        """Note that a worker has finished an item."""
        self._workers.note_result()

    def close(self) -> None:
        """End the workers first: they finish the files that they write."""
        try:
            self._workers.end()
        finally:
            _leave(self.client)
            with suppress(Exception):
                self._cluster.close(timeout=_LEAVE_S)
            self._scratch.cleanup()


class RunningConnection:
    """A Dask cluster that runs already; it is left as it was.

    Parameters
    ----------
    address : str
    announce : callable
    """

    def __init__(self, address: str, announce: Callable[[str], None]) -> None:
        distributed = optional("distributed", "cluster", "--cluster")
        try:
            self.client = distributed.Client(address, timeout=_ANSWER_S, set_as_default=False)
        # Dask wraps the reasons in exceptions of several kinds
        except Exception as error:
            raise FlarewrightError(
                f"no Dask scheduler answers at {address} within {_ANSWER_S:g} s{_reason(error)}; start one with: "
                "dask scheduler"
            ) from None
        self._address = address
        self._link(announce)
        self._await_worker()
        self._alone_since: float | None = None

    def _link(self, announce: Callable[[str], None]) -> None:
        with suppress(Exception):
            if link := self.client.dashboard_link:
                announce(f"dashboard of the cluster: {link}")

    def _await_worker(self) -> None:
        try:
            self.client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
        except Exception:
            _leave(self.client)
            raise FlarewrightError(
                f"the cluster at {self._address} has no workers; start some with: dask worker {self._address} "
                "--nworkers auto --nthreads 1"
            ) from None

    def grow(self, workers: int, threads: int | None) -> None:
        """Do nothing: the workers are not ours."""

    def watch(self) -> None:
        """Raise an error if the scheduler is gone, or has no worker for minutes."""
        if self.client.status not in ("running", "connecting"):
            raise FlarewrightError(
                f"the connection with the cluster at {self._address} is lost; finished work is kept: repeat the command"
            )
        # a connection that breaks meanwhile is found by its state later
        with suppress(Exception):
            if self.client.status == "running" and self.client.nthreads():
                self._alone_since = None
                return
        now = time.monotonic()
        self._alone_since = now if self._alone_since is None else self._alone_since
        if now - self._alone_since > _NO_WORKER_S:
            raise FlarewrightError(
                f"the cluster at {self._address} has had no workers for {_NO_WORKER_S:.0f} s; finished work is kept: "
                "start workers, and repeat the command"
            )

    def note_result(self) -> None:
        """Do nothing: a result proves nothing about other workers."""

    def close(self) -> None:
        """Leave the cluster."""
        _leave(self.client)


class SlurmConnection:
    """A scheduler in this process, with workers in jobs of SLURM; lost jobs are submitted again.

    Parameters
    ----------
    file : str
        The file of the settings, for messages.
    settings : SlurmSettings
    announce : callable
    """

    def __init__(self, file: str, settings: SlurmSettings, announce: Callable[[str], None]) -> None:
        distributed = optional("distributed", "cluster", "--cluster")
        jobqueue = optional("dask_jobqueue", "slurm", "--cluster slurm")
        if missing := [name for name in ("sbatch", "scancel") if shutil.which(name) is None]:
            raise FlarewrightError(
                f"the command {missing[0]} is not on this machine; run on a machine that submits jobs to SLURM"
            )
        # the jobs read the keys of the connection here; only this account can
        self._keys = tempfile.TemporaryDirectory(prefix=".flarewright-", dir=os.getcwd(), ignore_cleanup_errors=True)
        security = _in_files(distributed, _own_security(distributed), Path(self._keys.name))
        self._announce = announce
        try:
            self._cluster = jobqueue.SLURMCluster(
                cores=settings.cores, processes=settings.cores, memory=settings.memory, walltime=settings.walltime,
                queue=settings.queue, account=settings.account, interface=settings.interface, python=settings.python,
                local_directory=settings.local_directory, log_directory=settings.log_directory,
                job_script_prologue=list(settings.prologue), job_extra_directives=list(settings.directives),
                job_name="flarewright", security=security, protocol="tls://",
                scheduler_options={"dashboard_address": "127.0.0.1:0"}, silence_logs=logging.CRITICAL + 1,
            )  # fmt: skip
        except Exception as error:
            self._keys.cleanup()
            raise FlarewrightError(f"{file}: these settings cannot be used{_reason(error)}; check them") from None
        self.client = distributed.Client(self._cluster, security=security, set_as_default=False)
        _announce_dashboard(self._cluster, announce)
        try:
            _check_accepted(self._cluster.job_script(), file)
            self._cluster.adapt(minimum_jobs=settings.jobs, maximum_jobs=settings.jobs)
            self._await_worker(settings.jobs)
        except BaseException:
            self.close()
            raise

    def _await_worker(self, jobs: int) -> None:
        """Wait without a limit: a queue can be long."""
        announced = time.monotonic()
        while not self.client.nthreads():
            time.sleep(0.5)
            if time.monotonic() - announced > _WAITING_S:
                self._announce(f"waiting for the first of {jobs} jobs of SLURM to start")
                announced = time.monotonic()

    def grow(self, workers: int, threads: int | None) -> None:
        """Do nothing: the settings have the number of jobs."""

    def watch(self) -> None:
        """Do nothing: lost jobs are submitted again."""

    def note_result(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Cancel the jobs."""
        _leave(self.client)
        with suppress(Exception):
            self._cluster.close(timeout=_LEAVE_S)
        # after an error of SLURM the end of the process would try again, and print it
        self._cluster.shutdown_on_close = False
        self._keys.cleanup()


def _announce_dashboard(cluster: Any, announce: Callable[[str], None]) -> None:
    if find_spec("bokeh") is not None:
        announce(f"dashboard of the cluster: {cluster.dashboard_link}")


def _own_security(distributed: Any) -> Any:
    """Return new keys, so that only processes of this account connect: who connects can run programs."""
    optional("cryptography", "cluster", "--cluster")
    return distributed.Security.temporary()


def _check_accepted(script: str, file: str) -> None:
    """Raise an error if SLURM would not accept a job; Dask only logs what it answers to a submission."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "job.sh"
        path.write_text(script, encoding="utf-8")
        try:
            done = subprocess.run(
                ["sbatch", "--test-only", str(path)], capture_output=True, text=True, timeout=_SLURM_S, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise FlarewrightError(f"SLURM does not answer to sbatch --test-only ({error}); try again later") from None
    if done.returncode:
        words = " ".join(done.stderr.split()).removeprefix("sbatch: error: ")
        raise FlarewrightError(f"{file}: SLURM does not accept such a job ({words[:160]}); change the settings")


def _in_files(distributed: Any, security: Any, folder: Path) -> Any:
    """Return keys as paths of files, which only this account can read, for workers that start elsewhere."""
    paths = {}
    for name in ("tls_ca_file", "tls_worker_cert", "tls_worker_key"):
        path = folder / f"{name}.pem"
        path.touch(mode=0o600)
        path.write_text(getattr(security, name), encoding="ascii")
        paths[name] = str(path)
    roles = {
        f"tls_{role}_{kind}": paths[f"tls_worker_{kind}"]
        for role in ("client", "scheduler", "worker")
        for kind in ("cert", "key")
    }
    return distributed.Security(require_encryption=True, tls_ca_file=paths["tls_ca_file"], **roles)


def _leave(client: Any) -> None:
    with suppress(Exception):
        client.close(timeout=_LEAVE_S)


def _reason(error: BaseException) -> str:
    """Return the cause of an error of Dask in parentheses; empty if it has no words."""
    while error.__cause__ is not None:
        error = error.__cause__
    words = " ".join(str(error).split())[:160].rstrip(".:")
    return f" ({words})" if words else ""
