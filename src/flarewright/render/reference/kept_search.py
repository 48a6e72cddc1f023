"""Search four-reflection paths for a picture that keeps its finished part in files."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

from ...model import Lens
from ...typing import Progress
from ..image.partial_picture import PartialPicture
from ..scene.shot import Shot
from .four_reflections import FourReflections, find_four_reflections
from .search_sums import SearchSums

_FILE = "sums"


def search_kept(
    kept: PartialPicture | None,
    lens: Lens,
    shots: Sequence[Shot],
    limit: float,
    seed: int,
    *,
    which: str = "all",
    threads: int | None = None,
    progress: Progress | None = None,
) -> FourReflections:
    """Search as `find_four_reflections` does, and keep the sums of the search in the files of a picture.

    Parameters
    ----------
    kept : PartialPicture or None
        None: nothing is kept.
    lens, shots, limit, seed, which, threads, progress
        As of `find_four_reflections`.
    """
    if kept is None:
        return find_four_reflections(lens, shots, limit, seed, which=which, threads=threads, progress=progress)
    kept.begin("search", lens, shots, limit, seed, which)
    sums = SearchSums(kept.load_arrays(_FILE))
    stored, last_s = sums.batches, monotonic()

    def keep(part: float, words: str) -> None:
        nonlocal stored, last_s
        if kept.due(last_s):
            kept.store_arrays(_FILE, sums.arrays())
            stored, last_s = sums.batches, monotonic()
        if progress is not None:
            progress(part, words)

    try:
        return find_four_reflections(lens, shots, limit, seed, which=which, threads=threads, progress=keep, sums=sums)
    finally:
        if sums.batches > stored and kept.due():
            kept.store_arrays(_FILE, sums.arrays())
