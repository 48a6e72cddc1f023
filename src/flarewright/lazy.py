"""Public names of a package that are imported when they are first used, so that importing the package costs nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any


def lazy_names(package: str) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Make a package's `__all__`, `__getattr__` and `__dir__` from its stub `__init__.pyi`, which type checkers read.

    Parameters
    ----------
    package : str
        Its `__name__`. A line `from .errors import LensError as LensError` of the stub is a public name.

    Returns
    -------
    names : list of str
    get : callable
        Raises AttributeError for any other name.
    list_names : callable

    Examples
    --------
    >>> import flarewright
    >>> names, get, _ = lazy_names("flarewright")
    >>> "LensError" in names, get("LensError").__name__
    (True, 'LensError')
    """
    spec: Any = sys.modules[package].__spec__
    lines = (line.split() for line in spec.loader.get_data(f"{spec.origin}i").decode().splitlines())
    home = {words[-1]: words[1] for words in lines if words[:1] == ["from"]}
    known = sorted(home)

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if home[name] == f".{name}.{name}":
            # `render` is a package that may be called: the function could not live beside it
            value: Any = import_module(f".{name}", package)
        else:
            value = getattr(import_module(home[name], package), name)
        setattr(sys.modules[package], name, value)
        return value

    return known, get, lambda: sorted({*known, *vars(sys.modules[package])})
