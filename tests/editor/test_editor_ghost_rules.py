"""The page shows what all rules of a project do to a ghost, and its own changes keep the rest of a rule."""

import pytest

from flarewright.editor.commands.ghost_rules import GhostOverride, hidden, overrides
from flarewright.editor.commands.registry import done
from flarewright.editor.preview.ghost_picking import PickableGhosts, SeenGhost
from flarewright.editor.server.page_state import ghost_rows
from flarewright.model import Art, Rule
from flarewright.render.scene.art_rules import resolve_art
from flarewright.render.scene.resolve import resolve_project


def do(project, command, /, **values):
    return done(project, command, values)[0]


def ruled(project, *rules, **more):
    return project.replace(art=Art(rules=rules, **more))


class Looked:
    """A screen that has measured ghosts of these names."""

    def __init__(self, project, names):
        self.session = type("Session", (), {"project": project})
        light = ((0.5, 0.5), (0, 0, 1, 1), None)
        self.seen = PickableGhosts(project, (4, 4), tuple(SeenGhost(name, 1.0, 1.0, 1.0, *light) for name in names))


def test_the_table_shows_mutes_and_gains_of_rules_by_row(project):
    rules = (Rule(select="row:4", enable=False), Rule(select="all", gain=2.0), Rule(select="8-6", tint=(1.0, 0.5, 0.5)))
    rows = {row["name"]: row for row in ghost_rows(Looked(ruled(project, *rules), ["4-1", "8-6"]))["ghosts"]}
    assert (rows["4-1"]["muted"], rows["8-6"]["muted"]) == (True, False)
    assert rows["8-6"]["whole"] == {"gain": 2.0, "tint": [1.0, 0.5, 0.5]}
    # the sliders have the ghost's own rule
    assert (rows["8-6"]["gain"], rows["8-6"]["tint"]) == (1.0, [1.0, 0.5, 0.5])


def test_a_ghost_that_a_rule_by_row_hides_is_shown_by_its_own_rule(project):
    by_row = ruled(project, Rule(select="row:4", enable=False))
    assert hidden(by_row, ["4-1", "8-6"]) == {"4-1"}
    shown = do(by_row, "set_ghost", name="4-1", values={"muted": False})
    assert hidden(shown, ["4-1", "8-6"]) == set()
    assert "4-1" not in resolve_art(resolve_project(shown)).paths
    # without such a rule the switch leaves nothing behind
    muted = do(project, "set_ghost", name="4-1", values={"muted": True})
    assert do(muted, "set_ghost", name="4-1", values={"muted": False}) == project


def test_a_changed_gain_keeps_where_the_file_moves_a_ghost(project):
    moved = Rule(select="4-1", offset_mm=(1.0, 0.5), scale=2.0, enable=True)
    twice = ruled(project, Rule(select="4-1", gain=3.0), moved)
    changed = do(twice, "set_ghost", name="4-1", values={"gain": 0.5})
    assert changed.art.rules == (Rule(select="4-1", gain=3.0), moved.replace(gain=0.5))
    assert overrides(changed, ["4-1"])["4-1"].gain == pytest.approx(1.5)


def test_switched_off_rules_are_not_shown_until_the_page_changes_one(project):
    off = ruled(project, Rule(select="4-1", enable=False), physical=True, gain={"ghosts": 3.0})
    assert overrides(off, ["4-1"]) == {"4-1": GhostOverride()}
    on = do(off, "set_pass_gain", name="starburst", gain=2.0)
    assert dict(resolve_art(resolve_project(on)).gain) == {"ghosts": 3.0, "starburst": 2.0}


def test_ghosts_of_four_reflections_follow_rules_by_row(project):
    rules = ruled(project.replace(quality=project.quality.replace(orders=4)), Rule(select="row:3", enable=False))
    made = overrides(rules, ["8-6", "6-3-5-1"])
    assert [made[name].muted for name in ("8-6", "6-3-5-1")] == [False, True]
