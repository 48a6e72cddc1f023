"""What pictures keep for the next one."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np

from flarewright.render.kept import Kept, Shelf


def test_what_was_asked_for_longest_ago_is_let_go_of():
    kept, asked = Kept(10), []

    def made(name, size):
        def make():
            asked.append(name)
            return name.upper()

        return kept.made(name, make, lambda _: size)

    assert (made("a", 4), made("b", 4), made("a", 4)) == ("A", "B", "A")
    assert asked == ["a", "b"]
    made("c", 4)
    # b was asked for longest ago; a and c are still there
    assert (made("a", 4), made("c", 4)) == ("A", "C")
    assert asked == ["a", "b", "c"]
    # a key stands for one thing, nothing among them
    assert kept.made("a", lambda: "other") == "A"
    assert made("b", 4) == "B"
    assert asked == ["a", "b", "c", "b"]
    none = Kept(10)
    assert none.made("n", lambda: None) is None
    assert none.made("n", lambda: "other") is None
    # what is larger than all that may be held is held alone
    assert made("d", 20) == "D"
    assert made("d", 20) == "D"
    made("a", 4)
    assert asked[4:] == ["d", "a"]


def test_threads_that_ask_at_once_get_the_same():
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


def test_a_shelf_holds_every_array_once():
    shelf, (a, b, c) = Shelf(100), numbers(10, 20, 30)
    block, starts = shelf.laid([a, b, a])
    assert starts[0] == starts[2]
    for part, start in zip((a, b), starts, strict=False):
        np.testing.assert_array_equal(block[start : start + part.size], part)
    again, (there, here) = shelf.laid([c, b])
    assert again is block
    assert here == starts[1]
    np.testing.assert_array_equal(block[there : there + 30], c)


def test_what_was_handed_out_stays_when_a_shelf_is_full():
    shelf, (a, b, c) = Shelf(40), numbers(10, 20, 30)
    first, (at_a, at_b) = shelf.laid([a, b])
    second, (at_c, again) = shelf.laid([c, a])
    assert second is not first
    np.testing.assert_array_equal(first[at_a : at_a + 10], a)
    np.testing.assert_array_equal(first[at_b : at_b + 20], b)
    np.testing.assert_array_equal(second[at_c : at_c + 30], c)
    np.testing.assert_array_equal(second[again : again + 10], a)
    # more than a block holds has one of its own size
    (large,) = numbers(200)
    block, (start,) = shelf.laid([large])
    np.testing.assert_array_equal(block[start : start + 200], large)
