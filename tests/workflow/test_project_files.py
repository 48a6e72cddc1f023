"""What opening a project finds: values of its curves that the lens cannot have."""

from __future__ import annotations

from pathlib import Path

import pytest

from flarewright import Light, Project, ProjectCurve
from flarewright.errors import FlarewrightError
from flarewright.io.project.project_file import read_project
from flarewright.workflow import open_project_files


def moving(of, values):
    curve = ProjectCurve(of=of, at_s=(0.0, 2.0), values=values)
    return Project(lens="canon-70-200", lights=[Light(field_deg=(0.0, 0.0))], curves=(curve,))


@pytest.mark.parametrize(
    ("of", "values", "said"),
    [
        ("zoom", (100.0, 200.0), "at 2 s: .* zooms from 72.09 to 194.00 mm, not to 200 mm"),
        ("f_number", (1.0, 8.0), "at 0 s: .*f/"),
    ],
)
def test_a_key_that_the_lens_cannot_take_is_found_before_a_shot(of, values, said):
    """`project check` called the project usable, and the shot refused it."""
    with pytest.raises(FlarewrightError, match=said):
        open_project_files("drive.toml", moving(of, values))
    assert open_project_files("drive.toml", moving("zoom", (75.0, 190.0))).project.curves


def test_the_project_on_the_page_of_shots_can_be_drawn(tmp_path):
    """Its zoom ran from 70 to 200 mm, and the lens zooms from 72 to 194."""
    page = (Path(__file__).parents[2] / "docs" / "shots.md").read_text("utf-8")
    (tmp_path / "drive.toml").write_text(page.partition("```toml\n")[2].partition("```")[0], "utf-8")
    project = read_project(tmp_path / "drive.toml")
    assert len(project.curves) == 1
    open_project_files("drive.toml", project)
