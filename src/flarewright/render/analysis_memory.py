"""Finished parts of ghost analyses, from which an interrupted command resumes to the same tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..optics.rays.ghost_table import GhostRow, Mirror
from .reference.search_sums import SearchSums

_EDGES = ("stop", "entrance")
# columns of a row's numbers
_COLUMNS = 8


@dataclass(frozen=True)
class AnalysisPart:
    """The finished part of one analysis.

    Attributes
    ----------
    rows : dict of str to GhostRow
        As `measured` of `optics.rays.ghost_table.ghost_table`.
    sums : SearchSums
        Of its search for paths of four reflections.
    """

    rows: dict[str, GhostRow] = field(default_factory=dict)
    sums: SearchSums = field(default_factory=SearchSums)


class AnalysisMemory:
    """The finished parts of the analyses of a command, by the digest of all that determines each.

    Parameters
    ----------
    arrays : mapping of str to ndarray, optional
        What `arrays` of an interrupted command returned.

    Raises
    ------
    ValueError, KeyError
        When the arrays are damaged.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]] | None = None) -> None:
        self._parts: dict[str, AnalysisPart] = {}
        by_digest: dict[str, dict[str, NDArray[Any]]] = {}
        for name, array in ({} if arrays is None else arrays).items():
            digest, _, what = name.partition("/")
            by_digest.setdefault(digest, {})[what] = array
        for digest, known in by_digest.items():
            names, numbers = known["names"], known["rows"]
            if numbers.shape != (len(names), _COLUMNS):
                raise ValueError("rows of an analysis are damaged")
            rows = map(_row, names.tolist(), numbers.tolist())
            self._parts[digest] = AnalysisPart({row.name: row for row in rows}, SearchSums(known))

    def part(self, digest: str) -> AnalysisPart:
        """Return the part of an analysis, empty at first, to which the analysis adds."""
        return self._parts.setdefault(digest, AnalysisPart())

    @property
    def finished(self) -> int:
        """Number of finished ghosts and batches of rays, which rises with the work."""
        return sum(len(part.rows) + part.sums.batches for part in list(self._parts.values()))

    @property
    def ghosts(self) -> int:
        """Number of finished ghosts, with direct images."""
        return sum(len(part.rows) for part in list(self._parts.values()))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the finished parts as arrays for a file; also while another thread adds to them."""
        found: dict[str, NDArray[Any]] = {}
        for digest, part in list(self._parts.items()):
            rows = list(part.rows.values())
            numbers = np.array([_numbers(row) for row in rows]).reshape(-1, _COLUMNS)
            here = {"names": np.array([row.name for row in rows], dtype=np.str_), "rows": numbers, **part.sums.arrays()}
            found |= {f"{digest}/{name}": array for name, array in here.items()}
        return found


def _numbers(row: GhostRow) -> tuple[float, ...]:
    """Return the numbers of a row; NaN where it has no focus."""
    focus = nan if row.focus_distance_mm is None else row.focus_distance_mm
    edge = float(_EDGES.index(row.bounded_by))
    return (
        row.throughput_mm2, *row.centroid_mm, row.rms_radius_mm, row.peak_irradiance, row.peak_patch_mm, edge, focus,
    )  # fmt: skip


def _row(name: str, numbers: list[float]) -> GhostRow:
    """Return the row with a name and `_numbers`."""
    flux, x, y, rms, peak, patch, edge, focus = numbers
    words = [] if name == "direct" else name.split("-")
    first, second = (_mirror(words[0]), int(words[1])) if words else (None, None)
    return GhostRow(
        first, second, flux, (x, y), rms, peak, patch, _EDGES[int(edge)], focus if isfinite(focus) else None,
        tuple(map(_mirror, words[2:])),
    )  # fmt: skip


def _mirror(word: str) -> Mirror:
    return "sensor" if word == "sensor" else int(word)
