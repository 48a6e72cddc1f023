"""All commands that can run longer than a minute, with the file that keeps their partial work and how they resume.

The command line words its message after an interruption by this list, and `tests/trust` kills every job of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

SAME = "the same command"


@dataclass(frozen=True)
class LongJob:
    """A command that keeps its partial work, also when it is killed.

    Attributes
    ----------
    words : tuple of str
        The command.
    keeps : str
        File with the partial work, in the words of the help.
    resume : str
        Command that resumes.
    """

    words: tuple[str, ...]
    keeps: str
    resume: str = SAME


JOBS = (
    LongJob(("design", "solve"), "DIR/search.json", "flarewright design resume DIR"),
    LongJob(("design", "resume"), "DIR/search.json", "flarewright design resume DIR"),
    LongJob(("design", "scratch"), "DIR/search.json", "flarewright design resume DIR"),
    LongJob(("design", "colors"), "LENS.partial.json"),
    LongJob(("design", "benchmark"), "NAME.partial.json"),
    LongJob(("measure", "run"), "DIR/frames, DIR/STAGE.journal"),
    LongJob(("measure", "merge"), "DIR/frames"),
    LongJob(("measure", "find"), "DIR/find.journal"),
    LongJob(("measure", "fit"), "DIR/fit.journal"),
    LongJob(("measure", "track"), "DIR/track.journal"),
    LongJob(("measure", "compress"), "DIR/compress.journal"),
    LongJob(("measure", "explain"), "DIR/search.json"),
    LongJob(("ghosts",), "the state folder's `partial`"),
    LongJob(("predict",), "NAME.partial.npz"),
    LongJob(("render",), "NAME.partial, NAME.state.npz", "the same command, or --resume NAME.state.npz"),
    LongJob(("shot",), "the finished frames"),
    LongJob(("film",), "FILM.parts"),
    LongJob(("dataset",), "the finished items"),
    LongJob(("sources",), "NAME.lights.npz"),
    LongJob(("gallery",), "DIR/gallery.json"),
    LongJob(("library", "add"), "the library"),
    LongJob(("library", "thumbnails"), "the library"),
    LongJob(("warm-up",), "the cache of compiled kernels"),
)
"""Every command that can run longer than a minute; `render` has a second file at reference quality."""


def job_of(words: Sequence[str]) -> LongJob | None:
    """Return the job of a command line, or None for a short command."""
    return next((job for job in JOBS if tuple(words[: len(job.words)]) == job.words), None)
