"""Write a lens from Python: one pair of cemented elements, bent three ways, each with its own ghosts.

Usage: python lens_from_python.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import flarewright as fw
from flarewright.io.lens.lens_writer import write_lens

CROWN = fw.Medium(glass="N-BK7", n_d=1.5168, v_d=64.17)
FLINT = fw.Medium(glass="N-SF5", n_d=1.6727, v_d=32.25)


def doublet(bending: float) -> fw.Lens:
    """Return a doublet behind a stop; `bending` in 1/mm is added to every curvature and keeps its power."""
    rows = (
        fw.Stop(thickness=6.0),
        fw.Surface(curvature=1 / 61.0 + bending, thickness=6.0, medium=CROWN),
        fw.Surface(curvature=-1 / 44.0 + bending, thickness=2.5, medium=FLINT),
        fw.Surface(curvature=-1 / 130.0 + bending, coating=fw.QuarterWave(center_wavelength_nm=550)),
    )
    return fw.Lens(name=f"Doublet bent by {bending:+.3f}/mm", f_number=5.6, field_deg=8.0, rows=rows)


def main(folder: Path) -> None:
    """Write a lens file and a picture for each bending into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, bending in enumerate((-0.006, 0.0, 0.006), start=1):
        path = folder / f"doublet-{number}.toml"
        write_lens(doublet(bending), path)
        # loading attaches the dispersion of the glasses and estimates the semi-diameters
        lens = fw.load_lens(path)
        order = fw.paraxial(lens)
        brightest = max(fw.ghosts(lens, (4.0, 0.0)).ghosts, key=lambda row: row.peak_irradiance)
        name = f"{brightest.first_reflection}-{brightest.second_reflection}"
        print(f"{lens.name}: focal length {order.efl:.2f} mm")
        print(f"  most intense ghost {name}: {brightest.peak_irradiance:.1e}/mm2, {brightest.rms_radius_mm:.2f} mm rms")
        project = fw.Project(
            lens=str(path), lights=[fw.Light(field_deg=(4.0, 2.0))], camera=fw.Camera(size_px=(160, 90))
        )
        rendering = fw.render(project)
        fw.write_exr(path.with_suffix(".exr"), rendering.layers, (160, 90), metadata={})


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
