"""Art direction of a measured flare: the gain of each ghost that the rules select."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...errors import ProjectError
from ...model.project.art import SELECTOR, Art, Rule

Rgb = tuple[float, float, float]

_EVEN: Rgb = (1.0, 1.0, 1.0)
# a rule with a selector only
_NOTHING = Rule(select="all")


def ghost_gains(
    art: Art, names: Sequence[str], ranked: Callable[[str], Sequence[str]], what: str
) -> dict[str, Rgb | None]:
    """Compute the gains that rules give to measured ghosts.

    Parameters
    ----------
    art : Art
    names : sequence of str
        Names of all ghosts.
    ranked : callable
        Maps "brightest" or "largest" to sorted names; called only when a rule uses that order.
    what : str
        Name of the flare in messages.

    Returns
    -------
    dict of str to tuple of float, or None
        Gains of red, green and blue of each changed ghost; None for a disabled ghost.

    Raises
    ------
    ProjectError
        When a rule names an unknown ghost, requires a lens prescription, or moves light.
    """
    if art.physical:
        return {}
    found: dict[str, tuple[bool, Rgb]] = dict.fromkeys(names, (True, _EVEN))
    for k, rule in enumerate(art.rules):
        where = f"art.rules[{k}], {rule.select!r}"
        if rule.replace(select="all", enable=None, gain=1.0, tint=_EVEN) != _NOTHING:
            raise ProjectError(
                f"{where}: ghosts of a measured flare stay where and as large as they were photographed; a rule has "
                "enable, gain and tint there"
            )
        for name in _chosen(rule.select, names, ranked, f"{where}: {what}"):
            there, (red, green, blue) = found[name]
            by = tuple(rule.gain * each for each in rule.tint)
            gains = red * by[0], green * by[1], blue * by[2]
            found[name] = there if rule.enable is None else rule.enable, gains
    gained = {name: gains if there else None for name, (there, gains) in found.items()}
    return {name: gains for name, gains in gained.items() if gains != _EVEN}


def _chosen(select: str, names: Sequence[str], ranked: Callable[[str], Sequence[str]], where: str) -> set[str]:
    match = SELECTOR.fullmatch(select)
    assert match is not None, "the model validates selectors"
    if match["row"] or match["bounded"]:
        raise ProjectError(
            f"{where} is measured and has no rows or rims; choose all, numbers, brightest:N or largest:N"
        )
    if match["names"]:
        chosen = set(match["names"].split(","))
        if unknown := sorted(chosen - set(names)):
            known = f"those it has are {', '.join(names)}" if names else "it has none"
            raise ProjectError(f"{where} has no ghost {unknown[0]}; {known}")
    elif match["largest"] or match["brightest"]:
        kind = "largest" if match["largest"] else "brightest"
        chosen = set(ranked(kind)[: int(match[kind])])
    else:
        chosen = set(names)
    return set(names) - chosen if match["opposite"] else chosen
