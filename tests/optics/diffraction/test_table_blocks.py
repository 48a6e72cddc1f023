"""Tables lie one after another in a block, keep their values, and free the block with the last of them."""

from __future__ import annotations

import gc
import weakref

import numpy as np

from flarewright.optics.diffraction.table_blocks import TableBlocks, common_block


def numbers(*shape):
    return np.random.default_rng(4).random(shape, dtype=np.float32)


def test_tables_of_a_block_are_read_from_it():
    blocks = TableBlocks(100)
    square, row = numbers(4, 5), numbers(7)
    one, two, three = blocks.joined([square, row]), blocks.joined([row]), blocks.joined([2.0 * row])
    np.testing.assert_array_equal(one, [*square.ravel(), *row])
    found = common_block([three, one, two])
    assert found is not None
    block, starts = found
    for start, values in zip(starts, (three, one, two), strict=True):
        np.testing.assert_array_equal(block[start : start + values.size], values)


def test_a_full_block_is_followed_by_another_and_keeps_its_tables():
    blocks = TableBlocks(20)
    first, second, large = (blocks.joined([numbers(count)]) for count in (12, 12, 50))
    assert common_block([first, second]) is None
    np.testing.assert_array_equal(first, numbers(12))
    np.testing.assert_array_equal(second, numbers(12))
    np.testing.assert_array_equal(large, numbers(50))
    # arrays of their own lie in no block
    assert common_block([numbers(3), numbers(3)]) is None
    # nor do views of one picture, which a kernel cannot read as a table
    picture = numbers(3, 4)
    assert common_block([picture.ravel(), picture.ravel()]) is None


def test_a_block_is_freed_with_its_last_table():
    blocks = TableBlocks(20)
    one, two = blocks.joined([numbers(8)]), blocks.joined([numbers(8)])
    block = weakref.ref(one.base)
    del one
    # the next block
    blocks.joined([numbers(15)])
    gc.collect()
    assert block() is not None
    del two
    gc.collect()
    assert block() is None
