"""Solo, mute, gain and tint of single ghosts, as rules of the project's overrides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...errors import ProjectError
from ...model import Art, Project, Rule


@dataclass(frozen=True)
class GhostOverride:
    """The overrides of one ghost."""

    muted: bool = False
    gain: float = 1.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)


def soloed(art: Art) -> tuple[str, ...]:
    """Return the names of the soloed ghosts; empty without solo."""
    for rule in art.rules:
        if _is_solo(rule):
            return tuple(rule.select.removeprefix("not ").split(","))
    return ()


def override_of(art: Art, name: str) -> GhostOverride:
    """Return the overrides in the ghost's own rule."""
    rule = next((rule for rule in art.rules if rule.select == name), None)
    return GhostOverride() if rule is None else GhostOverride(rule.enable is False, rule.gain, rule.tint)


def is_shown(art: Art, name: str) -> bool:
    """Return whether a ghost is in the picture: neither muted, nor hidden by the solo of others."""
    alone = soloed(art)
    return not override_of(art, name).muted and (not alone or name in alone)


def set_ghost(project: Project, name: str, values: dict[str, Any]) -> Project:
    """Change a ghost's own rule.

    Parameters
    ----------
    project : Project
    name : str
        "j-i".
    values : dict
        Any of `muted`, `gain`, `tint`.

    Returns
    -------
    Project
        Without a rule that changes nothing.
    """
    if unknown := set(values) - {"muted", "gain", "tint"}:
        raise ProjectError(f"a ghost has no {', '.join(sorted(unknown))}; it can be muted, or given a gain or a tint")
    now = override_of(project.art, name)
    muted = bool(values.get("muted", now.muted))
    rule = Rule(
        select=name, enable=False if muted else None, gain=values.get("gain", now.gain),
        tint=tuple(values.get("tint", now.tint)),
    )  # fmt: skip
    rules = [each for each in project.art.rules if each.select != name]
    if rule != Rule(select=name):
        # solo takes precedence
        rules.insert(len(rules) - sum(_is_solo(each) for each in rules), rule)
    return _with(project, tuple(rules))


def set_solo(project: Project, names: list[str]) -> Project:
    """Solo some ghosts; an empty list ends the solo."""
    rules = tuple(rule for rule in project.art.rules if not _is_solo(rule))
    if names:
        rules = (*rules, Rule(select=f"not {','.join(names)}", enable=False))
    return _with(project, rules)


def reset_art(project: Project) -> Project:
    """Remove all overrides."""
    return project.replace(art=Art())


def _is_solo(rule: Rule) -> bool:
    # exactly the rule of `set_solo`
    names = rule.select.removeprefix("not ")
    named = names[:1].isdigit() or names.startswith("sensor-")
    return rule == Rule(select=f"not {names}", enable=False) and rule.select.startswith("not ") and named


def _with(project: Project, rules: tuple[Rule, ...]) -> Project:
    return project.replace(art=project.art.replace(rules=rules, physical=False))
