"""Undo and redo of everything: a line of frozen projects, each with what was done to come there."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..model import Project

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
    """

    project: Project
    label: str
    group: str = ""


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
    def undo_label(self) -> str:
        """What undo would take back; empty at the beginning."""
        return self.moments[self.at].label if self.at > 0 else ""

    @property
    def redo_label(self) -> str:
        """What redo would do again; empty at the end."""
        return self.moments[self.at + 1].label if self.at + 1 < len(self.moments) else ""


def begun(project: Project, label: str = "Open") -> History:
    """Return a history of one moment."""
    return History((Moment(project, label),))


def committed(history: History, project: Project, label: str, group: str = "") -> History:
    """Add a project; what was undone before is forgotten.

    Parameters
    ----------
    history : History
    project : Project
    label : str
    group : str
        When it is that of the present moment, which is the last, the new project takes its place.

    Returns
    -------
    History
        The same where the project is the present one; no longer than `MOST`.
    """
    if project == history.present:
        return history
    last = history.moments[history.at]
    kept = history.moments[: history.at + 1]
    if group and group == last.group and history.at > 0 and history.at + 1 == len(history.moments):
        kept = kept[:-1]
    moments = (*kept, Moment(project, label, group))[-MOST:]
    return History(moments, len(moments) - 1)


def undone(history: History) -> History:
    """Go one moment back, as far as there is one."""
    return replace(history, at=max(history.at - 1, 0))


def redone(history: History) -> History:
    """Go one moment on, as far as there is one."""
    return replace(history, at=min(history.at + 1, len(history.moments) - 1))
