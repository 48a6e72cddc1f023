"""No folder holds more than 25 modules; a package names its modules in its docstring, a module its package by dots."""

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


@pytest.mark.parametrize("folder", ROOMS, ids=lambda folder: folder.relative_to(ROOT / "src").as_posix())
def test_entry_points_of_a_package_exist(folder):
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    missing = {
        f"{module}.{name}"
        for module, name in re.findall(r"`(\w+)\.(\w+)`", text)
        # `roots.json` is a file
        if (folder / f"{module}.py").exists()
        and not (folder / f"{module}.{name}").exists()
        and not re.search(rf"^(?:(?:async )?def |class )?{name}\b", sources(folder, module), re.MULTILINE)
    }
    assert missing == set()


def test_modules_import_their_own_package_by_dots():
    """One way to name a neighbour; `__main__` is also run as a file."""
    named = []
    for path in (ROOT / "src").rglob("*.py"):
        for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [each.module] if isinstance(each, ast.ImportFrom) and not each.level else []
            modules += [one.name for one in each.names] if isinstance(each, ast.Import) else []
            named += [f"{path}: {one}" for one in modules if one and one.split(".")[0] == "flarewright"]
    assert [one for one in named if "__main__.py" not in one] == []
