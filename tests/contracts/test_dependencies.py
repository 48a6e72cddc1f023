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
# what a person may have installed by other means; asked for politely (`render.display`)
OPTIONAL = {"PyOpenColorIO"}


def modules(requirements: list[str]) -> set[str]:
    names = [re.match(r"[A-Za-z0-9_.-]+", one).group() for one in requirements]
    found = {MODULES.get(name, name) for name in names}
    return found.union(*(COMPANIONS.get(name, set()) for name in names))


def test_nothing_is_imported_that_a_user_has_not():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    allowed = modules(project["dependencies"]) | OPTIONAL | set(sys.stdlib_module_names) | {"flarewright"}
    for extra, requirements in project["optional-dependencies"].items():
        if extra not in FOR_DEVELOPERS:
            allowed |= modules(requirements)
    strange = []
    for file in sorted((ROOT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            strange += [f"{file.name}:{node.lineno} {name}" for name in names if name.split(".")[0] not in allowed]
    assert strange == []
