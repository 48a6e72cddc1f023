"""The packed add-on in Blender's own extensions: valid, installed, switched on and off."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")

pytestmark = pytest.mark.blender

INSTALL = """
import sys, bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
(name,) = [key for key in bpy.context.preferences.addons.keys() if key.endswith(".flarewright")]
bpy.context.preferences.addons[name].preferences.program = "no-such-program"
try:
    bpy.ops.flarewright.check()
except RuntimeError as error:
    print("SAID", error)
bpy.ops.preferences.addon_disable(module=name)
print("OFF", not hasattr(bpy.types.Scene, "flarewright"))
"""


def test_blender_finds_the_file_valid_installs_it_and_reads_its_preferences(addon, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(Path(addon.__file__).parents[2] / "tools"))
    from blender_addon import pack

    pack(tmp_path / "f.zip")
    scripts = Path(bpy.utils.system_resource("SCRIPTS"))
    checker = scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    command = [sys.executable, str(checker), "validate", str(tmp_path / "f.zip")]
    found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (found.returncode, found.stdout.splitlines()[0][:7]) == (0, "Success"), found.stdout
    own = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "own")}
    command = [sys.executable, "-c", INSTALL, str(tmp_path / "f.zip")]
    found = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, env=own)
    assert found.returncode == 0, found.stderr
    assert "SAID Error: the program 'no-such-program' was not found" in found.stdout
    assert "OFF True" in found.stdout
