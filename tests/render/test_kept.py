"""What pictures keep for the next one."""

import numpy as np

from flarewright.render.kept import Kept, Shelf


def test_what_was_asked_for_longest_ago_is_let_go_of():
    kept = Kept(10)
    for name, size in (("a", 4), ("b", 4)):
        kept.put(name, name.upper(), size)
    assert kept.get("a") == "A"
    kept.put("c", "C", 4)
    assert kept.get("b") is None
    assert (kept.get("a"), kept.get("c")) == ("A", "C")
    # a key stands for one thing
    kept.put("a", "other", 1)
    assert kept.get("a") == "A"
    # what is larger than all that may be held is held alone
    kept.put("d", "D", 20)
    assert kept.get("d") == "D"
    assert kept.get("a") is None


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
