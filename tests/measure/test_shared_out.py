from concurrent.futures import ThreadPoolExecutor

import pytest

from flarewright.measure.shared_out import shared_out


@pytest.mark.parametrize("count", [0, 1, 2, 7, 40])
def test_what_is_made_comes_in_the_order_of_the_pieces(count):
    pieces = range(count)
    with ThreadPoolExecutor(3) as pool:
        made = shared_out(lambda a, b: (a, b), pieces, [2 * k for k in pieces], pool=pool)
    assert made == [(k, 2 * k) for k in pieces]
    assert made == shared_out(lambda a, b: (a, b), pieces, [2 * k for k in pieces], pool=None)


def test_what_goes_wrong_in_a_thread_is_heard():
    with ThreadPoolExecutor(2) as pool, pytest.raises(ZeroDivisionError):
        shared_out(lambda a: 1 // a, [1, 2, 0, 4], pool=pool)
