"""SIMD intrinsics on eight float32 neighbours of a row that LLVM does not vectorise by itself.

The compiler cannot know that two arrays do not overlap, and therefore falls back to scalar code.
"""

# Numba calls the intrinsics with its types, and LLVM's builder is untyped
# mypy: disable-error-code="no-untyped-def, no-untyped-call, no-any-return, import-untyped"

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

# the stubs require arguments that Numba passes itself
_intrinsic: Any = intrinsic

LANES = 8

_LANE = ir.IntType(32)
_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_PLACES = ir.VectorType(_LANE, LANES)
# a product and a sum may be fused; NaN stays NaN
_FLAGS = ("contract",)


def _data(context, builder, kind, array):
    return context.make_array(kind)(context, builder, array).data


def _load(builder, data, at, kind=_VECTOR):
    return builder.load(_pointer(builder, data, at, kind), align=4)


def _store(builder, vector, data, at):
    builder.store(vector, _pointer(builder, data, at, _VECTOR), align=4)


def _pointer(builder, data, at, kind):
    return builder.bitcast(builder.gep(data, [at]), kind.as_pointer())


def _splat(builder, number):
    """Return a vector with the same number in every lane."""
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        vector = builder.insert_element(vector, number, _LANE(lane))
    return vector


def _gathered(builder, data, places):
    """Return a vector of the numbers at the indices `places`, one for each lane."""
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        number = builder.load(builder.gep(data, [builder.extract_element(places, _LANE(lane))]))
        vector = builder.insert_element(vector, number, _LANE(lane))
    return vector


def _gathered_pairs(builder, data, places):
    """Return two vectors: the numbers at the indices `places` and at the following indices; one load for each pair."""
    pair = ir.VectorType(ir.FloatType(), 2)
    found = [builder.load(builder.bitcast(builder.gep(data, [place]), pair.as_pointer()), align=4) for place in places]
    while len(found) > 1:
        found = [_joined(builder, *found[k : k + 2]) for k in range(0, len(found), 2)]
    nowhere = ir.Constant(found[0].type, ir.Undefined)
    return [
        builder.shuffle_vector(found[0], nowhere, ir.Constant(_PLACES, list(range(side, 2 * LANES, 2))))
        for side in range(2)
    ]


def _joined(builder, one, other):
    """Return the concatenation of two vectors."""
    count = 2 * one.type.count
    return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(_LANE, count), list(range(count))))


def _mixed(builder, ends, part):
    """Interpolate linearly between two vectors: one + part (other - one)."""
    one, other = ends
    way = builder.fsub(other, one, flags=_FLAGS)
    return builder.fadd(one, builder.fmul(way, part, flags=_FLAGS), flags=_FLAGS)


@_intrinsic
def add_colored(_, flat, at, light, first, red, green, blue):
    """Add `light[first:]`, float32, times a colour to `flat[at:]`, which holds eight pixels of each channel in turn."""
    signature = types.void(flat, at, light, first, red, green, blue)

    def lower(context, builder, signature, arguments):
        picture, shown = (_data(context, builder, signature.args[k], arguments[k]) for k in (0, 2))
        values = _load(builder, shown, arguments[3])
        for channel in range(3):
            place = builder.add(arguments[1], arguments[1].type(LANES * channel))
            more = builder.fmul(_splat(builder, arguments[4 + channel]), values, flags=_FLAGS)
            _store(builder, builder.fadd(_load(builder, picture, place), more, flags=_FLAGS), picture, place)
        return context.get_dummy_value()

    return signature, lower


@_intrinsic
def fetch(_, flat, at):
    """Prefetch the memory around `flat[at]`, float32, for writing; the index may lie outside the array."""
    signature = types.void(flat, at)

    def lower(context, builder, signature, arguments):
        place = builder.gep(_data(context, builder, signature.args[0], arguments[0]), [arguments[1]])
        kind = ir.FunctionType(ir.VoidType(), [place.type, _LANE, _LANE, _LANE])
        prefetch = builder.module.declare_intrinsic("llvm.prefetch", [place.type], kind)
        builder.call(prefetch, [place, _LANE(1), _LANE(3), _LANE(1)])
        return context.get_dummy_value()

    return signature, lower


@_intrinsic
def multiply_taken(_, light, first, values, where, m):
    """Multiply `light[first:]`, float32, by `values[where[m:]]`; the indices are int32 and not negative."""
    signature = types.void(light, first, values, where, m)

    def lower(context, builder, signature, arguments):
        shown, table, places = (_data(context, builder, signature.args[k], arguments[k]) for k in (0, 2, 3))
        factors = _gathered(builder, table, _load(builder, places, arguments[4], _PLACES))
        product = builder.fmul(_load(builder, shown, arguments[1]), factors, flags=_FLAGS)
        _store(builder, product, shown, arguments[1])
        return context.get_dummy_value()

    return signature, lower


@_intrinsic
def multiply_between(_, light, first, values, columns, where, right, down, m):
    """Multiply `light[first:]` by a bilinear interpolation in a table with `columns` (int32) columns.

    `where[m:]` are the indices of the upper left neighbours; `right` and `down`, float32, are the fractions of a cell
    from there.
    """
    signature = types.void(light, first, values, columns, where, right, down, m)

    def lower(context, builder, signature, arguments):
        shown, table, places, across, along = (
            _data(context, builder, signature.args[k], arguments[k]) for k in (0, 2, 4, 5, 6)
        )
        here = [
            builder.load(builder.gep(places, [builder.add(arguments[7], arguments[7].type(lane))]))
            for lane in range(LANES)
        ]
        x, y = (_load(builder, data, arguments[7]) for data in (across, along))
        upper, lower = (
            _mixed(builder, _gathered_pairs(builder, row, here), x)
            for row in (table, builder.gep(table, [arguments[3]]))
        )
        product = builder.fmul(_load(builder, shown, arguments[1]), _mixed(builder, (upper, lower), y), flags=_FLAGS)
        _store(builder, product, shown, arguments[1])
        return context.get_dummy_value()

    return signature, lower
