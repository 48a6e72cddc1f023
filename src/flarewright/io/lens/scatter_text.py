"""The `[scatter]` table of a lens file; it has the keys of a project's."""

from __future__ import annotations

from typing import Any

from ...model.lens.scatter import RowScatter, Scatter
from ...sentences import did_you_mean, shorten
from ..files.type_slips import record_of


def read_scatter(table: object, problems: list[str]) -> Scatter | None:
    """Check and return the `[scatter]` of a lens file.

    Parameters
    ----------
    table : object
        Parsed value; None when absent.
    problems : list of str
        Errors are appended.
    """
    if table is None:
        return None
    if not isinstance(table, dict):
        problems.append(f'scatter is {shorten(table)}, a table was expected: [scatter] with model = "harvey-shack"')
        return None
    rows = table.get("rows", [])
    tables: list[tuple[str, dict[str, Any], type[Scatter] | type[RowScatter]]] = [("scatter", table, Scatter)]
    if isinstance(rows, list):
        tables += [("scatter.rows", row, RowScatter) for row in rows if isinstance(row, dict)]
    unknown = [
        f"{where}: {shorten(key)} is not a known key{did_you_mean(key, tuple(model.model_fields))}"
        for where, entry, model in tables
        for key in entry
        if key not in model.model_fields
    ]
    problems += unknown
    if unknown:
        return None
    scatter, wrong = record_of(Scatter.model_validate, table)
    problems += [f"scatter: {sentence}" for sentence in wrong]
    return scatter


def scatter_lines(scatter: Scatter | None) -> list[str]:
    """Return the `[scatter]` of a lens file as lines; empty for None.

    Returns
    -------
    list of str
        Lines.
    """
    if scatter is None:
        return []
    lines = ["", "[scatter]", *_keys(scatter)]
    for row in scatter.rows:
        lines += ["", "[[scatter.rows]]", *_keys(row)]
    return lines


def _keys(record: Scatter | RowScatter) -> list[str]:
    lines = []
    for key, value in record:
        if isinstance(value, str):
            lines.append(f'{key} = "{value}"')
        elif key == "abg" and value is not None:
            lines.append(f"abg = [{', '.join(map(repr, value))}]")
        elif isinstance(value, int | float):
            lines.append(f"{key} = {value!r}")
    return lines


def scatter_schema() -> dict[str, Any]:
    """Return the JSON Schema of `scatter` in a lens file."""
    schema = Scatter.model_json_schema()
    row = schema.pop("$defs")["RowScatter"]
    for owner in (schema, row):
        owner["properties"] = {key: _plain(value) for key, value in owner["properties"].items()}
        owner.pop("title", None)
    schema["properties"]["rows"] = {"type": "array", "items": row, "description": "exceptions"}
    schema["description"] = "surface scatter; default: none"
    return schema


def _plain(node: dict[str, Any]) -> dict[str, Any]:
    """Remove null, which TOML lacks, and titles that repeat the key."""
    kept = {key: value for key, value in node.items() if key not in ("title", "default", "anyOf")}
    choices = [choice for choice in node.get("anyOf", []) if choice != {"type": "null"}]
    return {**kept, **(choices[0] if len(choices) == 1 else {"anyOf": choices} if choices else {})}
