"""The focal lengths of sixty published `.zmx` files, against a separate paraxial trace of the numbers in each file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sensor_rays import trace_rays

from flarewright.errors import LensError
from flarewright.io.lens.glass_catalogue import by_name
from flarewright.model import Surface
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path
from flarewright.optics.lens.zoom import at_position
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens

CORPUS = Path(__file__).parents[3] / "shared" / "zmx_corpus"
FILES = sorted(CORPUS.glob("*.zmx"))
# another medium than air in front, and an image on the cover glass
REFUSED = {
    "Fujifilm_Fujinon_XF200mm_F2_R_LM_OIS_WR_with_Fujifilm_Fujinon_XF1.4X_TC_F2_WR.zmx": "in front of the last surface",
    "Nikon_R-UW_AF_Zoom-Nikkor_20-35mm_f2.8.zmx": "the lens stands in a medium",
}

pytestmark = pytest.mark.skipif(not FILES, reason="the corpus is not part of the repository")


def focal_length(text, gaps=None):
    """Trace a ray parallel to the axis through the surfaces of a file and return h / slope, mm.

    `gaps` replaces the distances behind some surfaces.
    """
    blocks = [part.splitlines() for part in text.split("\nSURF ")[1:]]
    h, slope, before = 1.0, 0.0, 1.0
    for number, lines in enumerate(blocks[1:-1], start=1):
        words = {line.split()[0]: line.split()[1:] for line in lines[1:] if line.split()}
        glass, square = words.get("GLAS"), [line.split()[2] for line in lines if line.split()[:2] == ["PARM", "1"]]
        after = 1.0 if glass is None else float(glass[3]) if len(glass) > 4 else by_name(glass[0]).n_d
        curvature = float(words["CURV"][0]) + 2.0 * (float(square[0]) if words.get("TYPE") == ["EVENASPH"] else 0.0)
        slope = (before * slope + (before - after) * curvature * h) / after
        gap = float(words["DISZ"][0].replace("INFINITY", "0"))
        h, before = h + slope * (gaps or {}).get(number, gap), after
    return -1.0 / slope


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_focal_length_follows_from_the_numbers_of_the_file(path):
    if (reason := REFUSED.get(path.name)) is not None:
        with pytest.raises(LensError, match=reason):
            load_lens(path)
        return
    lens, text = load_lens(path), text_of(path)
    assert first_order(lens).efl == pytest.approx(focal_length(text), rel=1e-6)
    # every configuration is a position, and has the focal length that its gaps give
    cells = [line.split() for line in text.splitlines() if line.startswith("THIC ")]
    wanted = [
        focal_length(text, {int(cell[1]): float(cell[3]) for cell in cells if cell[2] == str(number)})
        for number in range(1, 1 + max((int(cell[2]) for cell in cells), default=0))
    ]
    found = [first_order(at_position(lens, position)).efl for position in lens.positions]
    assert found == pytest.approx(wanted, rel=1e-6)


def text_of(path):
    data = path.read_bytes()
    return data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig").replace("\r", "")


@pytest.mark.parametrize("part", ["X100F", "GF30mm", "XC15-45mm"])
def test_odd_terms_bring_the_light_of_a_star_to_one_point(part):
    path = next((path for path in FILES if part in path.name), None)
    if path is None:
        pytest.skip("the corpus lacks this file")
    lens = load_lens(path)
    order = first_order(lens)
    heights = np.array([0.3, 0.5, 0.7, 0.8]) * 0.5 * order.entrance_pupil_diameter

    def misses(rows):
        packed = pack_lens(lens.replace(rows=rows), order, (None,) * len(rows), np.array([D_LINE_NM]))
        return np.abs(trace_rays(packed, direct_path(lens), 0.0 * heights, heights, (0.0, 0.0))["y"])

    assert misses(lens.rows).max() < 0.009
    even = tuple(row.replace(odd_asphere=()) if isinstance(row, Surface) else row for row in lens.rows)
    assert misses(even).max() > 0.5
