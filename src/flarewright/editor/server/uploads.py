"""Files that the user drops on the page or chooses for a field."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import FlarewrightError, ProjectError
from ...io.files.state_folder import state_folder
from ...io.images.mask_image import read_mask
from ...io.images.plate_image import read_depth, read_matte
from ...model import Backplate
from ..commands.lens import choose_lens
from ..commands.shot import iris_of, wearing
from ..preview.plate_view import plate_for
from ..session.files import imported
from ..session.session import Session

MOST_BYTES = 256 * 2**20


def take_in(session: Session, name: str, data: bytes, use: str = "", light: int | None = None) -> tuple[str, ...]:
    """Import a file into the session.

    Parameters
    ----------
    session : Session
    name : str
        Name of the file.
    data : bytes
    use : str
        Use of a picture: "mask" of the iris, "dirt", "image" or "depth" of an occluder; else the plate under the flare.
    light : int, optional
        Light of the occluder; None: all lights.

    Returns
    -------
    tuple of str
        Remarks on repairs and assumptions.

    Raises
    ------
    FlarewrightError
        When the editor cannot read the file.
    """
    if len(data) > MOST_BYTES:
        raise ProjectError(f"{name} is larger than {MOST_BYTES // 2**20} MB, the limit for lenses and pictures")
    found = imported(name, data, state_folder() / "imports", session.reach.check_project)
    if found.picture is not None:
        try:
            return _use_picture(session, found.picture, use, light)
        except FlarewrightError as error:
            # hide the internal path from the message
            raise type(error)(str(error).replace(found.picture, Path(name).name)) from None
    elif use:
        raise ProjectError(f"{name} is no picture; give a PNG, JPEG, TIFF or EXR file")
    elif found.project is not None:
        session.put(found.project, f"Import {name}", begins=True)
    elif found.look is not None:
        changed, remarks = wearing(session.project, found.look)
        session.put(changed, f"Look {found.look.name}", look=True)
        return remarks
    elif found.lens is not None:
        session.put(choose_lens(session.project, found.lens), f"Import {name}")
    return found.remarks


def _use_picture(session: Session, picture: str, use: str, light: int | None) -> tuple[str, ...]:
    """Use a picture; reject one of the wrong kind here, not when it is drawn."""
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
        plate_for(Backplate(image=picture), (16, 16))
        session.do("set_plate", {"values": {"image": picture}})
    return ()


def _use_mask(session: Session, picture: str) -> tuple[str, ...]:
    """Replace the blades by an image, without the blades' rotation."""
    iris = iris_of(session.project)
    values: dict[str, Any] = {"mask": picture}
    turned = iris.rotation_deg if iris.mask is None else 0.0
    if turned:
        values["rotation_deg"] = 0.0
    session.do("set_iris", {"values": values})
    remark = f"the blades were rotated by {turned:g}°; the image is not rotated: Rotation is now 0°"
    return (remark,) if turned else ()
