"""Tar files that are joined from parts: members without dates or owners, so that equal contents make equal bytes."""

from __future__ import annotations

import tarfile
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path

from .atomic_write import write_atomically
from .door import outside

_END = b"\0" * (2 * tarfile.BLOCKSIZE)


def tar_member(name: str, data: bytes) -> bytes:
    """Return the header and the padded contents of a member (POSIX ustar).

    Parameters
    ----------
    name : str
        At most 100 characters.
    data : bytes

    Returns
    -------
    bytes
        A whole number of blocks of 512 bytes.
    """
    head = tarfile.TarInfo(name)
    head.size, head.mode = len(data), 0o644
    padding = -len(data) % tarfile.BLOCKSIZE
    return head.tobuf(tarfile.USTAR_FORMAT) + data + b"\0" * padding


def join_parts(target: Path, parts: Iterable[Path]) -> None:
    """Write a tar file from files of members, one after the other, atomically.

    Parameters
    ----------
    target : Path
    parts : iterable of Path
        Files of joined `tar_member`s.

    Raises
    ------
    FlarewrightError
        A part cannot be read, or the file cannot be written.
    """

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            for part in parts:
                with outside(part, "a part of a tar file") as source:
                    while block := source.read(1_000_000):
                        file.write(block)
            file.write(_END)

    write_atomically(target, write)


def members(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of joined `tar_member`s, with or without the end of a tar file.

    Raises
    ------
    ValueError
        They are damaged.
    """
    whole = data if data.endswith(_END) else data + _END
    used = len(_END)
    try:
        with tarfile.open(fileobj=BytesIO(whole)) as archive:
            for member in archive:
                used += tarfile.BLOCKSIZE * (1 + -(-member.size // tarfile.BLOCKSIZE))
                # the end that was added must not fill a member that is cut short
                if used > len(whole):
                    raise ValueError(f"its member {member.name[:40]} is cut short")
                file = archive.extractfile(member)
                yield member.name, b"" if file is None else file.read()
    except tarfile.TarError as error:
        raise ValueError(str(error)) from None
