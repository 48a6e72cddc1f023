"""The analysis of ghosts reports its progress, which rises to 1; the result does not depend on it."""

import pytest

from flarewright.model import AsLens
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.rays.ghost_table import GhostQuery
from flarewright.render.analysis import find_ghosts
from flarewright.render.scene.resolve import load_lens


# ghosts of four reflections follow those of two
@pytest.mark.parametrize("orders", [pytest.param(2, marks=pytest.mark.slow), 4])
def test_progress_rises_to_the_end(orders):
    lens = load_lens("triplet-pestrecov")
    query = GhostQuery((8.0, 5.0), paths="same-side", orders=orders, order4_limit=0.05)
    seen = []
    # stopped down, a table takes less time
    given = (lens, first_order(lens, f_number=16.0), AsLens(), query)
    table, _ = find_ghosts(*given, progress=lambda part, words: seen.append((part, words)))
    parts = [part for part, _ in seen]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    assert len(seen) >= 1 + len(table.ghosts)
    assert all(words for _, words in seen)
    assert find_ghosts(*given)[0] == table
