"""JSON Schema of the lens file, for completion and validation in text editors."""

from __future__ import annotations

from typing import Any

from ...model import Iris
from ...model.lens.coating import STANDARD_NAMES
from .coating_text import HELP
from .lens_fields import CURVATURE, RADIUS, ROW_NUMBERS, TOP_NUMBERS, TOP_TEXTS
from .scatter_text import scatter_schema
from .shape_fields import elements_schema, positions_schema, shape_schema

_NUMBER = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"
_COATING_TEXT = (
    rf"^(none|bare|-|({'|'.join(STANDARD_NAMES)})(\*{_NUMBER})?|"
    rf"quarter-wave:{_NUMBER}([+-]{_NUMBER})?(:(ideal|real|{_NUMBER}))?([+-]{_NUMBER})?|"
    rf"film:{_NUMBER}:{_NUMBER}|"
    rf"stack:{_NUMBER}:{_NUMBER}(,{_NUMBER}:{_NUMBER})*)?$"
)


def lens_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the TOML lens file.

    Returns
    -------
    dict
        Structure, types and limits. Only `read_lens` checks conditions across rows (one stop, known glass, air behind
        the last row).
    """
    top: dict[str, Any] = {
        "schema_version": {"const": 1, "description": "version of this format"},
        **{key: {"type": "string", "description": about} for key, about in TOP_TEXTS.items()},
        **{key: field.schema() for key, field in TOP_NUMBERS.items()},
        "iris": _iris(),
        "rows": {
            "type": "array",
            "minItems": 2,
            "maxItems": 500,
            "items": {"anyOf": [{"$ref": "#/$defs/surface"}, {"$ref": "#/$defs/stop"}]},
            # exactly one row is the stop
            "contains": {"$ref": "#/$defs/stop"},
            "minContains": 1,
            "maxContains": 1,
            "description": "the prescription from front to back",
        },
        "elements": elements_schema(),
        "positions": positions_schema(),
        "scatter": scatter_schema(),
        "coating_presets": {
            "type": "object",
            "additionalProperties": {"type": "array", "items": {"$ref": "#/$defs/coating"}},
            "description": 'named sets of coatings, one entry for each row ("-" for none, the stop for example)',
        },
    }
    top["name"]["minLength"] = 1
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Flarewright lens file",
        "type": "object",
        "required": ["schema_version", "name", "f_number", "rows"],
        "additionalProperties": False,
        "properties": top,
        "$defs": {"surface": _surface(), "stop": _stop(), "coating": _coating()},
    }


def _surface() -> dict[str, Any]:
    radius = RADIUS.schema()
    return {
        "type": "object",
        "description": "a refracting surface and the gap behind it; without glass and n_d the gap is air",
        "additionalProperties": False,
        "properties": {
            "radius": {
                "description": radius.pop("description"),
                "anyOf": [{**radius, "not": {"const": 0}}, {"const": "flat"}],
            },
            "curvature": CURVATURE.schema(),
            "radius_x": {
                "description": "radius in the x-z plane; left out: a surface of revolution",
                "anyOf": [{**radius, "not": {"const": 0}}, {"const": "flat"}],
            },
            **shape_schema(),
            **{key: field.schema() for key, field in ROW_NUMBERS.items()},
            "glass": {"type": "string", "minLength": 1, "description": 'catalogue name, "N-BK7" or "SCHOTT N-BK7"'},
            "semi_diameter_estimated": {"type": "boolean", "description": "true: not from the prescription"},
            "coating": {"$ref": "#/$defs/coating"},
            "stop": {"const": False},
        },
        "oneOf": [{"required": ["radius"]}, {"required": ["curvature"]}],
        "not": {"required": ["radius_x", "curvature_x"]},
        # an Abbe number alone does not define a glass
        "if": {"required": ["v_d"]},
        "then": {"anyOf": [{"required": ["n_d"]}, {"required": ["glass"]}]},
    }


def _stop() -> dict[str, Any]:
    return {
        "type": "object",
        "description": "the stop: a plane that refracts nothing; its opening follows from f_number",
        "additionalProperties": False,
        "required": ["stop"],
        "properties": {"stop": {"const": True}, "thickness": ROW_NUMBERS["thickness"].schema()},
    }


def _coating() -> dict[str, Any]:
    index = {"type": "number", "minimum": 1, "maximum": 4}
    thickness = {"type": "number", "minimum": 0, "maximum": 20000}
    film = {"kind": {"const": "film"}, "index": index, "thickness_nm": thickness}
    return {
        "description": HELP,
        "anyOf": [
            {"type": "string", "pattern": _COATING_TEXT},
            {
                "type": "object",
                "additionalProperties": False,
                "required": ["kind"],
                "properties": {"kind": {"const": "none"}},
            },
            {
                "type": "object",
                "additionalProperties": False,
                "required": ["kind", "center_wavelength_nm"],
                "properties": {
                    "kind": {"const": "quarter-wave"},
                    "center_wavelength_nm": {"type": "number", "minimum": 100, "maximum": 3000},
                    "index": {"anyOf": [{"enum": ["real", "ideal"]}, index]},
                    "thickness_offset_nm": {"type": "number", "minimum": -1000, "maximum": 5000},
                },
            },
            _table(film, ["kind", "index", "thickness_nm"]),
            _table(
                {
                    "kind": {"const": "stack"},
                    "layers": {
                        "type": "array",
                        "minItems": 1,
                        "maxItems": 200,
                        "items": _table(film, ["index", "thickness_nm"]),
                    },
                },
                ["kind", "layers"],
            ),
            _table(
                {
                    "kind": {"const": "standard"},
                    "name": {"enum": list(STANDARD_NAMES)},
                    "thickness": {"type": "number", "minimum": 0.5, "maximum": 2},
                },
                ["kind", "name"],
            ),
        ],
    }


def _table(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": False, "required": required, "properties": properties}


def _iris() -> dict[str, Any]:
    schema = Iris.model_json_schema()
    properties = {
        key: {name: value for name, value in field.items() if name not in ("title", "default")}
        for key, field in schema["properties"].items()
    }
    # TOML has no null: unused keys are absent
    properties["mask"] = {"type": "string"}
    properties["blades"]["not"] = {"enum": [1, 2]}
    return {"type": "object", "additionalProperties": False, "properties": properties, "description": "default blades"}
