"""Looks: the settings of a flare that other lenses and lights can reuse."""

from __future__ import annotations

from pydantic import Field, field_validator

from ..base import Frozen
from ..lens.iris import Iris
from .project import Project

LOOK_SECTIONS = (
    "f_number", "iris", "coating", "filter", "imperfection", "scatter", "dirt", "starburst", "art", "lights", "camera",
)  # fmt: skip
"""Sections of a project that a look can set."""

LIGHT_KEYS = ("spectrum", "diameter_deg", "shape")
"""Keys of lights that a look can set; position and intensity belong to the shot."""

CAMERA_KEYS = ("desqueeze", "cover_glass", "sensor_reflectance", "sensor_grating")
"""Keys of the camera that a look can set; size, sensor and focus belong to the shot."""


class Look(Frozen):
    """A set of project settings to apply to other lenses and lights.

    Attributes
    ----------
    name : str
        Display name, such as "Warm vintage".
    notes : str
        One sentence on its ingredients.
    example : Project
        A project that shows the look; it holds the values of the look's keys.
    says : tuple of str
        Keys of the example that belong to the look: "coating", "iris.rounding", "lights.spectrum". Single keys for
        `iris`, `lights` and `camera`, whole sections otherwise. All other keys of the example serve only to show it.
    """

    name: str = Field(min_length=1, max_length=80)
    notes: str = Field("", max_length=400)
    example: Project
    says: tuple[str, ...] = Field(min_length=1)

    @field_validator("says")
    @classmethod
    def _keys_belong_to_a_look(cls, says: tuple[str, ...]) -> tuple[str, ...]:
        keys = {"iris": tuple(Iris.model_fields), "lights": LIGHT_KEYS, "camera": CAMERA_KEYS}
        for entry in says:
            section, _, key = entry.partition(".")
            if section not in LOOK_SECTIONS or (key not in keys[section] if section in keys else bool(key)):
                raise ValueError(f"{entry} cannot be part of a look")
        return says

    def of(self, section: str) -> dict[str, object]:
        """Return the look's values of `iris`, `lights` or `camera`, by key."""
        record = self.example.lights[0] if section == "lights" else getattr(self.example, section)
        keys = [key.partition(".")[2] for key in self.says if key.startswith(f"{section}.")]
        return {key: getattr(record, key) for key in keys}
