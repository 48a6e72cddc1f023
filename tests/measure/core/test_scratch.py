"""Reused working memory: zeroed on request, separate for each thread."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from flarewright.measure.core.scratch import ScratchBuffer


def test_memory_is_zeroed_and_separate_for_each_thread():
    room = ScratchBuffer()
    mine = room.zeros(3, 5)
    mine[...] = 7.0
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(room.zeros, 3, 5).result()
    assert not np.shares_memory(mine, other)
    assert (mine == 7.0).all()
    again = room.zeros(2, 4)
    assert np.shares_memory(mine, again)
    assert not again.any()
    assert room.zeros(6, 7).shape == (6, 7)
