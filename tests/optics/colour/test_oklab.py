"""Oklab against the pairs that its author published."""

import numpy as np
import pytest

from flarewright.optics.colour.rgb import oklab, xyz_to_rgb_matrix


@pytest.mark.parametrize(
    ("xyz", "lab"),
    [
        ((0.950, 1.000, 1.089), (1.000, 0.000, 0.000)),
        ((1.000, 0.000, 0.000), (0.450, 1.236, -0.019)),
        ((0.000, 1.000, 0.000), (0.922, -0.671, 0.263)),
        ((0.000, 0.000, 1.000), (0.153, -1.415, -0.449)),
    ],
)
def test_it_is_what_its_author_printed(xyz, lab):
    assert np.allclose(oklab(xyz_to_rgb_matrix("rec709") @ np.array(xyz)), lab, atol=2e-3)


def test_grey_has_no_hue():
    for level in (0.01, 0.5, 2.0):
        found = oklab(np.full(3, level))
        assert found[0] == pytest.approx(level ** (1.0 / 3.0), rel=1e-6)
        assert np.abs(found[1:]).max() < 1e-6
