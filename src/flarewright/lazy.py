"""Public names of a package that are imported when they are first used, so that importing the package costs nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, homes: Mapping[str, Sequence[str]]
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Make a package's `__all__`, `__getattr__` and `__dir__`.

    Parameters
    ----------
    package : str
        Its `__name__`.
    homes : mapping of str to sequence of str
        Which names each module has, by its path from the package (".pipeline.find_stage"); "" for sub-packages.

    Returns
    -------
    names : list of str
    get : callable
        Raises AttributeError for any other name.
    list_names : callable

    Examples
    --------
    >>> names, get, _ = lazy_names("flarewright", {".errors": ("FlarewrightError",)})
    >>> names, get("FlarewrightError").__name__
    (['FlarewrightError'], 'FlarewrightError')
    """
    home = {name: module for module, names in homes.items() for name in names}
    known = sorted(home)

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(home[name] or f".{name}", package)
        value = getattr(module, name) if home[name] else module
        setattr(sys.modules[package], name, value)
        return value

    return known, get, lambda: sorted({*known, *vars(sys.modules[package])})
