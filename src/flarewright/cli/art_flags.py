"""The flags of art direction, `--rule`, `--solo`, `--mute`, `--gain` and `--physical`, as what a project file says."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from ..errors import ProjectError
from ..io.project_file import explain
from ..io.taken_for import record_of
from ..model import Art, Project, Rule
from ..model.art import PASSES

if TYPE_CHECKING:
    from .flag_set import Flags


def art_flags(flags: Flags, base: Art) -> dict[str, Any] | None:
    """Return the art direction with the flags' rules after the project's, or None when no flag changes it.

    Parameters
    ----------
    flags : Flags
    base : Art
        What they change.

    Raises
    ------
    ProjectError
        When a flag is no rule or no factor.
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
def naming_rules(flags: Flags, project: Project) -> Iterator[None]:
    """Let what is refused of a rule within name the flag that made it.

    Parameters
    ----------
    flags : Flags
    project : Project
        What `build_project` made of them: their rules stand after those of a project file.
    """
    try:
        yield
    except ProjectError as error:
        told = _flag_rules(flags)
        first = len(project.art.rules) - len(told)
        # begins as `render.art` names rules; of the flags --rule alone blurs
        names = {f"art.rules[{first + k}], {rule.select!r}:": words for k, (words, rule) in enumerate(told)}
        if first == 0:
            names["art.rules:"] = "--rule"
        for name, words in names.items():
            if str(error).startswith(name):
                raise ProjectError(f"{words}:{str(error).removeprefix(name)}") from None
        raise


def _flag_rules(flags: Flags) -> list[tuple[str, Rule]]:
    """Return the rules that flags make, each beside the words that a person gave it in."""
    told = [(f"--rule {text!r}", _told_rule(text)) for text in flags.rule]
    if flags.solo:
        told.append(("--solo", Rule(select="all", enable=False)))
    told += [(f"--solo {text}", _rule("--solo", text, enable=True)) for text in flags.solo]
    told += [(f"--mute {text}", _rule("--mute", text, enable=False)) for text in flags.mute]
    return told + _gains(flags.gain)[1]


def _gains(texts: list[str]) -> tuple[dict[str, float], list[tuple[str, Rule]]]:
    """Return what `--gain` multiplies: passes by their name, and ghosts by rules beside its words."""
    passes: dict[str, float] = {}
    told: list[tuple[str, Rule]] = []
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
            told.append((f"--gain {text}", _rule("--gain", name, gain=factor)))
    return passes, told


def _told_rule(text: str) -> Rule:
    """Return the rule of `--rule`, whose words are those of a project file's [[art.rules]]."""
    try:
        table = tomllib.loads(f"rule = {{ {text} }}")["rule"]
    except tomllib.TOMLDecodeError:
        raise ProjectError(
            f"--rule {text!r} is no rule; write --rule 'select = \"row:7\", gain = 2, tint = [1, 0.6, 0.3]', with the "
            "words of [[art.rules]] in a project file"
        ) from None
    rule, wrong = record_of(Rule.model_validate, table, lambda error: explain(error, table, {"": (Rule,)}))
    if rule is None:
        raise ProjectError(f"--rule: {wrong[0]}")
    return rule


def _rule(flag: str, select: str, **changes: Any) -> Rule:
    try:
        return Rule.model_validate({"select": select, **changes})
    except ValidationError as error:
        raise ProjectError(f"{flag}: {explain(error, {'select': select})[0].removeprefix('select: ')}") from None
