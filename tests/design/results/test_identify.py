"""What ghosts determine of a lens."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.design.problem.prescription import structure_of, vector_of
from flarewright.design.results.identify import identify
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import load_lens


@pytest.mark.parametrize("row", [4, 5])
def test_a_gap_of_zero_is_a_number_like_the_others(row):
    """A stop that stands on a surface left its gap free whatever was measured: a fraction of 0 is no change."""
    lens = load_lens("heliar-tronnier")
    order = first_order(lens, 16.0)
    structure, vector = structure_of(lens), vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    slopes = np.array([0.1])
    known = identify(structure, vector, slopes, brightness=True)
    vector[1 + row] = 0.0
    touching = identify(structure, vector, slopes, brightness=True)
    assert touching.rank == known.rank == known.unknowns
    assert touching.free == touching.remedies == ()
