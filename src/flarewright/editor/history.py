"""Undo and redo of everything: a line of frozen projects, each with what was done to come there."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..model import Design, Project

MOST = 200


@dataclass(frozen=True)
class Moment:
    """A project and the deed that made it.

    Attributes
    ----------
    project : Project
    label : str
        What was done, for a person: "Move the light".
    group : str
        Changes of one group follow each other as one step: all positions of a slider while it is held.
    file : str or None
        The project file that it belongs to.
    begins : bool
        Whether it is another project than the one before: opened, not edited.
    """

    project: Project
    label: str
    group: str = ""
    file: str | None = None
    begins: bool = False


@dataclass(frozen=True)
class History:
    """Moments in order; `at` is the one that is shown."""

    moments: tuple[Moment, ...]
    at: int = 0

    @property
    def present(self) -> Project:
        """The project as it stands."""
        return self.moments[self.at].project

    @property
    def file(self) -> str | None:
        """The project file of the present moment."""
        return self.moments[self.at].file

    @property
    def undo_label(self) -> str:
        """What undo would take back; empty at the beginning."""
        return self.moments[self.at].label if self.at > 0 else ""

    @property
    def redo_label(self) -> str:
        """What redo would do again; empty at the end."""
        return self.moments[self.at + 1].label if self.at + 1 < len(self.moments) else ""


def begun(project: Project, label: str = "Open", file: str | None = None) -> History:
    """Return a history of one moment."""
    return History((Moment(project, label, file=file),))


def committed(
    history: History, project: Project, label: str, group: str = "", *, file: str | None = None, begins: bool = False
) -> History:
    """Add a project; what was undone before is forgotten.

    Parameters
    ----------
    history : History
    project : Project
    label : str
    group : str
        When it is that of the present moment, which is the last, the new project takes its place.
    file : str or None
        The project file that it belongs to.
    begins : bool
        As `Moment.begins`.

    Returns
    -------
    History
        The same where project and file are the present ones; no longer than `MOST`.
    """
    if project == history.present and file == history.file:
        return history
    last = history.moments[history.at]
    kept = history.moments[: history.at + 1]
    if group and group == last.group and history.at > 0 and history.at + 1 == len(history.moments):
        kept = kept[:-1]
    moments = (*kept, Moment(project, label, group, file, begins))[-MOST:]
    return History(moments, len(moments) - 1)


def before_mask(history: History) -> Project | None:
    """Return the project as it was before an image took the place of its blades; None where nobody knows."""
    if not _masked(history.present):
        return None
    for moment in reversed(history.moments[: history.at + 1]):
        if not _masked(moment.project):
            return moment.project
        if moment.begins:
            break
    return None


def _masked(project: Project) -> bool:
    return project.iris is not None and project.iris.mask is not None


def design_before_scratch(history: History) -> Design | None:
    """Return the design as it was before it left the lens' own ghosts out; None where it does not, or always did."""
    before = history.present.design
    for moment in reversed(history.moments[: history.at + 1]):
        before = moment.project.design
        if before is None or before.own_ghosts:
            break
    return None if before is None or not before.own_ghosts or before is history.present.design else before


def design_before_added(history: History) -> Design | None:
    """Return the design as it was before its first new ghost was added; None where there is no new ghost or none knows.

    Who has chosen among structures since, or the count of surfaces, has chosen: None too.
    """
    present = history.present.design
    if present is None or not _has_new(present):
        return None
    for moment in reversed(history.moments[: history.at + 1]):
        before = moment.project.design
        if before is None or not _has_new(before):
            # a wish of one of the lens' own ghosts begins so too
            return before or Design(structure="lens")
        if (before.structure, before.surfaces) != (present.structure, present.surfaces) or moment.begins:
            return None
    return None


def _has_new(design: Design) -> bool:
    return any(wish.ghost is None for wish in design.wishes)


def beginning(history: History) -> Moment | None:
    """Return the moment in which the present project was opened; None where that is no step of the history."""
    return next((moment for moment in reversed(history.moments[: history.at + 1]) if moment.begins), None)


def filed(history: History, file: str | None) -> History:
    """Give the present moment another file, and so those around it that had the same: they are one project."""
    old, first, last = history.file, history.at, history.at
    while first > 0 and history.moments[first - 1].file == old:
        first -= 1
    while last + 1 < len(history.moments) and history.moments[last + 1].file == old:
        last += 1
    own = tuple(replace(moment, file=file) for moment in history.moments[first : last + 1])
    return replace(history, moments=(*history.moments[:first], *own, *history.moments[last + 1 :]))


def undone(history: History) -> History:
    """Go one moment back, as far as there is one."""
    return replace(history, at=max(history.at - 1, 0))


def redone(history: History) -> History:
    """Go one moment on, as far as there is one."""
    return replace(history, at=min(history.at + 1, len(history.moments) - 1))
