"""A picture that is only looked at: what eight bits hardly show may be missing, and nothing else."""

import numpy as np
import pytest

from flarewright.editor.files import project_for_lens
from flarewright.model import Camera, Output
from flarewright.render.display import auto_exposure, view
from flarewright.render.render import render


@pytest.mark.parametrize("lens", ["tessar-brendel", "nikkor-85-f1.4"])
def test_what_a_screen_shows_is_the_whole_picture(lens):
    """All ghosts and all wavelengths: light, colour and shapes stay, only detail below the screen's steps goes."""
    project = project_for_lens(lens).replace(
        camera=Camera(size_px=(480, 270)), output=Output(layers="passes", starburst=False)
    )
    exact, seen = (
        render(project.replace(quality=project.quality.replace(screen=screen))).layers[0].pixels
        for screen in (False, True)
    )
    light = exact.sum(axis=(0, 1), dtype=np.float64)
    np.testing.assert_allclose(seen.sum(axis=(0, 1), dtype=np.float64), light, rtol=5e-3)
    assert np.abs(seen - exact).sum() < 0.015 * np.abs(exact).sum()
    exposure = auto_exposure(exact)
    apart = np.abs(view(seen, exposure, "srgb").astype(int) - view(exact, exposure, "srgb").astype(int))
    assert apart.mean() < 0.5
    assert np.percentile(apart, 99.0) <= 3
    # and it is another picture, not the same one
    assert apart.any()
