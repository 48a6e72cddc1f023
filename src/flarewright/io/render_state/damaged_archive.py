"""Whether a file that cannot be read is the rest of an archive of ours, which may be replaced."""

from __future__ import annotations

import re
from pathlib import Path

_ZIP = b"PK\x03\x04"
# bytes of an archive's start before its first name, and of the part that is searched for names
_SHORTEST, _SEARCHED = 100, 1_000_000


def is_rest_of_archive(path: Path, name: re.Pattern[bytes]) -> bool:
    """Return whether a damaged file is certainly an archive of ours.

    Parameters
    ----------
    path : Path
        An existing file.
    name : pattern
        Name of a part of the archive.

    Returns
    -------
    bool
        It is empty, cut within its first name, or holds such a name.
    """
    with path.open("rb") as file:
        data = file.read(_SEARCHED)
    return (len(data) < _SHORTEST and _ZIP.startswith(data[: len(_ZIP)])) or name.search(data) is not None
