from concurrent.futures import ThreadPoolExecutor

import pytest

from flarewright.measure.shared_out import dealt_out, shared_out, side_by_side


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


def test_large_pieces_share_out_small_ones_to_the_same_pool():
    def work(first):
        return sum(shared_out(lambda a: a, range(first, first + 9), pool=pool))

    with ThreadPoolExecutor(1) as pool:
        made = side_by_side(*(lambda k=k: work(k) for k in range(4)), pool=pool)
    assert made == [sum(range(k, k + 9)) for k in range(4)]


def test_large_pieces_come_in_their_order_without_a_pool():
    assert side_by_side(lambda: 1, lambda: 2, pool=None) == [1, 2]


@pytest.mark.parametrize("threads", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_every_piece_is_dealt_out_once(threads, count, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    done = []
    with ThreadPoolExecutor(3) as pool:
        dealt_out(
            lambda first, every: done.extend(range(first, count, every)), count, None if threads is None else pool
        )
    assert sorted(done) == list(range(count))
