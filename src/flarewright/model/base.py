"""`Frozen`, the base class of all records: immutable, strict about names, finite numbers only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from ..errors import RecordError
from ..sentences import record_sentences, summary


# pydantic gives frozen models a hash of their fields
class Frozen(BaseModel):  # noqa: PLW1641
    """Base class of every record: immutable; rejects unknown keys, NaN and infinity.

    Making a record by its class, or by `replace`, raises a RecordError. `model_validate`, which readers of files use,
    raises pydantic's ValidationError with the place of every value.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    # type checkers read the fields
    if not TYPE_CHECKING:

        def __init__(self, /, **fields: Any) -> None:
            """Raise one sentence instead of pydantic's lines."""
            try:
                super().__init__(**fields)
            except ValidationError as error:
                raise _record_error(type(self), error, fields) from None

        # records inside another are validated without this function, so that their errors keep their places
        __init__.__pydantic_base_init__ = True

    def __eq__(self, other: object) -> bool:
        """Return whether another record has the same type and equal fields.

        Values cached next to the fields, such as decoded arrays, are ignored. pydantic's own comparison includes them
        and fails on arrays, whose truth value is ambiguous.
        """
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def replace(self, **changes: Any) -> Self:
        """Return a validated copy with some fields changed.

        Parameters
        ----------
        **changes
            New values by field name.

        Returns
        -------
        Frozen
            A new record of the same type.

        Raises
        ------
        RecordError
            A value is impossible, or there is no such field.
        """
        fields = {name: getattr(self, name) for name in type(self).model_fields} | changes
        try:
            return type(self).model_validate(fields)
        except ValidationError as error:
            raise _record_error(type(self), error, fields) from None


def _record_error(record: type[BaseModel], error: ValidationError, fields: dict[str, Any]) -> RecordError:
    problems = record_sentences(error, record, fields)
    return RecordError(summary(record.__name__, problems), tuple(problems))
