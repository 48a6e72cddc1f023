"""`Frozen`, the base class of all records: immutable, strict about names, finite numbers only."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict


# pydantic gives frozen models a hash of their fields
class Frozen(BaseModel):  # noqa: PLW1641
    """Base class of every record: immutable; rejects unknown keys, NaN and infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

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
        """
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self).model_validate({**fields, **changes})
