"""What becomes of a file that is dropped on the page, or chosen for something."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import FlarewrightError, ProjectError
from ..io.mask_image import read_mask
from ..io.plate_image import read_depth, read_matte
from ..io.state_folder import state_folder
from ..render.looks import with_look
from .edit_lens import choose_lens
from .edit_shot import iris_of
from .files import imported
from .session import Session
from .shown import plate_for
from .view import View

MOST_BYTES = 256 * 2**20


def take_in(session: Session, name: str, data: bytes, use: str = "", light: int | None = None) -> tuple[str, ...]:
    """Take a file into the session.

    Parameters
    ----------
    session : Session
    name : str
        As the file is called.
    data : bytes
    use : str
        What a picture is for: "mask" of the iris, "dirt", "image" or "depth" that hides lights; else the background.
    light : int, optional
        The one light that is hidden; None: all of them.

    Returns
    -------
    tuple of str
        What was noticed, repaired or assumed.

    Raises
    ------
    FlarewrightError
        When it is nothing that the editor reads.
    """
    if len(data) > MOST_BYTES:
        raise ProjectError(f"{name} is larger than {MOST_BYTES // 2**20} MB, which no lens or background is")
    found = imported(name, data, state_folder() / "imports")
    if found.picture is not None:
        try:
            return _use_picture(session, found.picture, use, light)
        except FlarewrightError as error:
            # where it is kept means nothing to a person
            raise type(error)(str(error).replace(found.picture, Path(name).name)) from None
    elif use:
        raise ProjectError(f"{name} is no picture; give a PNG, JPEG or EXR file")
    elif found.project is not None:
        session.put(found.project, f"Import {name}", begins=True)
    elif found.look is not None:
        changed, remarks = with_look(session.project, found.look)
        session.put(changed, f"Look {found.look.name}")
        return remarks
    elif found.lens is not None:
        session.put(choose_lens(session.project, found.lens), f"Import {name}")
    return found.remarks


def _use_picture(session: Session, picture: str, use: str, light: int | None) -> tuple[str, ...]:
    """Use a picture; what is none of its kind is refused here, not when it is shown."""
    if use == "mask":
        read_mask(picture)
        return _use_mask(session, picture)
    if use == "dirt":
        read_mask(picture, what="dirt")
        session.do("set_dirt", {"values": {"image": picture}})
    elif use == "image":
        read_matte(picture)
        session.do("set_holdout", {"light": light, "values": {"image": picture}})
    elif use == "depth":
        read_depth(picture)
        session.do("set_holdout", {"light": light, "values": {"depth": picture}})
    else:
        plate_for(View(plate=picture), (16, 16))
        session.set_view({"plate": picture})
    return ()


def _use_mask(session: Session, picture: str) -> tuple[str, ...]:
    """Put an image in the place of the blades: upright, for their rotation was none of its own."""
    iris = iris_of(session.project)
    values: dict[str, Any] = {"mask": picture}
    turned = iris.rotation_deg if iris.mask is None else 0.0
    if turned:
        values["rotation_deg"] = 0.0
    session.do("set_iris", {"values": values})
    told = f"the blades were turned by {turned:g}°; the image stands as it was drawn, and Rotation, now 0°, turns it"
    return (told,) if turned else ()
