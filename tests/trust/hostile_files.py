"""Damaged files for every reader: valid small files with bytes and words changed."""

from __future__ import annotations

import random
import shutil
import tempfile
from fractions import Fraction
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import tifffile
from PIL import Image

from flarewright.io.films.film_writer import write_film

from .answers import judged
from .commands import ARGUMENTS
from .hostile_flags import NUMBERS, prepared
from .verdict import Verdict

RENDER = ("render", *ARGUMENTS["render"])
BARE = ("render", "--project", "shot.toml", "--size", "32x18", "--quality", "draft", "-o", "out.exr")
REPLAY = ("measure", "replay", *ARGUMENTS["measure replay"])

# PyAV is optional
FILMS = ("film.mp4", "film.mov") if find_spec("av") else ()
READERS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("lens.toml", ("lens", "check", "lens.toml", "--json")),
    ("lens.lens", ("lens", "check", "lens.lens", "--json")),
    ("lens.zmx", ("lens", "check", "lens.zmx", "--json")),
    ("lens.seq", ("lens", "check", "lens.seq", "--json", "--first-column", "curvatures")),
    ("lens.len", ("lens", "check", "lens.len", "--json")),
    ("lens.csv", ("lens", "check", "lens.csv", "--json")),
    ("lens.dat", ("lens", "check", "lens.dat", "--json")),
    ("lens.json", ("lens", "check", "lens.json", "--json")),
    ("lens.zip", ("library", "add", "lens.zip", "--json")),
    ("state/library/index.json", ("library", "list", "--json")),
    ("state/library/lenses/mine.toml", ("library", "list", "--json")),
    ("shot.toml", BARE),
    ("shot.toml", ("project", "check", "shot.toml")),
    ("shot.toml", ("design", "solve", "shot.toml", "-o", "found", "--time", "0.1")),
    ("match.toml", ("scene", "check", "match.toml")),
    ("pairs.toml", ("dataset", "pairs.toml", "-n", "1", "-o", "new_pairs", "--processes", "1")),
    ("warm.toml", ("looks", "save", "warm.toml", "-o", "new.toml")),
    ("look.toml", (*RENDER, "--look", "look.toml")),
    ("spectrum.csv", (*RENDER, "--spectrum", "spectrum.csv")),
    ("track.csv", (*RENDER, "--track", "track.csv", "--frame", "2")),
    ("track.nk", (*RENDER, "--track", "track.nk", "--frame", "2")),
    ("effects.txt", (*RENDER, "--track", "effects.txt", "--frame", "2")),
    ("paths.txt", (*RENDER, "--track", "paths.txt", "--frame", "2")),
    ("points.txt", (*RENDER, "--track", "points.txt", "--frame", "2")),
    ("scene.json", (*RENDER, "--track", "scene.json", "--frame", "2")),
    ("iris.png", (*RENDER, "--iris-image", "iris.png")),
    ("dirt.png", (*RENDER, "--dirt-image", "dirt.png")),
    ("matte.png", (*RENDER, "--holdout", "matte.png")),
    ("flare.exr", (*RENDER, "--depth", "flare.exr")),
    ("flare.exr", ("sources", "flare.exr", "--json")),
    ("photo.tiff", ("sources", "photo.tiff", "--json")),
    ("photo.jpg", ("sources", "photo.jpg", "--json")),
    ("flare.exr", ("design", "target", *ARGUMENTS["design target"])),
    ("flare.exr", ("nuke-script", "flare.exr", "-o", "flare.nk", "--json")),
    ("photo.npy", ("design", "target", "photo.npy", "--light", "5,3", "--focal", "50", "-o", "target.toml")),
    ("photo.tiff", ("design", "target", "photo.tiff", "--light", "5,3", "--focal", "50", "-o", "target.toml")),
    ("photo.jpg", ("design", "target", "photo.jpg", "--light", "5,3", "--focal", "50", "-o", "target.toml")),
    ("searched/search.json", ("design", "resume", "searched", "--time", "0.1")),
    ("model.json", REPLAY),
    ("model.json", ("predict", "model.json", "--samples", "5", "--json")),
    ("place.json", (*REPLAY[:3], *REPLAY[5:], "--camera", "place.json")),
    ("captures.csv", ("measure", "merge", *ARGUMENTS["measure merge"])),
    ("camera.json", ("measure", "merge", *ARGUMENTS["measure merge"])),
    ("10.npy", ("measure", "merge", *ARGUMENTS["measure merge"])),
    ("merged/merged.json", ("measure", "find", "merged")),
    *((name, ("sources", name, "--json")) for name in FILMS),
)
"""A file and the command that reads it; the files of `hostile_flags.prepare` and those of `_more`."""

DOTLENS = """\
# A plano-convex lens 100mm f/5
focal_length: 100.0
surfaces:
  stop     2.00   1.00000  0.00    10.000   0
  0        4.00   1.50000  60.00   12.000   1
  -50.0    100.0  1.00000  0.00    12.000   0
"""
LOOK = """\
schema_version = 1
name = "Test"
lens = "tessar-brendel"
[iris]
blades = 5
[[lights]]
field_deg = [5.0, 3.0]
"""
ZEMAX = """\
NAME A plano-convex lens
UNIT MM
ENPD 20
WAVM 1 0.5876 1
SURF 0
  DISZ INFINITY
SURF 1
  STOP
  CURV 0
  DISZ 2
SURF 2
  TYPE STANDARD
  CURV 0
  DISZ 4
  GLAS ___BLANK 1 0 1.5 60
  DIAM 12
SURF 3
  TYPE STANDARD
  CURV -0.02
  DISZ 100
  DIAM 12
SURF 4
  DISZ 0
MNUM 2 1
THIC   0   1 1.0E+10 0 0 0
THIC   0   2 900 0 0 0
THIC   1   1 2 0 0 0
THIC   1   2 3 0 0 0
SDIA   1   2 8 0 0 0
"""
CODEV = """\
RDM N; LEN
TITLE 'A plano-convex lens'
EPD 20
YAN 0 5
PRV
  PWL 700 587.6 486.1
  'OWN' 1.49 1.5 1.51
END
SO 0 1e11
S 0 2
  STO
S 0 4 'OWN'
  CIR 12
S -0.02 100
  ASP
  K -0.5; A 1e-7
SI 0 0
GO
"""
OSLO = """\
// OSLO 6.6 58447 0 0
LEN NEW "A plano-convex lens" 100 4
EBR 10; ANG 5
UNI 1.0
// SRF 0
AIR
TH 1e20
NXT // SRF 1
AST
TH 2
NXT
WV 0.58756 0.48613 0.65627
GLA MOD OWN 1.5 1.507 1.497
TH 4
AP CHK 12
NXT
RD -50
TH 100
AP 12
CC -0.5; AD 1e-7
NXT
WV 0.58756 0.48613 0.65627
END 4
"""
TABLE = """\
# f_number = 5
radius,thickness,n_d,v_d,semi_diameter,A4
stop,2,,,10,
flat,4,1.5,60,12,
-50,100,,,12,1e-7
"""
TRACKS = {
    "track.csv": "frame,x,y,intensity,r,g,b\n1,5,5,1,1,1,1\n2,9,7,2,1,0.5,0.2\n3,12,8,1,1,1,1\n",
    "track.nk": (
        "Tracker4 {\n tracks { { 1 31 1 }\n"
        "{ { 5 1 20 enable e 1 }\n{ 3 1 75 name name 1 }\n{ 2 1 58 track_x track_x 1 }"
        "\n{ 2 1 58 track_y track_y 1 }\n}\n{\n { {curve K x1 1} \"a\" {curve x1 5 9 x4 12} "
        "{curve x1 5 7 0x41000000} }\n}\n}\n}\n"
    ),
    "effects.txt": (
        "Adobe After Effects 8.0 Keyframe Data\n\n\tUnits Per Second\t24\n\tSource Width\t64\n\tSource Height\t36\n"
        "\nMotion Trackers\tA\tB\tAttach Point\n\tFrame\tX pixels\tY pixels\n\t1\t5\t5\n\t2\t9\t7\n"
        "\nEnd of Keyframe Data\n"
    ),
    "paths.txt": "Tracker1 1 -0.5 0.25 30\nTracker1 2 -0.25 0.5 30\nTracker2 2 0 0 30\n",
    "points.txt": "2\na\n0\n2\n1 5.0 5.0\n2 9.0 7.0\nb\n1\n1\n2 1.0 2.0\n",
    "scene.json": (
        '{"format": "flarewright-scene", "version": 1, "fps": 24, "camera": {"frames": [{"frame": 1, "focal_mm": 90, '
        '"sensor_mm": [36, 20.25], "matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}]}, "lights": [{"name": "a", '
        '"kind": "point", "radius": 0.1, "frames": [{"frame": 1, "rgb": [1, 1, 0.5], "matrix": '
        '[[1,0,0,0.1],[0,1,0,0.1],[0,0,1,0],[0,0,0,1]]}, {"frame": 2, "rgb": [1, 1, 0.5], "matrix": '
        '[[1,0,0,0.2],[0,1,0,0.1],[0,0,1,0],[0,0,0,1]]}]}]}'
    ),
}  # fmt: skip
PBRT = "# A plano-convex lens\n0 2 0 20\n1e9 4 1.5 24\n-50 100 1 24\n"
REALFLARE = """\
{"name": "A lens", "focal_length": 100, "fstop": 5, "aperture_index": 0, "lens_elements": [
{"radius": 0, "distance": 2, "height": 10},
{"radius": 0, "distance": 4, "refractive_index": 1.5, "abbe_nr": 60, "height": 12},
{"radius": -50, "distance": 100, "refractive_index": 1, "abbe_nr": 0, "height": 12}]}
"""

WORDS = (
    *NUMBERS[:20],
    "[",
    "]",
    "{",
    "}",
    '"',
    "'",
    "[[[[[[[[",
    "null",
    "true",
    "-",
    "\n",
    "\x00",
    "\ufeff",
    "=",
    "é",
    "1979-05-27",
)


@cache
def _folder() -> Path:
    """Return the prepared folder with a file for every reader."""
    folder = prepared()
    _more(folder)
    return folder


def prepared_files(folder: Path) -> Path:
    """Copy the files of all readers to a new folder, and return it."""
    shutil.copytree(_folder(), folder)
    return folder


def _more(folder: Path) -> None:
    """Write the files that only readers need."""
    (folder / "lens.lens").write_text(DOTLENS, "utf-8")
    (folder / "lens.zmx").write_text(ZEMAX, "utf-8")
    for name, text in (("seq", CODEV), ("len", OSLO), ("csv", TABLE), ("dat", PBRT), ("json", REALFLARE)):
        (folder / f"lens.{name}").write_text(text, "utf-8")
    for name, text in TRACKS.items():
        (folder / name).write_text(text, "utf-8")
    (folder / "look.toml").write_text(LOOK, "utf-8")
    (folder / "spectrum.csv").write_text("400,1\n500,2\n600,1.5\n700,1\n", "utf-8")
    y, x = np.mgrid[:24, :24] - 11.5
    disc = Image.fromarray((255 * (np.hypot(x, y) < 9)).astype(np.uint8))
    disc.save(folder / "iris.png")
    disc.save(folder / "dirt.png")
    disc.resize((32, 18)).save(folder / "matte.png")
    photo = np.exp(-0.5 * (np.mgrid[:54, :96][1] - 50) ** 2 / 9.0)[..., None].repeat(3, axis=2).astype(np.float32)
    np.save(folder / "photo.npy", photo)
    eight = Image.fromarray((255 * photo).astype(np.uint8))
    tifffile.imwrite(folder / "photo.tiff", (65535 * photo).astype(np.uint16))
    eight.save(folder / "photo.jpg")
    codes = np.asarray(eight)
    for film in FILMS:
        write_film(folder / film, ((k, np.roll(codes, k, axis=1)) for k in range(6)), eight.size, Fraction(24))
    (folder / "place.json").write_text('{"light": [0.2, 0.1, -1.0], "size_px": [32, 18]}', "utf-8")


def damaged(data: bytes, random_: random.Random) -> bytes:
    """Return the bytes with one to four changes."""
    out = bytearray(data)
    for _ in range(random_.randint(1, 4)):
        at = random_.randrange(len(out) + 1) if out else 0
        match random_.randrange(8):
            case 0:
                out[at : at + 1] = bytes([random_.randrange(256)])
            case 1:
                del out[at : at + random_.randint(1, 64)]
            case 2:
                out[at:at] = random_.choice(WORDS).encode()
            case 3:
                part = bytes(out[at : at + random_.randint(1, 200)])
                out[at:at] = part * random_.choice((1, 2, 50))
            case 4:
                del out[at:]
            case 5 | 6:
                _replace_number(out, random_)
            case _:
                out[at : at + 4] = random_.choice(
                    (b"\xff\xff\xff\xff", b"\x00\x00\x00\x00", b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f")
                )
    return bytes(out)


def _replace_number(out: bytearray, random_: random.Random) -> None:
    """Replace one number of a text by a hostile one."""
    places = [
        k
        for k in range(len(out))
        if 48 <= out[k] <= 57 and (k == 0 or not (48 <= out[k - 1] <= 57 or out[k - 1] == 46))
    ]
    if places:
        at = end = random_.choice(places)
        while end < len(out) and chr(out[end]) in "0123456789.e+-":
            end += 1
        out[at:end] = random_.choice(NUMBERS).encode()


def run(seed: int) -> Verdict:
    """Damage one file and let its command read it."""
    name, command = READERS[seed % len(READERS)]
    random_ = random.Random(seed)
    with tempfile.TemporaryDirectory() as made:
        folder = prepared_files(Path(made) / "work")
        path = folder / name
        data = damaged(path.read_bytes(), random_)
        path.write_bytes(data)
        held, answer = judged(command, folder, endless="--time" in command)
    return Verdict("files", f"{' '.join(command[:3])} with {name}, {len(data)} bytes", held, answer)
