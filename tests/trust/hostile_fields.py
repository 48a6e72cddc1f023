"""Hostile numbers in every numeric field of project and scene files, found in the files' own schemas."""

from __future__ import annotations

import json
import random
import shutil
import tempfile
import tomllib
from collections.abc import Iterator
from datetime import date, datetime, time
from functools import cache
from pathlib import Path
from typing import Any

from flarewright.io.project.project_file import project_json_schema
from flarewright.io.project.scene_file import scene_json_schema

from .answers import judged
from .hostile_files import BARE
from .hostile_flags import prepared
from .verdict import Verdict

# as TOML writes them
VALUES = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e30", "-1e30", "0", "-1", "-0.5", "1e-9",
          "9223372036854775807", "65536", "true", '"abc"', "[]", "{}", "[[1.0]]")  # fmt: skip
SCHEMAS = {"shot.toml": project_json_schema, "match.toml": scene_json_schema}
# schemas refer to themselves
DEEPEST = 7
# what tables need by rules that a schema cannot hold, by their last key
RULES: dict[str, dict[str, Any]] = {
    "kind=lamp": {"intensity_cd": 1e6, "aim_m": [0.0, 0.0, 0.0], "beam_deg": 40.0},
    "kind=table": {"wavelength_nm": [400.0, 700.0], "power": [1.0, 1.0]},
    "kind=lines": {"lines": [[550.0, 1.0]]},
    "kind=quarter-wave": {"center_wavelength_nm": 550.0},
    "rules": {"select": "all"},
    "positions": {"gaps": {"2": 5.0}},
    "holdout": {"image": "mask.png"},
}


@cache
def fields(name: str) -> tuple[tuple[str, ...], ...]:
    """Return paths of numeric fields: "[3]" is the first of three entries, "kind=x" precedes fields of a choice."""
    schema = SCHEMAS[name]()
    return tuple(dict.fromkeys(_numeric(schema, schema.get("$defs", {}), ())))


def _numeric(node: dict[str, Any], known: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    if len(path) > DEEPEST:
        return
    if "$ref" in node:
        yield from _numeric(known[node["$ref"].rpartition("/")[2]], known, path)
    for choice in ("anyOf", "oneOf", "allOf"):
        for each in node.get(choice, ()):
            yield from _numeric(each, known, path)
    if node.get("type") in ("number", "integer"):
        yield path
    tag = node.get("properties", {}).get("kind", {}).get("const")
    for key, each in node.get("properties", {}).items():
        # another kind of an element has other fields: the path carries the kind
        here = (*path, f"kind={tag}") if tag is not None else path
        yield from _numeric(each, known, (*here, key))
    for each in (node.get("items"), *node.get("prefixItems", ())[:1]):
        if isinstance(each, dict):
            yield from _numeric(each, known, (*path, f"[{node.get('minItems', 1)}]"))


@cache
def required(name: str) -> dict[tuple[str, ...], dict[str, Any]]:
    """Return valid values of the required fields of every table, by the table's path."""
    schema = SCHEMAS[name]()
    return dict(_tables(schema, schema.get("$defs", {}), ()))


def _tables(
    node: dict[str, Any], known: dict[str, Any], path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    if len(path) > DEEPEST:
        return
    if "$ref" in node:
        yield from _tables(known[node["$ref"].rpartition("/")[2]], known, path)
    for choice in ("anyOf", "oneOf", "allOf"):
        for each in node.get(choice, ()):
            yield from _tables(each, known, path)
    fields_of = node.get("properties", {})
    tag = fields_of.get("kind", {}).get("const")
    here = path if tag is None else (*path, f"kind={tag}")
    if fields_of:
        name = here[-2] if here and here[-1].startswith("[") else here[-1] if here else ""
        yield here, {key: _valid(fields_of[key], known) for key in node.get("required", ())} | RULES.get(name, {})
    for key, each in fields_of.items():
        yield from _tables(each, known, (*here, key))
    if isinstance(node.get("items"), dict):
        yield from _tables(node["items"], known, (*path, f"[{node.get('minItems', 1)}]"))


def _valid(node: dict[str, Any], known: dict[str, Any]) -> Any:
    """Return a value that a field's schema accepts."""
    if "$ref" in node:
        return _valid(known[node["$ref"].rpartition("/")[2]], known)
    for choice in ("anyOf", "oneOf", "allOf"):
        if node.get(choice):
            return _valid(node[choice][0], known)
    if "const" in node or "enum" in node:
        return node.get("const", node.get("enum", [None])[0])
    if node.get("type") in ("number", "integer"):
        low, high = node.get("minimum", node.get("exclusiveMinimum", 0)), node.get("maximum", 1)
        return low + 1 if low >= high or low + 1 <= high else 0.5 * (low + high)
    if node.get("type") == "array":
        parts = node.get("prefixItems") or [node.get("items", {})] * node.get("minItems", 1)
        return [_valid(part, known) for part in parts]
    if node.get("type") == "object":
        return {key: _valid(node["properties"][key], known) for key in node.get("required", ())}
    return "x"


def with_value(name: str, data: Any, path: tuple[str, ...], value: Any) -> Any:
    """Return the data of a file with a value at a path; missing tables and lists are made, without further faults."""
    return _set(data, path, value, (), required(name))


def _set(
    data: Any, path: tuple[str, ...], value: Any, place: tuple[str, ...], filled: dict[tuple[str, ...], dict[str, Any]]
) -> Any:
    if not path:
        return value
    key, rest = path[0], path[1:]
    here = (*place, key)
    if key.startswith("kind="):
        kind = key.removeprefix("kind=")
        table = data if isinstance(data, dict) and data.get("kind", kind) == kind else {}
        # rows of a lens file have no kind
        named = {} if place[:2] == ("lens", "rows") and len(place) == 3 else {"kind": kind}
        return _set({**filled.get(here, {}), **table, **named}, rest, value, here, filled)
    if key.startswith("["):
        entries = list(data) if isinstance(data, list) and data else [None, *[1.0] * (int(key[1:-1]) - 1)]
        return [_set(entries[0], rest, value, here, filled), *entries[1:]]
    table = dict(data) if isinstance(data, dict) else dict(filled.get(place, {}))
    return {**table, key: _set(table.get(key), rest, value, here, filled)}


class _Raw(str):
    """A value as TOML writes it."""

    __slots__ = ()


def _toml(value: Any) -> str:
    """Write a value inline."""
    if isinstance(value, _Raw):
        return value
    if isinstance(value, dict):
        pairs = (f"{json.dumps(key)} = {_toml(each)}" for key, each in value.items() if each is not None)
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(each) for each in value if each is not None) + "]"
    if isinstance(value, (datetime, date, time)):
        return value.isoformat()
    return repr(value) if isinstance(value, float) else json.dumps(value)


def file_text(data: dict[str, Any]) -> str:
    """Return the text of a file with these values."""
    return "".join(f"{json.dumps(key)} = {_toml(each)}\n" for key, each in data.items())


@cache
def cases() -> tuple[tuple[str, tuple[str, ...], str], ...]:
    """Return file, path and value of every case."""
    return tuple((name, path, value) for name in SCHEMAS for path in fields(name) for value in VALUES)


def run(seed: int) -> Verdict:
    """Write one hostile value into a valid file, and let its command read it."""
    known = list(cases())
    random.Random(2).shuffle(known)
    return run_case(*known[seed % len(known)])


def run_case(name: str, path: tuple[str, ...], value: str) -> Verdict:
    """Put a value at a path of a file."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "work"
        shutil.copytree(prepared(), folder)
        data = tomllib.loads((folder / name).read_text("utf-8"))
        if path[0] == "lens":
            # a project may hold its lens
            data["lens"] = tomllib.loads((folder / "lens.toml").read_text("utf-8"))
        (folder / name).write_text(file_text(with_value(name, data, path, _Raw(value))), "utf-8")
        command = BARE if name == "shot.toml" else ("scene", "check", name)
        held, answer = judged(command, folder)
    return Verdict("fields", f"{name} {'.'.join(path)} = {value}", held, answer)
