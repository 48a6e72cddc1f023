"""What all rules of a project together make of each ghost: those of the page, and those of its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import FlarewrightError
from ...measure.replay.art import ghost_gains
from ...measure.replay.measured_project import flare_of, is_measured
from ...model import Art, Project, Rule
from ...optics.lens.paths import LightPath, mirrors_of, steps_between
from ...render.scene.art_rules import resolve_art
from ...render.scene.resolve import ResolvedProject, resolve_project

_FOUR = 4


@dataclass(frozen=True)
class GhostOverride:
    """The overrides of one ghost."""

    muted: bool = False
    gain: float = 1.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)


def soloed(art: Art) -> tuple[str, ...]:
    """Return the names of the soloed ghosts; empty without solo."""
    for rule in art.rules:
        if is_solo(rule):
            return tuple(rule.select.removeprefix("not ").split(","))
    return ()


def own_rule(art: Art, name: str) -> Rule | None:
    """Return the rule of one ghost alone, the last one if there are several; None if there is none."""
    return next((rule for rule in reversed(art.rules) if rule.select == name), None)


def override_of(art: Art, name: str) -> GhostOverride:
    """Return the overrides in the ghost's own rule; `ghost_rules.overrides` has those of all rules."""
    rule = own_rule(art, name)
    return GhostOverride() if rule is None else GhostOverride(rule.enable is False, rule.gain, rule.tint)


def is_solo(rule: Rule) -> bool:
    """Return whether a rule is exactly that of `set_solo`."""
    names = rule.select.removeprefix("not ")
    named = names[:1].isdigit() or names.startswith("sensor-")
    return rule == Rule(select=f"not {names}", enable=False) and rule.select.startswith("not ") and named


def overrides(project: Project, names: Sequence[str]) -> dict[str, GhostOverride]:
    """Return the effect of all rules but the solo on ghosts.

    Parameters
    ----------
    project : Project
    names : sequence of str
        The ghosts of the picture, brightest first.

    Returns
    -------
    dict of str to GhostOverride
        A ghost's own gain and tint where no other rule changes them; else the product of all gains, with a tint
        whose largest part is 1.
    """
    art = project.art
    if art.physical:
        return dict.fromkeys(names, GhostOverride())
    own = {name: override_of(art, name) for name in names}
    if all(is_solo(rule) or (rule.select in own and own_rule(art, rule.select) is rule) for rule in art.rules):
        return own
    rules = tuple(rule for rule in art.rules if not is_solo(rule))
    try:
        found = _resolved(project.replace(art=Art(rules=rules)), names)
    except FlarewrightError:
        # the picture reports it
        return own
    return {name: _combined(own[name], *found.get(name, (True, (1.0, 1.0, 1.0)))) for name in names}


def hidden(project: Project, names: Sequence[str]) -> frozenset[str]:
    """Return the ghosts that are not in the picture: muted by any rule, or hidden by the solo of others."""
    alone = () if project.art.physical else soloed(project.art)
    made = overrides(project, names)
    return frozenset(name for name in names if made[name].muted or (alone and name not in alone))


def hides_without_own(project: Project, name: str) -> bool:
    """Return whether other rules than its own hide a ghost."""
    art = project.art
    others = tuple(rule for rule in art.rules if rule.select != name)
    return overrides(project.replace(art=art.replace(rules=others, physical=False)), [name])[name].muted


def _combined(own: GhostOverride, enabled: bool, rgb: tuple[float, float, float]) -> GhostOverride:
    gain = max(rgb)
    alike = all(
        abs(own.gain * part - whole) <= 1e-9 * max(gain, 1e-30) for part, whole in zip(own.tint, rgb, strict=True)
    )
    if alike or gain == 0.0:
        return GhostOverride(not enabled, own.gain if alike else 0.0, own.tint)
    red, green, blue = (part / gain for part in rgb)
    return GhostOverride(not enabled, gain, (red, green, blue))


def _resolved(project: Project, names: Sequence[str]) -> dict[str, tuple[bool, tuple[float, float, float]]]:
    if is_measured(project):
        flare = flare_of(project)
        every = [ghost.name for ghost in flare.model.ghosts]
        gains = ghost_gains(project.art, every, lambda _: names, flare.name)
        return {name: (rgb is not None, rgb or (1.0, 1.0, 1.0)) for name, rgb in gains.items()}
    settled = resolve_project(project)
    made = dict(resolve_art(settled).paths)
    if fours := [name for name in names if name.count("-") + 1 == _FOUR]:
        made |= resolve_art(settled, tuple(_four(settled, name) for name in fours)).paths
    return {name: (art.enabled, art.rgb) for name, art in made.items()}


def _four(settled: ResolvedProject, name: str) -> LightPath:
    """Return the path of a ghost of four reflections."""
    count = len(settled.lens.rows)
    return steps_between(count, settled.lens.stop_row, mirrors_of(name, count))
