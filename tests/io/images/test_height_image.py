"""Images of a figure error: position and orientation of the heights."""

import numpy as np
import pytest
from PIL import Image

from flarewright.errors import LensError
from flarewright.io.images.height_image import read_heights


def test_heights_run_from_the_left_and_from_the_bottom(tmp_path):
    grey = np.zeros((4, 6), dtype=np.uint8)
    # bright upper right corner, grey lower left one
    grey[0, 5], grey[3, 0] = 255, 51
    Image.fromarray(grey).save(tmp_path / "a.png")
    heights = np.array(read_heights(tmp_path / "a.png"))
    # the longer side sets the samples; four rows are stretched over six
    assert heights.shape == (6, 6)
    assert heights[5, 5] == pytest.approx(1.0)
    assert heights[0, 0] == pytest.approx(0.2)
    assert (heights[0, 5], heights[5, 0]) == (0.0, 0.0)
    # area averages preserve the image's mean
    assert heights.mean() == pytest.approx((1.0 + 0.2) / 24.0)


def test_an_image_too_small_for_a_figure_is_refused(tmp_path):
    Image.fromarray(np.zeros((3, 9), dtype=np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(LensError, match="4 to"):
        read_heights(tmp_path / "a.png")
