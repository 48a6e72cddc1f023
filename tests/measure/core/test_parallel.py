from concurrent.futures import ThreadPoolExecutor

import pytest

from flarewright.measure.core.parallel import dealt_out, map_batched, run_concurrently


@pytest.mark.parametrize("count", [0, 1, 2, 7, 40])
def test_results_have_the_order_of_the_pieces(count):
    pieces = range(count)
    with ThreadPoolExecutor(3) as pool:
        made = map_batched(lambda a, b: (a, b), pieces, [2 * k for k in pieces], pool=pool)
    assert made == [(k, 2 * k) for k in pieces]
    assert made == map_batched(lambda a, b: (a, b), pieces, [2 * k for k in pieces], pool=None)


def test_an_error_in_a_thread_is_raised():
    with ThreadPoolExecutor(2) as pool, pytest.raises(ZeroDivisionError):
        map_batched(lambda a: 1 // a, [1, 2, 0, 4], pool=pool)


def test_large_pieces_may_submit_small_ones_to_the_same_pool():
    def work(first):
        return sum(map_batched(lambda a: a, range(first, first + 9), pool=pool))

    with ThreadPoolExecutor(1) as pool:
        made = run_concurrently(*(lambda k=k: work(k) for k in range(4)), pool=pool)
    assert made == [sum(range(k, k + 9)) for k in range(4)]


def test_large_pieces_run_in_order_without_a_pool():
    assert run_concurrently(lambda: 1, lambda: 2, pool=None) == [1, 2]


@pytest.mark.parametrize("pooled", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_strided_tasks_cover_every_piece_once(pooled, count, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    calls = []
    with ThreadPoolExecutor(3) as pool:
        dealt_out(lambda first, every: calls.append(range(first, count, every)), count, pool if pooled else None)
    assert sorted(piece for call in calls for piece in call) == list(range(count))
    assert len(calls) == (max(1, min(3, count)) if pooled else 1)
