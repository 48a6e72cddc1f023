"""Overrides by the flags `--rule`, `--solo`, `--mute`, `--gain` and `--physical`, as fields of a project file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from ...errors import ProjectError
from ...io.files.type_slips import record_of
from ...io.project.project_file import validation_messages
from ...model import Art, Project, Rule
from ...model.project.art import PASSES

if TYPE_CHECKING:
    from .options.record import RenderOptions


def art_flags(flags: RenderOptions, base: Art) -> dict[str, Any] | None:
    """Return the overrides with the flags' rules after the project's, or None when no flag changes them.

    Parameters
    ----------
    flags : RenderOptions
    base : Art
        Overrides of the project.

    Raises
    ------
    ProjectError
        When a flag is no valid rule or factor.
    """
    if not (flags.rule or flags.mute or flags.solo or flags.gain or flags.physical):
        return None
    passes, _ = _gains(flags.gain)
    return {
        "physical": flags.physical or base.physical,
        "gain": {**base.gain, **passes},
        "rules": [*base.rules, *(rule for _, rule in _flag_rules(flags))],
    }


@contextmanager
def naming_rules(flags: RenderOptions, project: Project) -> Iterator[None]:
    """Make errors on rules within this context name the flag that made the rule.

    Parameters
    ----------
    flags : RenderOptions
    project : Project
        Project of these flags, from `build_project`: their rules follow those of a project file.
    """
    try:
        yield
    except ProjectError as error:
        rules = _flag_rules(flags)
        first = len(project.art.rules) - len(rules)
        # prefix of the names in `render.scene.art_rules`; of the flags only --rule can blur
        names = {f"art.rules[{first + k}], {rule.select!r}:": words for k, (words, rule) in enumerate(rules)}
        if first == 0:
            names["art.rules:"] = "--rule"
        for name, words in names.items():
            if str(error).startswith(name):
                raise ProjectError(f"{words}:{str(error).removeprefix(name)}") from None
        raise


def _flag_rules(flags: RenderOptions) -> list[tuple[str, Rule]]:
    """Return the rules of flags, each with the text that the user gave."""
    rules = [(f"--rule {text!r}", _parsed_rule(text)) for text in flags.rule]
    if flags.solo:
        rules.append(("--solo", Rule(select="all", enable=False)))
    rules += [(f"--solo {text}", _rule("--solo", text, enable=True)) for text in flags.solo]
    rules += [(f"--mute {text}", _rule("--mute", text, enable=False)) for text in flags.mute]
    return rules + _gains(flags.gain)[1]


def _gains(texts: list[str]) -> tuple[dict[str, float], list[tuple[str, Rule]]]:
    """Return the gains of `--gain`: of passes by name, and of ghosts as rules with their texts."""
    passes: dict[str, float] = {}
    rules: list[tuple[str, Rule]] = []
    for text in texts:
        name, _, number = (part.strip() for part in text.rpartition("="))
        try:
            factor = float(number)
        except ValueError:
            name = ""
        if not name:
            raise ProjectError(
                f"--gain {text!r} is no name and factor; write --gain ghosts=2 for a pass, --gain 7-3=0.5 for ghosts"
            )
        if not 0.0 <= factor <= 1e9:
            raise ProjectError(f"--gain {text!r} is no factor of light; give a number between 0 and 1e9")
        if name in PASSES:
            passes[name] = factor
        elif re.fullmatch("[a-z]+", name) and name not in ("all", "not"):
            raise ProjectError(
                f"--gain: there is no pass {name!r}; known are {', '.join(PASSES)}; ghosts are named like 7-3 or row:7"
            )
        else:
            rules.append((f"--gain {text}", _rule("--gain", name, gain=factor)))
    return passes, rules


def _parsed_rule(text: str) -> Rule:
    """Return the rule of `--rule`, with the keys of a project file's [[art.rules]]."""
    try:
        table = tomllib.loads(f"rule = {{ {text} }}")["rule"]
    except tomllib.TOMLDecodeError:
        raise ProjectError(
            f"--rule {text!r} is no rule; write --rule 'select = \"row:7\", gain = 2, tint = [1, 0.6, 0.3]', with the "
            "keys of [[art.rules]] in a project file"
        ) from None
    rule, wrong = record_of(Rule.model_validate, table, lambda error: validation_messages(error, table, {"": (Rule,)}))
    if rule is None:
        raise ProjectError(f"--rule: {wrong[0]}")
    return rule


def _rule(flag: str, select: str, **changes: Any) -> Rule:
    try:
        return Rule.model_validate({"select": select, **changes})
    except ValidationError as error:
        message = validation_messages(error, {"select": select})[0].removeprefix("select: ")
        raise ProjectError(f"{flag}: {message}") from None
