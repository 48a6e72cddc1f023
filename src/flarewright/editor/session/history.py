"""Undo and redo: a list of frozen projects, each with the label of the change that led to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...model import Design, Project

MOST = 200


@dataclass(frozen=True)
class Moment:
    """A project and the change that made it.

    Attributes
    ----------
    project : Project
    label : str
        Label of the change for the user: "Move the light".
    group : str
        Consecutive changes of one group form one step, such as all positions of a slider during a drag.
    file : str or None
        Project file of this state.
    begins : bool
        Whether this state opened another project instead of editing the previous one.
    look : bool
        Whether a look was applied, which can change the brightness by many stops.
    """

    project: Project
    label: str
    group: str = ""
    file: str | None = None
    begins: bool = False
    look: bool = False


@dataclass(frozen=True)
class History:
    """States in order; `at` is the index of the present one."""

    moments: tuple[Moment, ...]
    at: int = 0

    @property
    def present(self) -> Project:
        """The present project."""
        return self.moments[self.at].project

    @property
    def file(self) -> str | None:
        """Project file of the present state."""
        return self.moments[self.at].file

    @property
    def undo_label(self) -> str:
        """Label of the change that undo reverts; empty at the first state."""
        return self.moments[self.at].label if self.at > 0 else ""

    @property
    def redo_label(self) -> str:
        """Label of the change that redo repeats; empty at the last state."""
        return self.moments[self.at + 1].label if self.at + 1 < len(self.moments) else ""


def started(project: Project, label: str = "Open", file: str | None = None) -> History:
    """Return a history with one state."""
    return History((Moment(project, label, file=file),))


def committed(
    history: History,
    project: Project,
    label: str,
    group: str = "",
    *,
    file: str | None = None,
    begins: bool = False,
    look: bool = False,
) -> History:
    """Add a project; undone states are dropped.

    Parameters
    ----------
    history : History
    project : Project
    label : str
    group : str
        If it equals that of the present state, which is the last one, the new project replaces that state.
    file : str or None
        Project file of the new state.
    begins, look : bool
        As in `Moment`.

    Returns
    -------
    History
        Unchanged if project and file are the present ones; at most `MOST` states.
    """
    if project == history.present and file == history.file:
        return history
    last = history.moments[history.at]
    kept = history.moments[: history.at + 1]
    if group and group == last.group and history.at > 0 and history.at + 1 == len(history.moments):
        kept = kept[:-1]
    moments = (*kept, Moment(project, label, group, file, begins, look))[-MOST:]
    return History(moments, len(moments) - 1)


def before_mask(history: History) -> Project | None:
    """Return the project from before an image replaced its blades; None if unknown."""
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
    """Return the design from before it excluded the lens' own ghosts; None if it does not, or always did."""
    before = history.present.design
    for moment in reversed(history.moments[: history.at + 1]):
        before = moment.project.design
        if before is None or before.own_ghosts:
            break
    return None if before is None or not before.own_ghosts or before is history.present.design else before


def design_before_added(history: History) -> Design | None:
    """Return the design from before its first new ghost; None without new ghosts, or if unknown.

    Also None if the user has chosen a structure or a number of surfaces since.
    """
    present = history.present.design
    if present is None or not _has_new(present):
        return None
    for moment in reversed(history.moments[: history.at + 1]):
        before = moment.project.design
        if before is None or not _has_new(before):
            # a target of an own ghost starts in the same way
            return before or Design(structure="lens")
        if (before.structure, before.surfaces) != (present.structure, present.surfaces) or moment.begins:
            return None
    return None


def _has_new(design: Design) -> bool:
    return any(ghost_target.ghost is None for ghost_target in design.ghost_targets)


def first_entry(history: History) -> Moment | None:
    """Return the state that opened the present project; None if it is not in the history."""
    return next((moment for moment in reversed(history.moments[: history.at + 1]) if moment.begins), None)


def exposed_entry(history: History) -> Moment | None:
    """Return the state that opened the present project or applied its last look; None if it is not in the history."""
    own = (moment for moment in reversed(history.moments[: history.at + 1]) if moment.begins or moment.look)
    return next(own, None)


def filed(history: History, file: str | None) -> History:
    """Set the file of the present state and of neighbouring states of the same project with the same file."""
    moments, old, first, last = history.moments, history.file, history.at, history.at
    while first > 0 and not moments[first].begins and moments[first - 1].file == old:
        first -= 1
    while last + 1 < len(moments) and not moments[last + 1].begins and moments[last + 1].file == old:
        last += 1
    own = tuple(replace(moment, file=file) for moment in history.moments[first : last + 1])
    return replace(history, moments=(*history.moments[:first], *own, *history.moments[last + 1 :]))


def undone(history: History) -> History:
    """Go one state back, if there is one."""
    return replace(history, at=max(history.at - 1, 0))


def redone(history: History) -> History:
    """Go one state forward, if there is one."""
    return replace(history, at=min(history.at + 1, len(history.moments) - 1))
