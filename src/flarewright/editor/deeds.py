"""Everything that a person can do to a project, by name: what the page asks for, checked here once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic import ValidationError

from ..errors import FlarewrightError, ProjectError
from ..model import Project
from . import edit_ghosts, edit_lens, edit_path, edit_shot, edit_wishes
from .words import sentence

Deed = Callable[..., Project]

DEEDS: dict[str, tuple[str, Deed]] = {
    "move_light": ("Move the light", edit_shot.move_light),
    "set_light": ("Change the light", edit_shot.set_light),
    "add_light": ("Add a light", edit_shot.add_light),
    "remove_light": ("Remove a light", edit_shot.remove_light),
    "set_key": ("Key the light", edit_path.set_key),
    "move_key": ("Move a key", edit_path.move_key),
    "remove_key": ("Remove a key", edit_path.remove_key),
    "clear_keys": ("Remove the path", edit_path.clear_keys),
    "go_to": ("Go along the path", edit_path.go_to),
    "set_holdout": ("Change what hides the lights", edit_shot.set_holdout),
    "set_camera": ("Change the camera", edit_shot.set_camera),
    "set_quality": ("Change the quality", edit_shot.set_quality),
    "set_fields": ("Change the opening", edit_shot.set_fields),
    "set_iris": ("Change the iris", edit_shot.set_iris),
    "set_dirt": ("Change the dirt", edit_shot.set_dirt),
    "set_starburst": ("Change the starburst", edit_shot.set_starburst),
    "set_pass_gain": ("Grade a pass", edit_shot.set_pass_gain),
    "set_coating": ("Coat the lens", edit_shot.set_coating),
    "put_look": ("Put on a look", edit_shot.put_look),
    "set_row_wavelengths": ("Coat mirrors", edit_shot.set_row_wavelengths),
    "set_cell": ("Edit the prescription", edit_lens.set_cell),
    "add_row": ("Add a row", edit_lens.add_row),
    "duplicate_row": ("Duplicate a row", edit_lens.duplicate_row),
    "remove_row": ("Remove a row", edit_lens.remove_row),
    "move_stop": ("Move the stop", edit_lens.move_stop),
    "choose_lens": ("Choose a lens", edit_lens.choose_lens),
    "set_lens_facts": ("Change the lens", edit_lens.set_lens_facts),
    "set_ghost": ("Change a ghost", edit_ghosts.set_ghost),
    "set_solo": ("Solo", edit_ghosts.set_solo),
    "reset_art": ("Forget changes by hand", edit_ghosts.reset_art),
    "set_wish": ("Annotate a ghost", edit_wishes.set_wish),
    "add_ghost": ("Wish for a ghost", edit_wishes.add_ghost),
    "remove_wish": ("Take a wish back", edit_wishes.remove_wish),
    "set_new_wish": ("Change a wish", edit_wishes.set_new_wish),
    "set_design": ("Change the design", edit_wishes.set_design),
    "clear_wishes": ("Take all wishes back", edit_wishes.clear_wishes),
}


def done(project: Project, name: str, values: dict[str, Any]) -> tuple[Project, str]:
    """Do something to a project.

    Parameters
    ----------
    project : Project
    name : str
        One of `DEEDS`.
    values : dict
        Its arguments.

    Returns
    -------
    project : Project
    label : str
        For the history.

    Raises
    ------
    FlarewrightError
        When it cannot be done; the message is one sentence.
    """
    if name not in DEEDS:
        raise ProjectError(f"the editor knows no {name!r}")
    label, deed = DEEDS[name]
    try:
        return deed(project, **values), label
    except ValidationError as error:
        raise ProjectError(sentence(error)) from None
    except (TypeError, KeyError, IndexError, ValueError) as error:
        if isinstance(error, FlarewrightError):
            raise
        raise ProjectError(f"{label.lower()}: {sentence(error)}") from None
