"""Solo, mute, gain and tint of single ghosts, as rules of the project's overrides."""

from __future__ import annotations

from typing import Any

from ...errors import ProjectError
from ...model import Art, Project, Rule
from .ghost_rules import hides_without_own, is_solo, own_rule


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
    now = own_rule(project.art, name)
    # what else the file says of the ghost, such as where it is moved, stays
    rule = Rule(select=name) if now is None else now
    if "muted" in values:
        # a ghost that another rule hides is shown by its own
        shown = True if hides_without_own(project, name) else None
        rule = rule.replace(enable=False if values["muted"] else shown)
    rule = rule.replace(gain=values.get("gain", rule.gain), tint=tuple(values.get("tint", rule.tint)))
    rules = [each for each in project.art.rules if each is not now]
    if rule != Rule(select=name):
        # solo takes precedence
        rules.insert(len(rules) - sum(is_solo(each) for each in rules), rule)
    return _with(project, tuple(rules))


def set_solo(project: Project, names: list[str]) -> Project:
    """Solo some ghosts; an empty list ends the solo."""
    rules = tuple(rule for rule in project.art.rules if not is_solo(rule))
    if names:
        rules = (*rules, Rule(select=f"not {','.join(names)}", enable=False))
    return _with(project, rules)


def reset_art(project: Project) -> Project:
    """Remove all overrides."""
    return project.replace(art=Art())


def _with(project: Project, rules: tuple[Rule, ...]) -> Project:
    return project.replace(art=project.art.replace(rules=rules, physical=False))
