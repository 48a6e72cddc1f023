"""The package has no import cycle, including imports inside functions and imports for type checking."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2] / "src" / "flarewright"
# a statement, at the start of a line, that may import a module of the package; parsing whole files takes longer
STARTS = r"from[ \t]+(?:\.|flarewright\b)[\w.]*[ \t]+import\b|import[ \t]+flarewright\b"
IMPORT = re.compile(rf"^[ \t]*((?:{STARTS})[^(\n]*(?:\([^()]*\))?)", re.MULTILINE)


def module_name(path: Path) -> str:
    """Return the dotted name of a source file."""
    parts = ("flarewright", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield all statements of a source, without their expressions, in which nothing is imported."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        for node in getattr(tree, field, ()):
            yield node
            yield from statements(node)


def imports_of(name: str, is_package: bool, tree: ast.AST, known: set[str]) -> set[str]:
    """Return the modules of the package that a module imports anywhere in its source."""
    found = set()
    for node in statements(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = name.split(".") if is_package else name.split(".")[:-1]
            base = base[: len(base) - node.level + 1] if node.level else []
            start = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{start}.{alias.name}" if f"{start}.{alias.name}" in known else start for alias in node.names}
    return (found & known) - {name}


def import_statements(text: str) -> ast.AST:
    """Return the tree of a source's import statements alone, those of strings among them."""
    return ast.parse("\n".join(IMPORT.findall(text)))


def graph() -> dict[str, set[str]]:
    """Return the imports of every module of the package."""
    files = {module_name(path): path for path in ROOT.rglob("*.py")}
    return {
        name: imports_of(name, path.name == "__init__.py", import_statements(path.read_text("utf-8")), set(files))
        for name, path in files.items()
    }


def cycles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that reach each other (Tarjan's strongly connected components), smallest first."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(edges[node]):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return sorted(found, key=len)


def test_cycles_are_found() -> None:
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]
    assert cycles({"a": {"b"}, "b": set()}) == []
    text = "if 1:\n    from .x import y\ndef f():\n    from .. import (\n        errors,\n    )\nimport flarewright.z\n"
    tree = import_statements(text)
    known = {"flarewright.p.x", "flarewright.errors", "flarewright.z", "flarewright.p.m"}
    assert imports_of("flarewright.p.m", False, tree, known) == known - {"flarewright.p.m"}


def test_the_package_has_no_import_cycle() -> None:
    edges = graph()
    assert cycles(edges) == []
