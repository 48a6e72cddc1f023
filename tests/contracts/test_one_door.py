"""Every file of a user is opened by `io.files.door.outside`, which knows its size and its header's claim."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2] / "src" / "flarewright"

DOORS = {"outside", "outside_arrays"}
# calls that open a file, by the last one or two parts of their name
OPENERS = {
    "open", ".read_bytes", ".read_text", "imread", "memmap", "TiffFile", "Image.open", "np.load", "np.fromfile",
    "np.genfromtxt", "np.loadtxt", "OpenEXR.File", "ZipFile", "load_from_fp", "tomllib.load", "json.load",
}  # fmt: skip
# no file of a user (what is written, the package's data, devices of the system, bytes in memory), or the door's file
ALLOWED = {
    ("cli/app.py", "os.open"),
    ("cli/looks.py", "Image.open"),
    ("editor/server/app.py", ".open"),
    ("editor/server/tokens.py", "os.open"),
    ("editor/server/tokens.py", "path.read_text"),
    ("editor/session/autosave_lock.py", ".open"),
    ("io/files/file_lock.py", "path.open"),
    ("io/files/silence_libraries.py", "os.open"),
    ("io/files/tar_members.py", "tarfile.open"),
    ("io/images/exr.py", "OpenEXR.File"),
    ("io/images/mask_image.py", "Image.open"),
    ("io/images/thumbnails.py", "path.read_bytes"),
    ("io/lens/glass_catalogue.py", ".read_bytes"),
    # parts of an archive that the door has checked
    ("io/lens/own/archive.py", "ZipFile"),
    ("io/lens/own/archive.py", "archive.open"),
    ("io/render_state/damaged_archive.py", "path.open"),
    ("io/render_state/flare_cache.py", "np.load"),
    ("kernels/jit/cache_files.py", ".read_bytes"),
    ("kernels/jit/roots.py", ".read_text"),
    ("measure/core/checkpoint.py", "path.open"),
    ("render/scene/memory_check.py", "MEMINFO.read_text"),
    ("workflow/training_pairs/layout.py", "path.read_bytes"),
    ("workflow/training_pairs/sensor.py", "Image.open"),
}


def dotted(call: ast.Call) -> str:
    """Return the last two parts of the name of a called function."""
    at = call.func
    if isinstance(at, ast.Name):
        return at.id
    if isinstance(at, ast.Attribute):
        return f"{at.value.id if isinstance(at.value, ast.Name) else ''}.{at.attr}"
    return ""


def writes(call: ast.Call) -> bool:
    """Return whether a call of `open` has a mode that only writes."""
    modes = [arg.value for arg in call.args if isinstance(arg, ast.Constant) and isinstance(arg.value, str)]
    return any(mode in ("w", "wb") for mode in modes)


def unguarded(node: ast.AST, inside: bool = False):
    """Yield the calls that open a file outside a `with outside(...)` block."""
    if isinstance(node, ast.With):
        for item in node.items:
            yield from unguarded(item.context_expr, inside)
            call = item.context_expr
            inside = inside or (isinstance(call, ast.Call) and dotted(call) in DOORS)
        for child in node.body:
            yield from unguarded(child, inside)
        return
    if isinstance(node, ast.Call) and not inside:
        name = dotted(node)
        last = name.rpartition(".")[2]
        if ({name, last, f".{last}" if "." in name else ""} & OPENERS) and not writes(node):
            yield name
    for child in ast.iter_child_nodes(node):
        yield from unguarded(child, inside)


def opened_by(path: Path) -> set[tuple[str, str]]:
    place, source = path.relative_to(ROOT).as_posix(), path.read_text("utf-8")
    # most files open nothing, and parsing takes time
    if not any(f"{name}(" in source for name in OPENERS):
        return set()
    return {(place, name) for name in unguarded(ast.parse(source))}


def test_every_file_of_a_user_is_opened_by_the_door():
    found = set().union(*(opened_by(path) for path in ROOT.rglob("*.py") if path.name != "door.py"))
    assert found - ALLOWED == set()
    assert ALLOWED - found == set(), "remove what no longer occurs"


def test_the_search_sees_a_reader_beside_the_door():
    tree = ast.parse("with outside(path, 'x') as file:\n    np.load(file)\nnp.load(path)\n")
    assert list(unguarded(tree)) == ["np.load"]
    tree = ast.parse("with outside(path, 'x') as file, Image.open(file) as image:\n    pass\npath.open('wb')\n")
    assert list(unguarded(tree)) == []
