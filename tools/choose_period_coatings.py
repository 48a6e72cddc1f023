"""Write the coating preset "period" into the lenses of the library: plausible films of each lens' time.

    python tools/choose_period_coatings.py            # prints the presets
    python tools/choose_period_coatings.py --write

Makers do not publish stacks, and lens patents do not describe coatings, so the choice is a guess. What is known is the
look of an era: before 1938 glass was bare; then every surface in air had one film of magnesium fluoride, whose
thickness followed the maker's preferred reflection colour, straw, amber, purple or blue; multicoatings since the 1970s
reflect green, amber, magenta and blue. So each surface of a lens gets one of these colours in turn. Of the films of its
time, the program takes the one whose reflection on the surface's glass is nearest to that colour and to a typical
strength. The random generator is seeded with the lens' name, so that adding a lens does not change the others.
"""

from __future__ import annotations

import argparse
import re
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flarewright.io.lens.coating_text import parse_coating
from flarewright.io.lens.library import library_names
from flarewright.model import Lens, Stop
from flarewright.optics.coatings.response import coating_response
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import gap_indices
from flarewright.render.scene.resolve import load_lens

Floats = NDArray[np.float64]

LENSES = Path(__file__).resolve().parents[1] / "src" / "flarewright" / "lenses"

PRESET = "period"

ERA = {
    "angenieux-50-f1.1": "single",
    "biotar-50-f1.4": "bare",
    "canon-28-80": "modern",
    "canon-70-200": "modern",
    "canon-70-200-tele": "modern",
    "canon-70-200-wide": "modern",
    "double-gauss-tronnier": "single",
    "fisheye-nikkor-10.5": "modern",
    "flektogon-35": "single",
    "heliar-tronnier": "single",
    "nikkor-180-ed": "early",
    "nikkor-85-f1.4": "modern",
    "nikon-28-75": "modern",
    "petzval-kodak": "single",
    "speed-panchro-50": "bare",
    "takumar-50-f1.4": "single",
    "tessar-brendel": "single",
    "triplet-pestrecov": "single",
}
"""Era by the year of the patent, or of the lens as sold where the maker is known to have changed it."""

ROLL = {
    "angenieux-50-f1.1": 8, "canon-28-80": 7, "canon-70-200": 1, "double-gauss-tronnier": 2, "fisheye-nikkor-10.5": 1,
    "flektogon-35": 8, "heliar-tronnier": 2, "nikkor-180-ed": 6, "nikkor-85-f1.4": 17, "nikon-28-75": 2,
    "petzval-kodak": 1, "takumar-50-f1.4": 4, "tessar-brendel": 8, "triplet-pestrecov": 4,
}  # fmt: skip
"""Seed variant of each lens: the one of twenty that looked best."""

HUES = {
    "bare": {},
    "single": {
        "amber": (1.0, 0.5, 0.1),
        "gold": (1.0, 0.65, 0.2),
        "blue": (0.1, 0.3, 1.0),
        "straw": (1.0, 0.8, 0.4),
        "purple": (1.0, 0.3, 1.0),
    },
    "early": {"amber": (1.0, 0.5, 0.1), "green": (0.3, 1.0, 0.5), "blue": (0.2, 0.4, 1.0), "magenta": (1.0, 0.3, 0.7)},
    "modern": {"green": (0.3, 1.0, 0.4), "magenta": (1.0, 0.3, 0.8), "amber": (1.0, 0.6, 0.1), "cyan": (0.1, 0.7, 1.0)},
}
"""Reflection colours, linear Rec.709 over the largest channel. One in five single films is purple: their ghosts are the
products of two reflections and add up, so that more of them turn every picture magenta."""

STRENGTH = {"bare": 0.04, "single": 0.015, "early": 0.006, "modern": 0.003}
"""Reflectance of the strongest channel."""

NEAR = 6
"""The choice is random among this number of nearest films, because batches of real coatings vary."""


def candidates(era: str) -> list[str]:
    """Return the films of an era as coating texts."""
    if era == "single":
        return [f"quarter-wave:{nm}:1.38" for nm in range(420, 661, 6)]
    stacks = [f"early-multicoat*{f:.2f}" for f in np.arange(0.80, 1.101, 0.02)]
    # quarter, half, quarter with an inner film of another index, which gives R a hump in the middle of the spectrum
    stacks += [
        f"stack:1.38:{nm / 5.52:.0f},2.05:{nm / 4.1:.0f},{n:.2f}:{nm / (4.0 * n):.0f}"
        for nm in range(470, 611, 20)
        for n in (1.63, 1.70, 1.76, 1.84)
    ]
    if era == "modern":
        stacks += [f"modern-broadband*{f:.2f}" for f in np.arange(0.80, 1.081, 0.02)]
    return stacks


def in_air(lens: Lens) -> list[bool]:
    """Return which rows are surfaces between glass and air."""
    n = gap_indices(lens, D_LINE_NM)
    return [min(n[k], n[k + 1]) == 1.0 and n[k] != n[k + 1] for k in range(len(lens.rows))]


def reflection(text: str, glass: float) -> Floats:
    """Return the reflection of daylight from a coated glass in air, linear Rec.709."""
    return coating_response(parse_coating(text), glass, glass, 15.0).rgb[0]


def chosen(name: str, era: str, roll: int | None = None) -> list[str]:
    """Choose the coatings of a lens, one text per row."""
    lens = load_lens(name)
    # both ends of a zoom have the same glass
    body = name.removesuffix("-wide").removesuffix("-tele")
    rng = np.random.default_rng([zlib.crc32(body.encode()), ROLL.get(body, 0) if roll is None else roll])
    n, deck = gap_indices(lens, D_LINE_NM), list[tuple[float, ...]]()
    texts = []
    for k, (row, air) in enumerate(zip(lens.rows, in_air(lens), strict=True)):
        if isinstance(row, Stop) or not air or era == "bare":
            texts.append("none")
            continue
        if not deck:
            # use all colours before repeating one
            hues = list(HUES[era].values())
            deck.extend(hues[i] for i in rng.permutation(len(hues)))
        texts.append(nearest(era, max(n[k], n[k + 1]), deck.pop(), rng))
    return texts


def nearest(era: str, glass: float, hue: tuple[float, ...], rng: np.random.Generator) -> str:
    """Choose films by the colour and the strength of their reflection."""
    texts = candidates(era)
    seen = np.array([reflection(text, glass) for text in texts])
    peak = seen.max(axis=1, keepdims=True)
    far = np.abs(np.clip(seen / peak, 0.0, 1.0) - hue).sum(axis=1) + 0.5 * np.abs(np.log(peak[:, 0] / STRENGTH[era]))
    return texts[int(rng.choice(np.argsort(far)[:NEAR]))]


def lines(texts: list[str]) -> str:
    """Return the preset as lines of a lens file."""
    wide = [", ".join(f'"{text}"' for text in texts[k : k + 4]) for k in range(0, len(texts), 4)]
    return f"{PRESET} = [\n" + "".join(f"  {line},\n" for line in wide) + "]\n"


def rewritten(text: str, preset: str) -> str:
    """Insert the preset into a lens file's text, replacing an existing one."""
    without = re.sub(rf"(?ms)^{PRESET} = \[\n.*?^\]\n", "", text)
    head = "[coating_presets]\n"
    if head not in without:
        return f"{without.rstrip()}\n\n{head}{preset}"
    return without.replace(head, head + preset, 1)


def main() -> None:
    """Print or write the presets of all lenses."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    write = parser.parse_args().write
    # the anamorphic is our own design with a coating made for its streak
    for name in (name for name in library_names() if name in ERA):
        preset = lines(chosen(name, ERA[name]))
        if write:
            path = LENSES / f"{name}.toml"
            path.write_text(rewritten(path.read_text(encoding="utf-8"), preset), encoding="utf-8")
        else:
            print(f"{name}: {preset}")


if __name__ == "__main__":
    main()
