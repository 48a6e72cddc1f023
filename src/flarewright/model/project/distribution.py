"""Distributions of numbers and texts: what a data set draws its values from."""

from __future__ import annotations

from collections.abc import Callable
from math import erf, isfinite, sqrt
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator

from ..base import Frozen

Number = Annotated[float, Field(strict=True)]
Whole = Annotated[int, Field(strict=True)]
Weight = Annotated[float, Field(strict=True, ge=0.0)]

# part of a normal distribution that its bounds hold at least
_LEAST_HELD = 1e-3

_HOW = (
    "write a number, a list of choices, { choice = [...], weights = [...] }, { uniform = [low, high] }, "
    "{ log_uniform = [low, high] }, { normal = [mean, deviation], bounds = [low, high] } or { integers = [low, high] }"
)


def rising_limits(limits: tuple[float, float]) -> tuple[float, float]:
    """Return two limits unchanged; raises ValueError unless the second is above the first."""
    if limits[1] < limits[0]:
        raise ValueError(f"{limits[0]:g} to {limits[1]:g} runs backwards; write the least number first")
    if limits[1] == limits[0]:
        raise ValueError(f"{limits[0]:g} to {limits[1]:g} is a single number; write {limits[0]:g} alone")
    return limits


class Constant(Frozen):
    """Always the same number."""

    constant: Number

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.constant, self.constant


class Choice(Frozen):
    """One of several numbers.

    Attributes
    ----------
    choice : tuple of float
    weights : tuple of float or None
        Relative frequencies; None: equal.
    """

    choice: tuple[Number, ...] = Field(min_length=1, max_length=10000)
    weights: tuple[Weight, ...] | None = None

    @field_validator("weights")
    @classmethod
    def _weights_fit(cls, weights: tuple[float, ...] | None, info: ValidationInfo) -> tuple[float, ...] | None:
        return fitting_weights(weights, info.data.get("choice"))

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return min(self.choice), max(self.choice)


class Uniform(Frozen):
    """Every number between two equally often."""

    uniform: Annotated[tuple[Number, Number], AfterValidator(rising_limits)]

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.uniform


class LogUniform(Frozen):
    """Every ratio equally often: as many numbers from 1 to 2 as from 2 to 4."""

    log_uniform: tuple[Number, Number]

    @field_validator("log_uniform")
    @classmethod
    def _rises(cls, limits: tuple[float, float]) -> tuple[float, float]:
        if limits[0] <= 0.0:
            raise ValueError(f"a log-uniform distribution starts above 0, not at {limits[0]:g}; write uniform instead")
        return rising_limits(limits)

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.log_uniform


class Normal(Frozen):
    """A normal distribution, cut at its bounds: values outside are drawn again.

    Attributes
    ----------
    normal : tuple of float
        Mean and standard deviation.
    bounds : tuple of float
    """

    normal: tuple[Number, Number]
    bounds: tuple[Number, Number]

    @field_validator("normal")
    @classmethod
    def _deviates(cls, normal: tuple[float, float]) -> tuple[float, float]:
        if normal[1] <= 0.0:
            raise ValueError(f"a standard deviation of {normal[1]:g} is not above 0; write a single number instead")
        return normal

    @field_validator("bounds")
    @classmethod
    def _bounds_hold_values(cls, bounds: tuple[float, float], info: ValidationInfo) -> tuple[float, float]:
        rising_limits(bounds)
        if "normal" in info.data:
            mean, deviation = info.data["normal"]
            # farther out, almost every value would be drawn again
            if bounds[0] > mean + 3.0 * deviation or bounds[1] < mean - 3.0 * deviation:
                raise ValueError(
                    f"the bounds {bounds[0]:g} to {bounds[1]:g} are more than three deviations from the mean {mean:g}; "
                    "move them or the mean"
                )
            # so would between bounds that almost no value meets
            below, above = (erf((bound - mean) / (sqrt(2.0) * deviation)) for bound in bounds)
            if 0.5 * (above - below) < _LEAST_HELD:
                raise ValueError(
                    f"the bounds {bounds[0]:.9g} to {bounds[1]:.9g} hold {0.5 * (above - below):.1g} of all values; "
                    "widen them, or write a single number"
                )
        return bounds

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.bounds


class Integers(Frozen):
    """Every whole number from a first to a last one equally often."""

    integers: tuple[Whole, Whole]

    @field_validator("integers")
    @classmethod
    def _rises(cls, limits: tuple[int, int]) -> tuple[int, int]:
        if limits[1] < limits[0]:
            raise ValueError(f"{limits[0]} to {limits[1]} runs backwards; write the least number first")
        return limits

    @property
    def support(self) -> tuple[float, float]:
        """Least and largest value."""
        return float(self.integers[0]), float(self.integers[1])


KINDS: dict[str, type[Constant | Choice | Uniform | LogUniform | Normal | Integers]] = {
    "constant": Constant, "choice": Choice, "uniform": Uniform, "log_uniform": LogUniform, "normal": Normal,
    "integers": Integers,
}  # fmt: skip
"""Distributions by the key that names them in a file."""


def _spelt_out(value: Any) -> Any:
    """Return a distribution's table for a plain number or list."""
    if isinstance(value, bool):
        raise ValueError(f"{str(value).lower()} is no distribution; {_HOW}")
    if isinstance(value, int | float):
        return {"constant": float(value)}
    if isinstance(value, list | tuple):
        return {"choice": value}
    if isinstance(value, dict) and sum(kind in value for kind in KINDS) != 1:
        raise ValueError(f"{'a table' if value else 'an empty table'} is no distribution; {_HOW}")
    if not isinstance(value, dict | Frozen):
        raise ValueError(f"{str(value)[:60]!r} is no distribution; {_HOW}")
    return value


def _kind(value: Any) -> str:
    names = value if isinstance(value, dict) else type(value).model_fields
    # a tag that is no key: messages leave tags out of the place
    return next(f"{kind} kind" for kind in KINDS if kind in names)


Distribution = Annotated[
    Annotated[Constant, Tag("constant kind")]
    | Annotated[Choice, Tag("choice kind")]
    | Annotated[Uniform, Tag("uniform kind")]
    | Annotated[LogUniform, Tag("log_uniform kind")]
    | Annotated[Normal, Tag("normal kind")]
    | Annotated[Integers, Tag("integers kind")],
    Discriminator(_kind),
    BeforeValidator(_spelt_out),
]
"""A distribution of numbers; a plain number is a `Constant`, a list a `Choice`."""

AnyDistribution = Constant | Choice | Uniform | LogUniform | Normal | Integers


def within(least: float, largest: float, *, whole: bool = False) -> Callable[[AnyDistribution], AnyDistribution]:
    """Return a validator that rejects a distribution with values outside a range.

    Parameters
    ----------
    least, largest : float
    whole : bool
        Whether all values must be whole numbers.

    Returns
    -------
    callable
        Raises ValueError; the sentence names the range.
    """

    def check(given: AnyDistribution) -> AnyDistribution:
        low, high = given.support
        if low < least or high > largest:
            wrong = low if low < least else high
            raise ValueError(f"values lie between {least:g} and {largest:g}, not at {wrong:g}")
        if whole and not isinstance(given, Integers):
            numbers = given.choice if isinstance(given, Choice) else (given.support)
            if not isinstance(given, Choice | Constant) or not all(float(number).is_integer() for number in numbers):
                raise ValueError("values are whole numbers; write { integers = [low, high] } or a list of them")
        return given

    return check


class TextChoice(Frozen):
    """One of several texts.

    Attributes
    ----------
    choice : tuple of str
    weights : tuple of float or None
        Relative frequencies; None: equal.
    """

    choice: tuple[Annotated[str, Field(strict=True, min_length=1)], ...] = Field(min_length=1, max_length=10000)
    weights: tuple[Weight, ...] | None = None

    @field_validator("weights")
    @classmethod
    def _weights_fit(cls, weights: tuple[float, ...] | None, info: ValidationInfo) -> tuple[float, ...] | None:
        return fitting_weights(weights, info.data.get("choice"))


def _texts(value: Any) -> Any:
    """Return the table of a plain text or list."""
    if isinstance(value, str):
        return {"choice": [value]}
    return {"choice": value} if isinstance(value, list | tuple) else value


Texts = Annotated[TextChoice, BeforeValidator(_texts)]
"""One of several texts; a plain text or list is a `TextChoice`."""


def fitting_weights(weights: tuple[float, ...] | None, choices: tuple[Any, ...] | None) -> tuple[float, ...] | None:
    """Return weights unchanged; raises ValueError unless there is one per choice, one above 0, and a finite sum."""
    if weights is None or choices is None:
        return weights
    if len(weights) != len(choices):
        raise ValueError(f"there are {len(weights)} weights for {len(choices)} choices; give one each")
    if not isfinite(sum(weights)):
        raise ValueError("the sum of the weights is too large; divide them all by one number")
    if not sum(weights) > 0.0:
        raise ValueError("all weights are 0, so nothing can be drawn; give one above 0")
    return weights
