"""Positions of a lens from the settings that a file of several configurations holds."""

from __future__ import annotations

from collections.abc import Sequence
from math import isclose
from typing import NamedTuple

from ...model import Lens, Position, Row, Surface
from ...model.lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER

# gaps that differ by less, mm, are equal
SAME_GAP = 1e-9


class Setting(NamedTuple):
    """The lens at one configuration of a file.

    Attributes
    ----------
    number : int
        Number in the file, from 1.
    rows : tuple of Row
        The lens' rows with the gaps of this setting.
    efl : float
        Focal length, mm.
    f_number : float
    field_deg : float or None
    focus_distance : float or None
        In front of the first vertex, mm; None: infinity.
    """

    number: int
    rows: tuple[Row, ...]
    efl: float
    f_number: float
    field_deg: float | None
    focus_distance: float | None


def positions_of(lens: Lens, settings: Sequence[Setting]) -> tuple[tuple[Position, ...], tuple[str, ...]]:
    """Return the positions that settings describe.

    Parameters
    ----------
    lens : Lens
        At the active setting.
    settings : sequence of Setting
        All settings of the file that form a lens.

    Returns
    -------
    positions : tuple of Position
        Empty if no gap inside the lens changes: moving the whole lens focuses it.
    remarks : tuple of str
        Which settings became positions, and why others did not.

    Notes
    -----
    A file does not state which near setting of a zoom belongs to which focal length. Near settings that follow each far
    one in the same number belong to it. Otherwise, as focusing changes a focal length less than zooming does, settings
    with the same rank of the focal length among the far and among the near ones belong together. If neither applies,
    the near ones are left out.
    """
    if len(settings) < 2:
        return (), ()
    remarks: list[str] = []
    usable = _different([setting for setting in settings if _holds(lens, setting, remarks)], remarks)
    moving = sorted({k for setting in usable for k in _moved(lens, setting)})
    if not moving:
        if any(setting.focus_distance is not None for setting in usable):
            remarks.append("the file's configurations move the whole lens to focus it, as --focus does: no positions")
        elif len(usable) > 1:
            remarks.append("the file's configurations differ in no gap of the lens: no positions")
        return (), tuple(remarks)
    labelled = _labelled(usable, remarks)
    names = _names([setting for setting, _ in labelled])
    positions = tuple(
        Position(
            name=name,
            gaps=tuple((k, setting.rows[k].thickness) for k in moving),
            focal_length=label,
            focus_distance=setting.focus_distance,
            f_number=None if isclose(setting.f_number, lens.f_number, rel_tol=1e-9) else setting.f_number,
            field_deg=None if setting.field_deg == lens.field_deg else setting.field_deg,
        )
        for (setting, label), name in zip(labelled, names, strict=True)
    )
    if len(positions) < 2:
        return (), tuple(remarks)
    listed = ", ".join(repr(position.name) for position in positions)
    remarks.append(f"the file's configurations are positions ({listed}); --zoom chooses one")
    return positions, tuple(remarks)


def _moved(lens: Lens, setting: Setting) -> list[int]:
    """Return the rows before a gap that differs from the lens' own; except that in front of the sensor."""
    pairs = zip(lens.rows[:-1], setting.rows[:-1], strict=True)
    return [k for k, (a, b) in enumerate(pairs) if abs(a.thickness - b.thickness) > SAME_GAP]


def _holds(lens: Lens, setting: Setting, remarks: list[str]) -> bool:
    """Return whether a position can hold a setting; else append the reason."""
    why = ""
    if len(lens.rows) != len(setting.rows):
        why = "it has other surfaces"
    elif glass := [k for k in _moved(lens, setting) if _is_glass(lens.rows[k])]:
        why = f"the glass behind row {glass[0]} has another thickness"
    elif negative := [k for k in _moved(lens, setting) if min(lens.rows[k].thickness, setting.rows[k].thickness) < 0.0]:
        why = f"the moving gap behind row {negative[0]} is negative"
    elif not LEAST_F_NUMBER < setting.f_number <= LARGEST_F_NUMBER:
        why = f"its f-number would be f/{setting.f_number:.3g}"
    if why:
        remarks.append(f"configuration {setting.number} is left out: {why}")
    return not why


def _is_glass(row: Row) -> bool:
    return isinstance(row, Surface) and row.medium is not None


def _different(settings: list[Setting], remarks: list[str]) -> list[Setting]:
    """Return the settings without those that repeat the gaps and the focus of an earlier one."""
    kept: list[Setting] = []
    for setting in settings:
        gaps = [row.thickness for row in setting.rows[:-1]]
        same = [
            one.number
            for one in kept
            if one.focus_distance == setting.focus_distance
            and all(abs(a - row.thickness) <= SAME_GAP for a, row in zip(gaps, one.rows, strict=False))
        ]
        if same:
            remarks.append(f"configuration {setting.number} repeats the gaps of configuration {same[0]}; left out")
        else:
            kept.append(setting)
    return kept


def _labelled(settings: Sequence[Setting], remarks: list[str]) -> list[tuple[Setting, float | None]]:
    """Return the settings with the focal length that names their zoom setting; None for a prime lens' focus."""
    far = [setting for setting in settings if setting.focus_distance is None]
    near = [setting for setting in settings if setting.focus_distance is not None]
    if not near:
        return [(setting, None) for setting in far]
    if len(far) <= 1:
        # distances of a prime lens differ, as equal settings are left out
        distances = [setting.focus_distance for setting in settings]
        if len(set(distances)) == len(distances):
            return [(setting, None) for setting in settings]
    elif (partners := _following(settings) or _ranked(far, near)) is not None:
        labelled = [(setting, partners[setting.number]) for setting in settings]
        if len({(label, setting.focus_distance) for setting, label in labelled}) == len(labelled):
            return [*labelled]
    dropped = ", ".join(str(setting.number) for setting in near)
    remarks.append(
        f"configuration{'s'[: len(near) > 1]} {dropped}: the file does not say to which focal length each near setting "
        "belongs; left out"
    )
    return [(setting, None) for setting in far]


def _following(settings: Sequence[Setting]) -> dict[int, float] | None:
    """Return each setting's focal length if as many near settings follow every far one; else None."""
    partners: dict[int, float] = {}
    counts: list[int] = []
    for setting in settings:
        if setting.focus_distance is None:
            label = setting.efl
            counts.append(0)
        elif not counts:
            return None
        else:
            counts[-1] += 1
        partners[setting.number] = label
    return partners if len(set(counts)) == 1 else None


def _ranked(far: Sequence[Setting], near: Sequence[Setting]) -> dict[int, float] | None:
    """Return each setting's focal length by the rank among as many far and near settings; else None."""
    if len(near) != len(far):
        return None
    order = [sorted(group, key=lambda setting: setting.efl) for group in (far, near)]
    return {one.number: partner.efl for group in order for one, partner in zip(group, order[0], strict=True)}


def _names(settings: Sequence[Setting]) -> list[str]:
    """Return a different name for each setting: its focal length, for near ones and for primes its distance."""
    zoom = sum(setting.focus_distance is None for setting in settings) > 1
    names: list[str] = []
    for setting in settings:
        distance = setting.focus_distance or 0.0
        near = f"at {distance:.4g} mm" if distance < 1000.0 else f"at {distance / 1000.0:.4g} m"
        place = "infinity" if setting.focus_distance is None else near
        length = f"{setting.efl:.4g} mm"
        name = place if not zoom else length if setting.focus_distance is None else f"{length} {place}"
        names.append(name if name not in names else f"{name} ({setting.number})")
    return names
