"""Caches between pictures."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np

from flarewright.render.image.cache import BufferPool, Kept


def test_the_least_recently_used_value_is_evicted():
    kept, asked = Kept(10), []

    def made(name, size):
        def make():
            asked.append(name)
            return name.upper()

        return kept.made(name, make, lambda _: size)

    assert (made("a", 4), made("b", 4), made("a", 4)) == ("A", "B", "A")
    assert asked == ["a", "b"]
    made("c", 4)
    # b is the least recently used; a and c are still cached
    assert (made("a", 4), made("c", 4)) == ("A", "C")
    assert asked == ["a", "b", "c"]
    # a key has one value, also None
    assert kept.made("a", lambda: "other") == "A"
    assert made("b", 4) == "B"
    assert asked == ["a", "b", "c", "b"]
    none = Kept(10)
    assert none.made("n", lambda: None) is None
    assert none.made("n", lambda: "other") is None
    # a value larger than the capacity is held alone
    assert made("d", 20) == "D"
    assert made("d", 20) == "D"
    made("a", 4)
    assert asked[4:] == ["d", "a"]


def test_concurrent_threads_get_the_same_value():
    kept, both = Kept(10), Barrier(2)

    def make():
        both.wait(10.0)
        return object()

    with ThreadPoolExecutor(2) as pool:
        one, other = pool.map(lambda _: kept.made("a", make), range(2))
    assert one is other


def numbers(*sizes):
    rng = np.random.default_rng(3)
    return [rng.random(size, dtype=np.float32) for size in sizes]


def test_a_block_holds_every_array_once():
    buffers, (a, b, c) = BufferPool(100), numbers(10, 20, 30)
    block, starts = buffers.laid([a, b, a])
    assert starts[0] == starts[2]
    for part, start in zip((a, b), starts, strict=False):
        np.testing.assert_array_equal(block[start : start + part.size], part)
    again, (there, here) = buffers.laid([c, b])
    assert again is block
    assert here == starts[1]
    np.testing.assert_array_equal(block[there : there + 30], c)


def test_returned_blocks_stay_valid_when_a_block_is_full():
    buffers, (a, b, c) = BufferPool(40), numbers(10, 20, 30)
    first, (at_a, at_b) = buffers.laid([a, b])
    second, (at_c, again) = buffers.laid([c, a])
    assert second is not first
    np.testing.assert_array_equal(first[at_a : at_a + 10], a)
    np.testing.assert_array_equal(first[at_b : at_b + 20], b)
    np.testing.assert_array_equal(second[at_c : at_c + 30], c)
    np.testing.assert_array_equal(second[again : again + 10], a)
    # arrays larger than a block get a block of their size
    (large,) = numbers(200)
    block, (start,) = buffers.laid([large])
    np.testing.assert_array_equal(block[start : start + 200], large)
