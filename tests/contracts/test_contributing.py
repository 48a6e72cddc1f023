"""CONTRIBUTING names files and functions that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = (ROOT / "src" / "flarewright", ROOT, ROOT / "docs")
ROWS = [line for line in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines() if line.startswith("| ")]


def named_files(row):
    """Yield each file or folder that a row names, where it is, and the names in the brackets behind it."""
    folder = None
    for match in re.finditer(r"`([\w./*]+)`(?:[^`|(]*\(([^)|]*)\))?", row):
        name, brackets = match[1], match[2] or ""
        if "/" not in name and Path(name).suffix not in {".py", ".js", ".md", ".toml"}:
            continue
        # a file without a folder is beside the one before it
        places = [*PLACES, *([folder] if folder else [])]
        found = [path for place in places for path in sorted(place.glob(name))]
        folder = found[0] if found and found[0].is_dir() else found[0].parent if found else folder
        yield name, found, re.findall(r"`(\w+)`", brackets)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.split("|")[1].strip()[:40])
def test_a_row_names_files_and_functions_that_exist(row):
    for name, found, words in named_files(row):
        assert found, f"{name} does not exist"
        files = [path for path in found if path.is_file()]
        texts = [path.read_text(encoding="utf-8") for path in files]
        missing = [word for word in words if files and not any(re.search(rf"\b{word}\b", text) for text in texts)]
        assert missing == [], f"{name} has no {missing}"


def test_rows_are_read():
    named = [name for row in ROWS for name, _, _ in named_files(row)]
    assert "kernels/raster/bundle.py" in named
    assert len(named) > 100
