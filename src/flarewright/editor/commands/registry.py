"""All commands of the page by name; their arguments are checked here."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from ...errors import FlarewrightError, ProjectError
from ...model import Project
from ...sentences import INVALID
from ..common.messages import sentence
from . import design_targets, ghosts, lens, lens_rows, light_path, plate, shot

Command = Callable[..., Project]

COMMANDS: dict[str, tuple[str, Command]] = {
    "move_light": ("Move the light", shot.move_light),
    "set_light": ("Change the light", shot.set_light),
    "add_light": ("Add a light", shot.add_light),
    "remove_light": ("Remove a light", shot.remove_light),
    "set_key": ("Key the light", light_path.set_key),
    "move_key": ("Move a key", light_path.move_key),
    "remove_key": ("Remove a key", light_path.remove_key),
    "clear_keys": ("Remove the path", light_path.clear_keys),
    "go_to": ("Move along the path", light_path.go_to),
    "set_holdout": ("Change the occluder", shot.set_holdout),
    "set_plate": ("Change the plate", plate.set_plate),
    "remove_plate": ("Remove the plate", plate.remove_plate),
    "set_camera": ("Change the camera", partial(shot.set_section, "camera")),
    "set_quality": ("Change the quality", partial(shot.set_section, "quality")),
    "set_fields": ("Change the opening", shot.set_fields),
    "set_iris": ("Change the iris", shot.set_iris),
    "set_dirt": ("Change the dirt", partial(shot.set_section, "dirt")),
    "set_starburst": ("Change the starburst", partial(shot.set_section, "starburst")),
    "set_pass_gain": ("Grade a pass", shot.set_pass_gain),
    "set_coating": ("Coat the lens", shot.set_coating),
    "put_look": ("Apply a look", shot.put_look),
    "set_row_wavelengths": ("Coat mirrors", shot.set_row_wavelengths),
    "set_cell": ("Edit the prescription", lens.set_cell),
    "add_row": ("Add a row", lens_rows.add_row),
    "duplicate_row": ("Duplicate a row", lens_rows.duplicate_row),
    "remove_row": ("Remove a row", lens_rows.remove_row),
    "move_stop": ("Move the stop", lens_rows.move_stop),
    "choose_lens": ("Choose a lens", lens.choose_lens),
    "set_lens_facts": ("Change the lens", lens.set_lens_facts),
    "set_ghost": ("Change a ghost", ghosts.set_ghost),
    "set_solo": ("Solo", ghosts.set_solo),
    "reset_art": ("Reset overrides", ghosts.reset_art),
    "set_ghost_target": ("Set a target", design_targets.set_ghost_target),
    "add_ghost": ("Add a ghost", design_targets.add_ghost),
    "remove_ghost_target": ("Remove a target", design_targets.remove_ghost_target),
    "set_new_ghost_target": ("Change a target", design_targets.set_new_ghost_target),
    "set_design": ("Change the design", design_targets.set_design),
    "clear_ghost_targets": ("Remove all targets", design_targets.clear_ghost_targets),
}


def done(project: Project, name: str, values: dict[str, Any]) -> tuple[Project, str]:
    """Run a command on a project.

    Parameters
    ----------
    project : Project
    name : str
        One of `COMMANDS`.
    values : dict
        Its arguments.

    Returns
    -------
    project : Project
    label : str
        Label for the history.

    Raises
    ------
    FlarewrightError
        When the command fails; the message is one sentence.
    """
    if name not in COMMANDS:
        raise ProjectError(f"the editor has no command {name!r}")
    label, command = COMMANDS[name]
    try:
        return command(project, **values), label
    except INVALID as error:
        raise ProjectError(sentence(error)) from None
    except (TypeError, KeyError, IndexError, ValueError) as error:
        if isinstance(error, FlarewrightError):
            raise
        raise ProjectError(f"{label.lower()}: {sentence(error)}") from None
