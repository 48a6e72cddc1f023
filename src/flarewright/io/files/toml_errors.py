"""Sentences for TOML syntax errors, in particular for keys that appear twice."""

from __future__ import annotations

import re
from collections.abc import Iterator
from tomllib import TOMLDecodeError

Path = tuple[str | int, ...]

_TWICE = re.compile(r"Cannot (?:overwrite|declare|mutate)")
_IN_BRACES = re.compile(r"Duplicate inline table key (.+) \(at line (\d+)")
_NAME = r"""[\w-]+|"[^"\n]*"|'[^'\n]*'"""
_DOTTED = rf"(?:{_NAME})(?:\s*\.\s*(?:{_NAME}))*"
_HEADING = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]\]?\s*(?:#.*)?")
_KEY = re.compile(rf"\s*({_DOTTED})\s*=")
# by the start of the parser's message
_REMEDIES = {
    "Unclosed": "close what is open there",
    "Unterminated": "close the quotes",
    "Expected newline": "write one key a line",
    "Expected": "write KEY = VALUE",
    "Invalid statement": "write KEY = VALUE, a [heading] or a # comment",
    "Invalid value": "a value is a number, true, false, text in quotes, or a list in brackets",
    "Illegal character '\\n'": "close the quotes in that line",
    "Illegal character": "remove it, or put the text in quotes",
}
# tables that a file may contain several times
_SEVERAL = (
    "lights",
    "cameras",
    "rows",
    "elements",
    "positions",
    "rules",
    "ghost_targets",
    "wishes",
    "keyframes",
    "curves",
)


def toml_sentence(text: str, error: TOMLDecodeError) -> str:
    """Return a sentence on a TOML syntax error.

    Parameters
    ----------
    text : str
    error : TOMLDecodeError
        The parser's error.

    Returns
    -------
    str
        Continues the file's name: " says f_number twice, ...".
    """
    parser_message = str(error)
    if found := _IN_BRACES.match(parser_message):
        return f"says {found[1]} twice within the braces of line {found[2]}: keep one"
    if _TWICE.match(parser_message):
        if (repeated := next(_repeated(text), None)) is None:
            return f"says the same key twice ({parser_message.rpartition('(')[2].rstrip(')')}): keep one"
        name, first, second = repeated
        remedy = "keep one"
        plain = name.strip("[]")
        if name.startswith("[") and plain.rpartition(".")[2] in _SEVERAL:
            remedy = f"write [[{plain}]] each time where there are several"
        elif name.startswith("["):
            remedy = "put all its keys below one of them"
        return f"says {name} twice, in lines {first} and {second}: {remedy}"
    remedy = next((f": {advice}" for words, advice in _REMEDIES.items() if parser_message.startswith(words)), "")
    if "at end of document" in parser_message:
        remedy = ": a value, a closing bracket or a closing quote is missing"
    return f"is not valid TOML: {parser_message[:1].lower()}{parser_message[1:]}{remedy}"


def _repeated(text: str) -> Iterator[tuple[str, int, int]]:
    """Yield repeated keys and headings, with the lines of the first and of the repeated one."""
    seen: dict[Path, int] = {}
    valued: set[Path] = set()
    entries: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.split("\n"), 1):
        if found := _HEADING.fullmatch(line):
            table, several = _path_of(found[2], (), entries), found[1] == "[["
            if table in seen and not (several and table in entries):
                yield f"{found[1]}{found[2]}{']' * len(found[1])}", seen[table], number
            seen.setdefault(table, number)
            if several:
                entries[table] = entries.get(table, -1) + 1
                table = (*table, entries[table])
        elif found := _KEY.match(line):
            key = _path_of(found[1], table, entries)
            # a key with a value has no keys below it
            before = next((key[:end] for end in range(1, len(key) + 1) if key[:end] in valued), key)
            if before in seen:
                yield found[1], seen[before], number
            seen.setdefault(key, number)
            valued.add(key)


def _path_of(dotted: str, table: Path, entries: dict[Path, int]) -> Path:
    """Return the path of a dotted name; in arrays of tables it refers to the last table."""
    path = table
    names = [name.strip("\"'") for name in re.findall(_NAME, dotted)]
    for name in names[:-1]:
        path = (*path, name)
        if path in entries:
            path = (*path, entries[path])
    return (*path, names[-1])
