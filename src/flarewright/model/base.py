"""The common habit of all data: frozen, strict about names, finite numbers only."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict


# pydantic gives what is frozen a hash of its fields
class Frozen(BaseModel):  # noqa: PLW1641
    """Base of every record: immutable, unknown keys refused, NaN and infinity refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __eq__(self, other: object) -> bool:
        """Tell whether another record is of the same type and has equal fields.

        What a record keeps beside its fields, such as an array that was read from one of them, does not count: pydantic
        compares it first, and of arrays it cannot be told whether they are equal.
        """
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def replace(self, **changes: Any) -> Any:
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
