"""What packages, helps and checks load, and public names in a new process.

One process answers everything, in the order of what loads more: its start takes longer than most answers.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import reload
from typing import Any

import pytest
from test_public_api import PACKAGES

import flarewright as fw
import flarewright.cli

# prints, as its last line, which starts of module names were loaded after each step
STEPS = """
import json, os, sys
watched = json.loads(sys.argv[1])
steps = {}

def note(step, *more):
    steps[step] = [[start for start in watched if any(name.startswith(start) for name in list(sys.modules))], *more]

import flarewright
note("flarewright")
for name in json.loads(sys.argv[2]):
    __import__(f"flarewright.{name}")
note("packages")
import flarewright.cli
note("cli", os.environ["OPENBLAS_NUM_THREADS"])
from flarewright.cli.app import run
note("help", run(["render", "--help"]))
for file in sys.argv[3:]:
    note(file, run(["scene", "check", file]))
lens = flarewright.load_lens("heliar-tronnier")
first = [callable(flarewright.render), callable(flarewright.ghosts)]
import flarewright.render.image.display as display
first += [flarewright.render.image.display is display, callable(flarewright.render)]
first += [abs(flarewright.paraxial(lens).efl - 99.2358) < 1e-3]
first += [issubclass(flarewright.ProjectError, flarewright.FlarewrightError)]
note("names", first)
from flarewright.jobs.cluster.executor import open_cluster
with open_cluster(None, ".") as none:
    import flarewright.workflow.shot
    note("shot", none)
import flarewright.workflow.shot_frame
note("frame")
print(json.dumps(steps))
"""
HEAVY = ["numpy", "numba", "scipy", "OpenEXR", "flarewright.model"]
# the package flarewright.measure itself loads nothing
TRACING = ["numba", "scipy", "flarewright.render", "flarewright.measure."]
DASK = ["dask", "distributed", "cryptography"]
PLATES = ["scipy.ndimage", "scipy.spatial"]
# scenes that fail before anything is traced
SCENES = {
    "iso": ('lens = "nope"\niso = 0', "[0, 10, 0]"),
    "aim": ('lens = "nope"', "[0, 0, 0]"),
    "model": ('model = "nope.json"\nunit_per_cd_m2 = 0.02', "[0, 10, 0]"),
}


@pytest.fixture(scope="module")
def steps(tmp_path_factory) -> dict[str, list[Any]]:
    """Return the watched starts of names that are loaded after each step, and what the step returns."""
    folder = tmp_path_factory.mktemp("scenes")
    for name, (lines, aim) in SCENES.items():
        (folder / f"{name}.toml").write_text(
            f'[[cameras]]\nname = "A"\nposition_m = [0, 0, 0]\naim_m = {aim}\n{lines}\n'
            '[[lights]]\nname = "lamp"\nposition_m = [2, 10, 0]\nintensity_cd = 100\n'
        )
    watched = ["typer", *HEAVY, *TRACING, *DASK, *PLATES]
    files = [f"{name}.toml" for name in SCENES]
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    code = f"import sys; sys.path[:] = {sys.path!r}\n{STEPS}"
    done = subprocess.run(
        [sys.executable, "-c", code, json.dumps(watched), json.dumps(PACKAGES), *files],
        cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_packages_import_nothing_heavy(steps) -> None:
    assert steps["flarewright"] == steps["packages"] == [[]]


def test_help_loads_nothing_heavy(steps) -> None:
    assert steps["help"] == [["typer"], 0]


def test_the_command_leaves_no_threads_to_the_library_of_matrices(steps, monkeypatch) -> None:
    """They would spin beside our threads; a user's setting is kept. It must be set before NumPy is loaded."""
    loaded, threads = steps["cli"]
    assert "numpy" not in loaded
    assert threads == "1"
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    reload(flarewright.cli)
    assert os.environ["OPENBLAS_NUM_THREADS"] == "3"


def test_what_traces_rays_is_not_loaded_for_a_scene_that_fails_without_it(steps) -> None:
    for name in SCENES:
        loaded, code = steps[f"{name}.toml"]
        assert code == 2
        assert not set(TRACING) & set(loaded), name


def test_public_names_are_there_in_any_order(steps) -> None:
    assert steps["names"][1] == [True] * 6
    assert set(fw.__all__) <= set(dir(fw))
    assert all(hasattr(fw, name) for name in fw.__all__)
    assert not hasattr(fw, "glow")


def test_without_a_cluster_dask_is_not_imported(steps) -> None:
    loaded, cluster = steps["shot"]
    assert cluster is None
    assert not set(DASK) & set(loaded)


def test_a_process_that_draws_frames_loads_what_searches_plates_only_for_a_plate(steps) -> None:
    """SciPy's import takes longer than a draft."""
    (loaded,) = steps["frame"]
    assert "flarewright.render" in loaded
    assert not set(PLATES) & set(loaded)
