"""Types that many modules share are defined only in `flarewright.typing`."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import flarewright.typing

ROOT = Path(__file__).parents[2] / "src" / "flarewright"
ALIASES = {
    "NDArray[np.float64]",
    "NDArray[np.float32]",
    "NDArray[np.int64]",
    "NDArray[np.bool_]",
    "Callable[[float, str], None]",
    "Callable[[str], None]",
}
# parse only modules that have a line that may be one
NAMES = "|".join(flarewright.typing.__all__)
ALIAS = re.compile(rf"^(?:{NAMES})\b.*=|^\w.*= \(?\s*(?:NDArray|Callable)\[", re.MULTILINE)


def aliases(source: str) -> list[tuple[str, str]]:
    """Return the (name, type) pairs of a module's aliases of subscripted types."""
    return [
        (ast.unparse(node.targets[0]), ast.unparse(node.value))
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript)
    ]


def test_each_shared_type_is_defined_once():
    duplicates = {
        f"{path.relative_to(ROOT)}: {name} = {value}"
        for path in ROOT.rglob("*.py")
        if path != ROOT / "typing.py" and ALIAS.search(text := path.read_text(encoding="utf-8"))
        for name, value in aliases(text)
        if value in ALIASES or name in flarewright.typing.__all__
    }
    assert duplicates == set()
    assert {value for _, value in aliases((ROOT / "typing.py").read_text(encoding="utf-8"))} == ALIASES
