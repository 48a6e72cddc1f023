"""The package imports only what `pip install .` and its extras install, and nothing that only developers have."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
# distributions whose import name differs
MODULES = {"pillow": "PIL"}
# modules that a dependency brings and the package imports directly
COMPANIONS = {"numba": {"llvmlite"}, "typer": {"click"}}
FOR_DEVELOPERS = {"dev", "oracle", "bake", "e2e"}
# the start of an import statement, at the start of a line or behind another statement
IMPORTS = re.compile(r"(?m)(?:^|[;:])[ \t]*(import|from)[ \t]+([^;#\n]*)")
# optional modules that the user may have installed separately; the import may fail (`render.image.display`)
OPTIONAL = {"PyOpenColorIO"}


def modules(requirements: list[str]) -> set[str]:
    names = [re.match(r"[A-Za-z0-9_.-]+", one).group() for one in requirements]
    found = {MODULES.get(name, name) for name in names}
    return found.union(*(COMPANIONS.get(name, set()) for name in names))


def perhaps_imported(text: str) -> list[str]:
    """Return the names of modules that a source imports; words of its string literals may be among them."""
    found = []
    for word, names in IMPORTS.findall(text.replace("\\\n", " ")):
        listed = names.split(",") if word == "import" else [names]
        found += [one.split()[0] for one in listed if one.strip() and not one.strip().startswith(".")]
    return found


def test_every_import_is_an_installed_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    allowed = modules(project["dependencies"]) | OPTIONAL | set(sys.stdlib_module_names) | {"flarewright"}
    for extra, requirements in project["optional-dependencies"].items():
        if extra not in FOR_DEVELOPERS:
            allowed |= modules(requirements)
    strange = []
    for file in sorted((ROOT / "src").rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        # parsing every file takes seconds: skip files in which the regular expression finds only allowed modules
        if all(name.split(".")[0] in allowed for name in perhaps_imported(text)):
            continue
        for node in ast.walk(ast.parse(text)):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            strange += [f"{file.name}:{node.lineno} {name}" for name in names if name.split(".")[0] not in allowed]
    assert strange == []


def test_every_form_of_import_is_found():
    text = """import one, two.part as other,three
    from four.part import thing
try: import five
except ImportError: x = 1; from six import (
    thing,
)
from . import own
from .own import thing
import \\
    seven
from \\
    eight import thing
"""
    found = {name.split(".")[0] for name in perhaps_imported(text)}
    assert found == {"one", "two", "three", "four", "five", "six", "seven", "eight"}
    # a line of prose that looks like an import gives a name; such files are parsed
    assert perhaps_imported("from here on there is nothing") == ["here"]
