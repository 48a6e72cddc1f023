"""Memory that is kept: zeros again, and every thread's own."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from flarewright.measure.room import Room


def test_what_was_left_in_it_is_gone_and_no_thread_sees_anothers():
    room = Room()
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
