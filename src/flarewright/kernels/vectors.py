"""Steps over eight neighbours of a row at once that the compiler does not find by itself.

It cannot know that two arrays lie apart, and so would go on number by number.
"""

# Numba calls these with its own types, and LLVM's builder has none
# mypy: disable-error-code="no-untyped-def, no-untyped-call, no-any-return, import-untyped"

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

# its stubs ask callers for what Numba hands over itself
_intrinsic: Any = intrinsic

LANES = 8

_LANE = ir.IntType(32)
_PLACE = ir.IntType(64)
_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_PLACES = ir.VectorType(_LANE, LANES)
# a product and a sum may become one step; what is not a number stays so
_FLAGS = ("contract",)


def _data(context, builder, kind, array):
    return context.make_array(kind)(context, builder, array).data


def _load(builder, data, at, kind=_VECTOR):
    return builder.load(_pointer(builder, data, at, kind), align=4)


def _store(builder, vector, data, at):
    builder.store(vector, _pointer(builder, data, at, _VECTOR), align=4)


def _pointer(builder, data, at, kind):
    return builder.bitcast(builder.gep(data, [at]), kind.as_pointer())


def _all(builder, number):
    """Fill a vector with one number."""
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        vector = builder.insert_element(vector, number, _LANE(lane))
    return vector


def _taken(builder, data, places):
    """Look up a number for every lane."""
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        number = builder.load(builder.gep(data, [builder.extract_element(places, _LANE(lane))]))
        vector = builder.insert_element(vector, number, _LANE(lane))
    return vector


def _taken_pairs(builder, data, places):
    """Look up two numbers that stand side by side for every lane, each two by one load."""
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
    """Put two vectors one after the other."""
    count = 2 * one.type.count
    return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(_LANE, count), list(range(count))))


def _mixed(builder, ends, part):
    """Go from one vector to the other by a part of the way."""
    one, other = ends
    way = builder.fsub(other, one, flags=_FLAGS)
    return builder.fadd(one, builder.fmul(way, part, flags=_FLAGS), flags=_FLAGS)


@_intrinsic
def add_colored(_, flat, at, light, first, red, green, blue):
    """Add `light[first:]`, float32, in a colour to `flat[at:]`, where each channel has its eight after the other."""
    signature = types.void(flat, at, light, first, red, green, blue)

    def lower(context, builder, signature, arguments):
        picture, shown = (_data(context, builder, signature.args[k], arguments[k]) for k in (0, 2))
        values = _load(builder, shown, arguments[3])
        for channel in range(3):
            place = builder.add(arguments[1], arguments[1].type(LANES * channel))
            more = builder.fmul(_all(builder, arguments[4 + channel]), values, flags=_FLAGS)
            _store(builder, builder.fadd(_load(builder, picture, place), more, flags=_FLAGS), picture, place)
        return context.get_dummy_value()

    return signature, lower


@_intrinsic
def fetch(_, flat, at):
    """Have the memory around `flat[at]`, float32, brought near, for it will be added to; it need not exist."""
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
    """Multiply `light[first:]`, float32, by the values at the places `where[m:]`, int32 and not below 0."""
    signature = types.void(light, first, values, where, m)

    def lower(context, builder, signature, arguments):
        shown, table, places = (_data(context, builder, signature.args[k], arguments[k]) for k in (0, 2, 3))
        factors = _taken(builder, table, _load(builder, places, arguments[4], _PLACES))
        product = builder.fmul(_load(builder, shown, arguments[1]), factors, flags=_FLAGS)
        _store(builder, product, shown, arguments[1])
        return context.get_dummy_value()

    return signature, lower


@_intrinsic
def multiply_between(_, light, first, values, columns, where, right, down, m):
    """Multiply `light[first:]` by what lies between four neighbours of a table with so many columns, int32.

    The first of the four stand at the places `where[m:]`; `right` and `down`, float32, tell how far the others are.
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
            _mixed(builder, _taken_pairs(builder, row, here), x) for row in (table, builder.gep(table, [arguments[3]]))
        )
        product = builder.fmul(_load(builder, shown, arguments[1]), _mixed(builder, (upper, lower), y), flags=_FLAGS)
        _store(builder, product, shown, arguments[1])
        return context.get_dummy_value()

    return signature, lower
