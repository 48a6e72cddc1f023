"""A patch at half its resolution."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import shape, views

from flarewright.measure.fitting.ghost_fit import cost_of
from flarewright.measure.fitting.patches import coarser_patches, patches_of, shows

ONE = shape(-60.0, 20.0, 0.4)


@pytest.mark.parametrize(("left", "top"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_a_ghost_keeps_its_position(left, top):
    """The drawn ghost explains the coarse patch for any parity of the patch's origin."""
    (patch,) = patches_of(ONE, views((ONE,))[9:10], 1)
    cut = replace(
        patch, left=patch.left + left, top=patch.top + top, pixels=patch.pixels[top:, left:],
        weight=patch.weight[top:, left:],
    )  # fmt: skip
    coarse = coarser_patches(cut)
    # four pixels became one, and the residual is noise alone
    assert coarse.pixels.size == pytest.approx(cut.pixels.size / 4, rel=0.1)
    assert cost_of(ONE, [coarse], error=0.0) / coarse.pixels.size == pytest.approx(1.0, abs=0.15)


def test_unmeasured_pixels_have_no_weight():
    (patch,) = patches_of(ONE, views((ONE,))[9:10], 1)
    weight = patch.weight.copy()
    weight[6, 8] = 0.0
    coarse = coarser_patches(replace(patch, weight=weight))
    assert np.count_nonzero(coarse.weight == 0.0) == 1


def test_a_ghost_outside_all_views_is_not_shown():
    seen = views(())[5:8]
    assert shows(ONE, seen)
    assert not shows(shape(9000.0, 20.0, 0.4), seen)
