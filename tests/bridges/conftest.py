"""The add-on as a module, and an empty scene of Blender."""

import importlib
import importlib.util
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "bridges" / "blender"


@pytest.fixture(scope="session")
def addon():
    # Blender makes a package of the folder, whose name is the user's
    spec = importlib.util.spec_from_file_location(
        "flarewright_blender", FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules["flarewright_blender"] = package
    spec.loader.exec_module(package)
    for name in ("camera", "document", "errors", "job", "light", "program", "scene"):
        importlib.import_module(f"flarewright_blender.{name}")
    return package


@pytest.fixture(scope="session")
def registered(addon):
    pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")
    addon.register()
    yield addon
    addon.unregister()


@pytest.fixture
def scene(registered):
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 1
    scene.render.fps = 24
    return scene
