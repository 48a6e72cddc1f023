"""Messages on input that a command changed, such as a clamped angle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...model import Project
from ...render.scene.looks import with_look
from ..commands.light_path import STEP_S
from ..commands.shot import STEEPEST_DEG


def correction(name: str, values: dict[str, Any], project: Project) -> str:
    """Describe how a command changed its numbers; empty if it used them unchanged.

    Parameters
    ----------
    name : str
        One of `registry.COMMANDS`.
    values : dict
        Its arguments, as requested.
    project : Project
        After the command.

    Returns
    -------
    str
        One sentence, or empty.
    """
    describe = REPORTED.get(name)
    return "" if describe is None else describe(values, project)


def _light(values: dict[str, Any], project: Project) -> str:
    taken = project.lights[int(values["light"])].field_deg
    asked = (("right", float(values["x"]), taken[0]), ("up", float(values["y"]), taken[1]))
    return "; ".join(
        f"{angle:g}° {side} became {held:g}°: the largest angle of a light is {STEEPEST_DEG:g}°, as a flat picture has "
        "no place beyond it"
        for side, angle, held in asked
        if abs(angle) > STEEPEST_DEG
    )


def _iris(values: dict[str, Any], project: Project) -> str:
    asked = values["values"].get("blades")
    if asked not in (1, 2) or project.iris is None:
        return ""
    now = project.iris.blades
    return f"{asked:g} blades became {now or 'a round opening'}: an iris has 3 blades at least, or 0 for a round one"


def _opening(values: dict[str, Any], project: Project) -> str:
    asked = values["values"].get("f_number")
    if asked is None or project.f_number is None or asked >= project.f_number:
        return ""
    return f"f/{asked:g} became f/{project.f_number:g}: this lens opens no wider"


def _facts(values: dict[str, Any], project: Project) -> str:
    asked = values["values"].get("f_number")
    if asked is None or project.f_number != asked:
        return ""
    return f"the picture is drawn at f/{project.f_number:g}: this lens opens no wider"


def _time(values: dict[str, Any], _: Project) -> str:
    asked = float(values["at_s"])
    if asked < 0.0:
        return f"{asked:g} s became 0 s: a path starts there"
    taken = round(round(asked / STEP_S) * STEP_S, 6)
    return "" if taken == round(asked, 6) else f"{asked:g} s became {taken:g} s: keys lie at hundredths of a second"


def _look(values: dict[str, Any], project: Project) -> str:
    # what does not fit depends on the lens, which a look keeps
    return "; ".join(with_look(project, values["name"])[1])


REPORTED: dict[str, Callable[[dict[str, Any], Project], str]] = {
    "move_light": _light, "set_iris": _iris, "set_fields": _opening, "set_lens_facts": _facts, "set_key": _time,
    "move_key": _time, "put_look": _look,
}  # fmt: skip
