"""The files that a project or a lens names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ...model import Lens, Project

# fields of the model that name files of pictures (tests/editor/session/test_reach.py)
FIELDS = ("image", "depth", "mask")


def picture_files(model: Project | Lens) -> tuple[str, ...]:
    """Return the paths of all pictures that a project or a lens names; a lens that a project names is not opened."""
    return tuple(_named(model.model_dump(exclude={"design", "art"})))


def _named(data: Any) -> Iterator[str]:
    """Yield the values of all fields of a dump that name files."""
    if isinstance(data, Mapping):
        for key, value in data.items():
            if key in FIELDS and isinstance(value, str):
                yield value
            else:
                yield from _named(value)
    elif isinstance(data, list | tuple):
        for each in data:
            yield from _named(each)
