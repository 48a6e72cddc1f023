"""Half floats: the scale depends only on the lights; rounding follows IEEE 754, also above their range."""

from math import log2

import numpy as np
import pytest

from flarewright.io.images.half import HALF_MAX, exr_scale, half_scale, rounded_to_half
from flarewright.model import Light, Output, Project


@pytest.mark.parametrize(
    ("brightest", "exponent"),
    [
        (1.0, 10), (np.nextafter(1.0, 2.0), 9), (0.5, 11), (0.51, 10), (0.0, 10), (1024.0, 0), (1e5, 10 - 17),
        (1e20, 10 - 67), (1e-16, 63), (1e-300, 63),
    ],
)  # fmt: skip
def test_a_light_stands_at_two_to_the_ten(brightest, exponent):
    assert log2(half_scale(brightest)) == exponent
    if brightest > 1e-15:
        assert 512.0 < brightest * half_scale(brightest) <= 1024.0


def test_the_scale_is_the_project_s_whatever_the_picture_shows():
    lights = (Light(field_deg=(1.0, 2.0), intensity=0.2), Light(field_deg=(3.0, 4.0), intensity=100.0))
    project = Project(lens="x", lights=lights)
    assert project.output.pixel_type == "half"
    assert exr_scale(project) == 2.0 ** (10 - 7)
    moved = project.replace(lights=lights[::-1], f_number=8.0, output=Output(layers="ghosts"))
    assert exr_scale(moved) == exr_scale(project)
    assert exr_scale(project.replace(lights=lights[:1])) == 2.0 ** (10 + 2)
    assert exr_scale(project.replace(output=Output(pixel_type="float"))) == 1.0


def floats(low, high, seed):
    """Return float32 numbers of both signs with random mantissas, exponents from low to high, and ties of 11 bits."""
    rng = np.random.default_rng(seed)
    exponents = rng.integers(low, high, 6000)
    mantissas = rng.integers(0, 1 << 23, 6000)
    mantissas[:3000] = (rng.integers(0, 1 << 10, 3000) << 13) | (1 << 12)  # half way between two neighbours
    mantissas[3000:3100] = (1 << 23) - 1  # carries into the exponent
    signs = rng.choice([-1.0, 1.0], 6000)
    return (signs * np.ldexp(1.0 + mantissas / 2.0**23, exponents)).astype(np.float32)


def test_rounding_in_half_s_range_is_numpy_s_half():
    values = floats(-14, 15, 1)  # from half's least normal number on
    np.testing.assert_array_equal(rounded_to_half(values), values.astype(np.float16).astype(np.float32))
    faint = floats(-27, -14, 2)
    np.testing.assert_array_equal(rounded_to_half(faint), faint.astype(np.float16).astype(np.float32))


def test_rounding_above_half_s_range_keeps_as_many_bits():
    values = floats(17, 120, 3)
    # scale each by a power of two into half's range, round, and scale back
    exponents = np.frexp(values)[1]
    inside = np.ldexp(values, -exponents).astype(np.float16).astype(np.float32)
    np.testing.assert_array_equal(rounded_to_half(values), np.ldexp(inside, exponents))
    assert np.all(rounded_to_half(values).view(np.uint32) & 0x1FFF == 0)
    ends = np.array([HALF_MAX, -HALF_MAX, 65519.0, 65520.0, 65552.0], np.float32)
    np.testing.assert_array_equal(rounded_to_half(ends), np.float32([HALF_MAX, -HALF_MAX, 65504.0, 65536.0, 65536.0]))


def test_rounding_keeps_shape_and_what_is_no_number():
    values = np.array([[np.inf, -np.inf, np.nan], [1e6, -1e6, 0.0]], np.float32)
    rounded = rounded_to_half(values)
    np.testing.assert_array_equal(rounded[0], values[0])
    np.testing.assert_allclose(rounded[1], values[1], rtol=2.0**-11)
    assert rounded.dtype == np.float32
    # a carry must not propagate through all bits of a NaN
    full = np.array([0x7FFFFFFF, 0xFFFFFFFF], np.uint32).view(np.float32)
    assert np.isnan(rounded_to_half(full)).all()
    assert values[1, 0] == np.float32(1e6)
