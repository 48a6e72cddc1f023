"""What is said where a number that was typed has been taken as another one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..model import Project
from .edit_path import STEP_S
from .edit_shot import STEEPEST_DEG


def correction(name: str, values: dict[str, Any], project: Project) -> str:
    """Say what a deed has made of its numbers; empty where it took them as they were.

    Parameters
    ----------
    name : str
        One of `deeds.DEEDS`.
    values : dict
        Its arguments, as they were asked for.
    project : Project
        As it came out.

    Returns
    -------
    str
        One sentence, or nothing.
    """
    told = TOLD.get(name)
    return "" if told is None else told(values, project)


def _light(values: dict[str, Any], project: Project) -> str:
    taken = project.lights[int(values["light"])].field_deg
    asked = (("right", float(values["x"]), taken[0]), ("up", float(values["y"]), taken[1]))
    return "; ".join(
        f"{angle:g}° {side} became {held:g}°: a light goes out to {STEEPEST_DEG:g}° at most, for beyond that a flat "
        "picture has no place for it"
        for side, angle, held in asked
        if abs(angle) > STEEPEST_DEG
    )


def _iris(values: dict[str, Any], project: Project) -> str:
    asked = values["values"].get("blades")
    if asked not in (1, 2) or project.iris is None:
        return ""
    now = project.iris.blades
    return f"{asked:g} blades became {now or 'a round opening'}: an iris has 3 blades at least, or 0 and is round"


def _opening(values: dict[str, Any], project: Project) -> str:
    asked = values["values"].get("f_number")
    if asked is None or project.f_number is None or asked >= project.f_number:
        return ""
    return f"f/{asked:g} became f/{project.f_number:g}: this lens opens no wider"


def _time(values: dict[str, Any], _: Project) -> str:
    asked = float(values["at_s"])
    if asked < 0.0:
        return f"{asked:g} s became 0 s: a path begins there"
    taken = round(round(asked / STEP_S) * STEP_S, 6)
    return "" if taken == round(asked, 6) else f"{asked:g} s became {taken:g} s: keys stand at hundredths of a second"


TOLD: dict[str, Callable[[dict[str, Any], Project], str]] = {
    "move_light": _light, "set_iris": _iris, "set_fields": _opening, "set_key": _time, "move_key": _time,
}  # fmt: skip
