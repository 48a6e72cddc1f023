"""A ghost drawn on a separate sheet, coarser than the picture and with a margin, has the colour of the picture.

The colour depends on the rays that land in the picture: coatings pass other wavelengths at other angles.
"""

from dataclasses import replace

import numpy as np
import pytest

from flarewright.editor.session.files import project_for_lens
from flarewright.model import Camera
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts.traced_ghosts import draw_alone, find_final
from flarewright.render.image.canvas import blank, merge
from flarewright.render.image.sheet import Sheet
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots


@pytest.mark.parametrize(("level", "error"), [(0.0, 2e-3), (1e4, 1e-2)], ids=["all wavelengths", "few wavelengths"])
def test_a_coarse_sheet_keeps_flux_and_colour(level, error):
    """Parts of the ghost outside the picture, which have another colour, do not count."""
    project = project_for_lens("nikkor-85-f1.4").replace(camera=Camera(size_px=(120, 68)))
    settled = resolve_project(project)
    shot = make_shots(settled, make_opening(settled, None))[0]
    paths = [path for path in ghost_paths(settled.lens, "all") if path.name in ("16-10", "15-10", "13-12")]
    for path in paths:
        item = find_final(shot, path)
        light = []
        for detail in (0, 2):
            canvas = blank(shot.size_px)
            own, quality = [replace(item, detail=detail)], settled.project.quality
            draw_alone(own, quality, canvas, Sheet(), level=level * bool(detail))
            light.append(merge(canvas.planes, canvas.size_px).sum(axis=(0, 1), dtype=np.float64))
        fine, coarse = light
        np.testing.assert_allclose(coarse, fine, atol=error * fine.max(), err_msg=path.name)
