"""No folder holds more than 25 modules, and each package names its modules in its docstring."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST = 25
FOLDERS = sorted(
    {path.parent for part in ("src", "tests", "benchmarks", "tools") for path in (ROOT / part).rglob("*.py")}
)
ROOMS = [folder for folder in FOLDERS if folder.is_relative_to(ROOT / "src") and folder.parent.name != "src"]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.relative_to(ROOT).as_posix())
def test_no_folder_is_overfull(folder):
    assert len([path for path in folder.glob("*.py") if path.name != "__init__.py"]) <= MOST


@pytest.mark.parametrize("folder", ROOMS, ids=lambda folder: folder.relative_to(ROOT / "src").as_posix())
def test_a_package_names_its_modules(folder):
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__", "__main__"}
    modules |= {path.parent.name for path in folder.glob("*/__init__.py")}
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    assert {name for name in modules if f"`{name}`" not in text} == set()


def entries(folder):
    """Yield the modules of each entry of a package's list, and the names that the entry mentions."""
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    for match in re.finditer(r"^- (`\w+`(?:, `\w+`)*):([\s\S]*?)(?=^- |\Z)", text, re.MULTILINE):
        yield re.findall(r"\w+", match[1]), re.findall(r"`([A-Za-z_]\w*)`", match[2])


def sources(folder, module):
    """Return the text of a module, or of all that a sub-package holds."""
    path = folder / f"{module}.py"
    paths = [path] if path.exists() else sorted(each for each in (folder / module).rglob("*") if each.is_file())
    return "\n".join(
        each.read_text(encoding="utf-8") for each in paths if each.suffix in {".py", ".js", ".html", ".toml"}
    )


@pytest.mark.parametrize("folder", ROOMS, ids=lambda folder: folder.relative_to(ROOT / "src").as_posix())
def test_names_in_a_package_list_exist(folder):
    missing = {
        f"{', '.join(modules)}: {name}"
        for modules, names in entries(folder)
        for texts in [[sources(folder, module) for module in modules]]
        for name in names
        # a neighbour may be mentioned as well
        if not (folder / f"{name}.py").exists() and not any(re.search(rf"\b{name}\b", text) for text in texts)
    }
    assert missing == set()
