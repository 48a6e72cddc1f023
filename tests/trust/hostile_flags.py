"""Hostile numbers and texts for every option of every command, found in the command tree itself."""

from __future__ import annotations

import atexit
import io
import random
import shutil
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stderr
from dataclasses import fields
from functools import cache
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from PIL import Image

import flarewright as fw
from flarewright.cli.app import run as run_command
from flarewright.cli.render.options.plate import CompOptions, PlateOptions
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.io.project.project_text import project_text
from flarewright.model.measurement.ghost_model import AberrationGhost, Channel, GhostModel

from .answers import judged
from .commands import ARGUMENTS, LEFT_OUT, commands, options
from .verdict import Verdict

NUMBERS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e30", "-1e30", "0", "-0.0", "-1", "-0.5", "1e-9", "1e999",
    "9223372036854775808", "-9223372036854775809", "4294967296", "65536", "1_000", "0x10", "1,5", "\u0663", "", " 5",
    "abc", "5" * 400,
)  # fmt: skip
SHAPES = (
    "{0}",
    "{0},{0}",
    "{0}x{0}",
    "{0},5",
    "5x{0}",
    "BK7:{0}",
    "{0}:{0}:{0}",
    "={0}",
    "beauty={0}",
    "3-1",
    "{0}-1",
    "\x00",
    "é",
    "x" * 5000,
)

# options whose value lets a command run as long as it wants
ENDLESS = {"--time", "--cpu", "--items", "--seeds"}
# what an option needs beside it to be read at all
BESIDE: dict[str, tuple[str, ...]] = {
    "--error": ("--quality", "reference"), "--samples": ("--quality", "reference"),
    "--time-limit": ("--quality", "reference"), "--rays-from": ("--quality", "reference"),
    "--error-of": ("--quality", "reference", "--error", "0.2"), "--order4-limit": ("--orders", "4"),
    "--iso": ("--shutter", "1/250"), "--lux": ("--shutter", "1/250"),
}  # fmt: skip
# options of `shot` that need a plate
OF_PLATE = {f"--{each.name.replace('_', '-')}" for kind in (PlateOptions, CompOptions) for each in fields(kind)}
PAIRS = 'size_px = [32, 18]\n[lens]\nnames = ["tessar-brendel"]\nstops_down = { uniform = [3, 4] }\n'


@cache
def cases() -> tuple[tuple[str, str, str], ...]:
    """Return command, flag and value of every case."""
    found = []
    for name, function in commands():
        if name in LEFT_OUT:
            continue
        for flag, kind, _ in options(function):
            if kind in (int, float):
                found += [(name, flag, value) for value in NUMBERS]
            elif kind is str:
                found += [
                    (name, flag, shape.format(value))
                    for shape in SHAPES
                    for value in ("nan", "1e308", "-1", "0", "1e-9")
                ]
            else:
                found += [(name, flag, value) for value in ("", "~nosuchuser/a", "/dev/null", "a\x00b", "x" * 5000)]
    return tuple(dict.fromkeys(found))


def prepare(folder: Path) -> None:
    """Write the small files that `ARGUMENTS` name."""
    target = '\n[[design.ghost_targets]]\nghost = "6-5"\nmove_mm = 1.0\ncolor = [1.0, 0.5, 0.2]\n'
    with redirect_stderr(io.StringIO()):
        for words in (("project", "init", "tessar-brendel", "-o", "shot.toml"), ("scene", "init", "-o", "match.toml")):
            assert run_command([*words[:-1], str(folder / words[-1])]) == 0
    shot = folder / "shot.toml"
    shot.write_text(shot.read_text("utf-8") + target, "utf-8")
    write_lens(fw.load_lens("tessar-brendel"), folder / "lens.toml")
    (folder / "pairs.toml").write_text(PAIRS, "utf-8")
    lights, camera = (fw.Light(field_deg=(5.0, 3.0)),), fw.Camera(size_px=(96, 54))
    small = fw.Project(lens="tessar-brendel", lights=lights, camera=camera, quality=fw.Quality(mode="draft"))
    fw.write_exr(folder / "flare.exr", fw.render(small).layers, (96, 54))
    (folder / "warm.toml").write_text(project_text(small.replace(iris=fw.Iris(blades=5))), "utf-8")
    ten = (0.0,) * 9
    channel = Channel(f=(-20.0, *ten), g=(6.0, *ten), intensity=(0.3, *ten))
    ghost = AberrationGhost(name="1", red=channel, green=channel, blue=channel, visible_deg=(2.0, 15.0))
    model = GhostModel(
        size_px=(64, 36), axis_px=(32.0, 18.0), focal_px=90.0, largest_deg=15.0, constellation_deg=(2.0, 15.0),
        ghosts=(ghost,),
    )  # fmt: skip
    write_ghost_model(folder / "model.json", model)
    for k in range(1, 4):
        Image.fromarray(np.full((18, 32, 3), 60 * k, np.uint8)).save(folder / f"matte.{k:04d}.png")
    rows, (y, x) = ["file,constellation_deg,exposure_s,iso,f_number"], np.mgrid[:36, :64] + 0.5
    for angle in (5, 10, 15):
        light = np.exp(-0.5 * ((x - 32 - angle) ** 2 + (y - 18) ** 2)) + 0.01 * (np.hypot(x - 32 + angle, y - 18) < 6)
        np.save(folder / f"{angle}.npy", np.repeat(0.9 * light[..., None], 3, axis=2).astype(np.float32))
        rows.append(f"{angle}.npy,{angle},1,100,4")
    (folder / "captures.csv").write_text("\n".join(rows) + "\n", "utf-8")
    (folder / "camera.json").write_text('{"electrons_per_unit": 20000, "read_noise": 0.001}', "utf-8")
    merge = ("measure", "merge", "captures.csv", "-o", "merged", "--camera", "camera.json")
    with ZipFile(folder / "lens.zip", "w") as archive:
        archive.write(folder / "lens.toml", "tessar/lens.toml")
    library = ("library", "add", "lens.toml", "--name", "mine")
    search = ("design", "solve", "shot.toml", "-o", "searched", "--searches", "40", "--lenses", "1")
    for words in (merge, library, search):
        held, answer = judged(words, folder, keep=True)
        assert (held, answer) == (True, "done"), f"{' '.join(words)}: {answer}"


@cache
def prepared() -> Path:
    """Return a folder with the small files, which the process keeps to its end."""
    folder = Path(tempfile.mkdtemp(prefix="flarewright-trust-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    prepare(folder)
    return folder


def run(seed: int) -> Verdict:
    """Run one case, chosen by its seed: all cases in turn, in a shuffled order."""
    known = list(cases())
    random.Random(1).shuffle(known)
    return run_case(known[seed % len(known)])


def run_case(case: Sequence[str]) -> Verdict:
    """Run a command with one hostile value."""
    command, flag, value = case
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "work"
        shutil.copytree(prepared(), folder)
        beside = BESIDE.get(flag, ()) if command == "render" else ()
        if command == "shot" and flag in OF_PLATE:
            beside = ("flare.exr", *(("--source", "sun") if flag == "--white" else ()))
        words = [*command.split(), *ARGUMENTS[command], *beside, f"{flag}={value}"]
        held, answer = judged(words, folder, endless=flag in ENDLESS or command == "gallery")
    shown = value if len(value) < 40 else f"{value[:30]}... ({len(value)} characters)"
    return Verdict("flags", f"{command} {flag}={shown}", held, answer)
