"""Cryptomatte in EXR files: the identifiers, channels and attributes of a matte of ghosts.

Psyop's Cryptomatte specification, version 1.2: each channel pair has an object's identifier, the 32 bits of the hash of
its name as a float, and its coverage. Pairs are sorted by coverage. Two pairs are a layer, `CryptoGhost00` and so on.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...model.matte import GhostMatte
from ...typing import Pixels

NAME = "CryptoGhost"
"""Name of the Cryptomatte; its layers are this and two digits."""

_BITS = 0xFFFFFFFF


def murmur3_32(data: bytes, seed: int = 0) -> int:
    """Return the 32-bit MurmurHash3 of bytes.

    Parameters
    ----------
    data : bytes
    seed : int
        0 to 2^32 - 1.

    Notes
    -----
    A. Appleby, MurmurHash3_x86_32 (smhasher, MurmurHash3.cpp), in the public domain.

    Examples
    --------
    >>> hex(murmur3_32(b"hello"))
    '0x248bfa47'
    """
    h = seed
    whole = len(data) // 4 * 4
    for start in range(0, whole, 4):
        h ^= _mixed(int.from_bytes(data[start : start + 4], "little"))
        h = (_turned(h, 13) * 5 + 0xE6546B64) & _BITS
    h ^= _mixed(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    h = ((h ^ h >> 16) * 0x85EBCA6B) & _BITS
    h = ((h ^ h >> 13) * 0xC2B2AE35) & _BITS
    return h ^ h >> 16


def _mixed(k: int) -> int:
    return (_turned((k * 0xCC9E2D51) & _BITS, 15) * 0x1B873593) & _BITS


def _turned(k: int, bits: int) -> int:
    return (k << bits | k >> (32 - bits)) & _BITS


def identifier(name: str) -> int:
    """Return the identifier of an object: the bits of a float that is neither infinite, NaN, 0 nor denormal.

    Notes
    -----
    The specification's conversion `uint32_to_float32`: where all bits of the exponent are alike, its lowest is flipped.
    """
    h = murmur3_32(name.encode())
    return h ^ 1 << 23 if h >> 23 & 0xFF in (0, 0xFF) else h


def matte_layers(matte: GhostMatte) -> tuple[tuple[str, Pixels], ...]:
    """Return the names and the pixels of a Cryptomatte's layers.

    Parameters
    ----------
    matte : GhostMatte
        With an even number of ranks.

    Returns
    -------
    tuple of (str, ndarray of shape (H, W, 4), float32)
        Red and blue are identifiers, green and alpha their coverage.
    """
    bits = np.array([*map(identifier, matte.names), 0], dtype=np.uint32)
    # an index of -1, no object, is the last identifier, 0
    values: NDArray[np.float32] = bits.view(np.float32)[matte.objects]
    coverage = matte.coverage
    return tuple(
        (f"{NAME}{k:02d}", np.stack([values[2 * k], coverage[2 * k], values[2 * k + 1], coverage[2 * k + 1]], axis=-1))
        for k in range(len(values) // 2)
    )


def matte_attributes(names: Iterable[str]) -> dict[str, str]:
    """Return the attributes of a file with a Cryptomatte of these objects."""
    key = f"cryptomatte/{murmur3_32(NAME.encode()):08x}"[: len("cryptomatte/") + 7]
    return {
        f"{key}/name": NAME,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps({name: f"{identifier(name):08x}" for name in names}, separators=(",", ":")),
    }


def matte_names(header: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the Cryptomattes that a header states; a layer of one is its name and two digits."""
    return tuple(
        str(value) for key, value in header.items() if key.startswith("cryptomatte/") and key.endswith("/name")
    )
