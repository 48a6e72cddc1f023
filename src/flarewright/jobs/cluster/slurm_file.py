"""Settings of SLURM jobs whose processes are workers, and their TOML file (docs/many-machines.md)."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator

from ...errors import ProjectError, raised_as
from ...io.files.text_file import read_toml
from ...io.files.type_slips import record_of
from ...model.base import Frozen
from ...sentences import summary

# SLURM's own forms: 90, 1:30:00, 2-12:00:00
_WALLTIME = re.compile(r"(\d{1,4}-)?\d{1,4}(:\d{1,2}){0,2}", re.ASCII)
_MEMORY = re.compile(r"\d+(\.\d+)?\s?[KMGT]i?B", re.ASCII)
_Line = Annotated[str, Field(min_length=1, max_length=1000)]
_Lines = Annotated[tuple[_Line, ...], Field(max_length=100)]


class SlurmSettings(Frozen):
    """Jobs of SLURM, each with worker processes of one thread.

    Attributes
    ----------
    jobs : int
        Number of jobs; a job that ends early is submitted again.
    cores : int
        Of a job; as many worker processes start in it.
    memory : str
        Of a job: "32GB".
    walltime : str
        Longest time of a job: "02:00:00".
    queue, account : str, optional
        Partition and account.
    interface : str, optional
        Network interface of workers and scheduler, such as "ib0".
    python : str, optional
        Interpreter on the nodes; None: the one that runs the command.
    local_directory : str, optional
        Folder on a node for temporary files.
    log_directory : str, optional
        Folder of the jobs' output.
    prologue : tuple of str
        Lines of shell before the workers start, such as "module load python".
    directives : tuple of str
        Further options of `sbatch`, such as "--exclusive".
    """

    jobs: int = Field(ge=1, le=100_000)
    cores: int = Field(ge=1, le=4096)
    memory: str
    walltime: str = "01:00:00"
    queue: _Line | None = None
    account: _Line | None = None
    interface: _Line | None = None
    python: _Line | None = None
    local_directory: _Line | None = None
    log_directory: _Line | None = None
    prologue: _Lines = ()
    directives: _Lines = ()

    @field_validator("memory")
    @classmethod
    def _check_memory(cls, text: str) -> str:
        if not _MEMORY.fullmatch(text):
            raise ValueError('is no amount of memory; write for example "32GB"')
        return text

    @field_validator("walltime")
    @classmethod
    def _check_walltime(cls, text: str) -> str:
        if not _WALLTIME.fullmatch(text):
            raise ValueError('is no time of SLURM; write for example "02:00:00", two hours')
        return text

    @field_validator("queue", "account", "interface", "python", "local_directory", "log_directory")
    @classmethod
    def _check_words(cls, text: str | None) -> str | None:
        # a line of the job's script
        if text is not None and any(not char.isprintable() for char in text):
            raise ValueError("has a line break or control character; remove it")
        return text


def read_slurm_settings(path: str | os.PathLike[str]) -> SlurmSettings:
    """Read and check a file of settings.

    Parameters
    ----------
    path : path
        A TOML file.

    Raises
    ------
    ProjectError
        When the file cannot be read or has errors; `problems` then lists all of them.

    Examples
    --------
    >>> read_slurm_settings("farm.toml").jobs                                           # doctest: +SKIP
    10
    """
    with raised_as(ProjectError):
        data = read_toml(Path(path), "a file of SLURM settings")
    settings, problems = record_of(SlurmSettings.model_validate, data)
    if settings is None:
        raise ProjectError(summary(str(path), problems), tuple(problems))
    return settings
