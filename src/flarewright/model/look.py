"""A look: what a flare is like apart from the lens and the place of its lights, so that others may have it too."""

from __future__ import annotations

from pydantic import Field, field_validator

from .base import Frozen
from .iris import Iris
from .project import Project

LOOK_SECTIONS = (
    "f_number", "iris", "coating", "filter", "imperfection", "scatter", "dirt", "starburst", "art", "lights", "camera",
)  # fmt: skip
"""Sections of a project that a look may say something of."""

LIGHT_KEYS = ("spectrum", "diameter_deg", "shape")
"""What a look says of lights; where they stand and how strong they are is the shot's business."""

CAMERA_KEYS = ("desqueeze", "cover_glass", "sensor_reflectance", "sensor_grating")
"""What a look says of the camera; size, sensor and focus are the shot's business."""


class Look(Frozen):
    """A small project that is meant to be applied to other lenses and lights.

    Attributes
    ----------
    name : str
        As a person reads it, "Warm vintage".
    notes : str
        What it is made of, in a sentence.
    example : Project
        The look on the lens and in the light that it is shown with.
    says : tuple of str
        Which keys of the example make the look: "coating", "iris.rounding", "lights.spectrum". Of `iris`, `lights` and
        `camera` single keys, the other sections as a whole. Everything else of the example is only its stage.
    """

    name: str = Field(min_length=1, max_length=80)
    notes: str = Field("", max_length=400)
    example: Project
    says: tuple[str, ...] = Field(min_length=1)

    @field_validator("says")
    @classmethod
    def _keys_belong_to_a_look(cls, says: tuple[str, ...]) -> tuple[str, ...]:
        keys = {"iris": tuple(Iris.model_fields), "lights": LIGHT_KEYS, "camera": CAMERA_KEYS}
        for said in says:
            section, _, key = said.partition(".")
            if section not in LOOK_SECTIONS or (key not in keys[section] if section in keys else bool(key)):
                raise ValueError(f"{said} is nothing that a look says")
        return says

    def of(self, section: str) -> dict[str, object]:
        """Return what the look says of `iris`, `lights` or `camera`, by key."""
        record = self.example.lights[0] if section == "lights" else getattr(self.example, section)
        keys = [key.partition(".")[2] for key in self.says if key.startswith(f"{section}.")]
        return {key: getattr(record, key) for key in keys}
