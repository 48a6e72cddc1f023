"""Write the ghost analysis of a lens as CSV and print its five brightest ghosts.

Usage: python ghost_table.py [FOLDER]
"""

import csv
import sys
import tempfile
from pathlib import Path

import flarewright as fw

COLUMNS = ("first_reflection", "second_reflection", "throughput_mm2", "rms_radius_mm", "peak_irradiance", "bounded_by")


def main(folder: Path) -> None:
    """Write ghosts.csv into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lens = fw.load_lens("tessar-brendel")
    table = fw.ghosts(
        lens, (8.0, 0.0), f_number=5.6, coating=fw.Everywhere(coating=fw.QuarterWave(center_wavelength_nm=550))
    )
    path = folder / "ghosts.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow((*COLUMNS, "x_mm", "y_mm"))
        for row in table.ghosts:
            writer.writerow((*(getattr(row, name) for name in COLUMNS), *row.centroid_mm))
    print(f"{lens.name}, focal length {table.efl:.2f} mm, {len(table.ghosts)} ghosts in {path}")
    print("the five brightest, as parts of the direct image's flux:")
    for row in table.ghosts[:5]:
        share = row.throughput_mm2 / table.direct.throughput_mm2
        x, y = row.centroid_mm
        print(f"  {row.first_reflection}-{row.second_reflection}: {share:.2e}, around {x:+.2f}, {y:+.2f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
