"""The package imports what `pip install .` and its extras bring, and nothing that only developers have."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
# names of distributions that are imported by another name
MODULES = {"pillow": "PIL"}
# what comes with one of ours and is used beside it
COMPANIONS = {"numba": {"llvmlite"}, "typer": {"click"}}
FOR_DEVELOPERS = {"dev", "oracle", "bake", "e2e"}
# a line, or a statement behind another one, that begins as an import does
IMPORTS = re.compile(r"(?m)(?:^|[;:])[ \t]*(import|from)[ \t]+([^;#\n]*)")
# what a person may have installed by other means; asked for politely (`render.display`)
OPTIONAL = {"PyOpenColorIO"}


def modules(requirements: list[str]) -> set[str]:
    names = [re.match(r"[A-Za-z0-9_.-]+", one).group() for one in requirements]
    found = {MODULES.get(name, name) for name in names}
    return found.union(*(COMPANIONS.get(name, set()) for name in names))


def perhaps_imported(text: str) -> list[str]:
    """Return the names of modules that a source imports; words of its texts may be among them."""
    found = []
    for word, names in IMPORTS.findall(text.replace("\\\n", " ")):
        listed = names.split(",") if word == "import" else [names]
        found += [one.split()[0] for one in listed if one.strip() and not one.strip().startswith(".")]
    return found


def test_nothing_is_imported_that_a_user_has_not():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    allowed = modules(project["dependencies"]) | OPTIONAL | set(sys.stdlib_module_names) | {"flarewright"}
    for extra, requirements in project["optional-dependencies"].items():
        if extra not in FOR_DEVELOPERS:
            allowed |= modules(requirements)
    strange = []
    for file in sorted((ROOT / "src").rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        # to parse every file takes seconds: those whose lines hold no other module's name need it not
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


def test_every_way_to_import_is_seen():
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
    # a line of a text looks like it, and is parsed
    assert perhaps_imported("from here on there is nothing") == ["here"]
