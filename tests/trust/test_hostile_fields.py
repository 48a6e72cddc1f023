"""The rig tries a value in a field of an otherwise valid file, so that an answer concerns that field."""

import tomllib

import pytest

pytest.importorskip("resource", reason="limits of a process need a POSIX system")

from flarewright.errors import FlarewrightError
from flarewright.io.project.project_file import read_project
from flarewright.io.project.scene_file import read_scene

from .hostile_fields import fields, file_text, with_value
from .hostile_flags import prepared

# fields of which 1 is beyond the limits that the message names, or that another format of the lens file replaces
ONE_IS_OUT = {
    "lens.rows.[2].kind=surface.curvature_x", "lens.rows.[2].kind=surface.medium.n_d",
    "lens.rows.[2].kind=surface.medium.v_d", "lens.positions.[1].gaps.[1].[2]",
    "lights.[1].spectrum.kind=lines.lines.[1].[2]", "design.fixed_rows.[1]", "design.bounds.n_d.[2]",
    # three numbers are values of a curve of colours, and the curves of the file are of others
    "curves.[1].values.[1].[3]", "lights.[1].curves.[1].values.[1].[3]",
}  # fmt: skip


@pytest.mark.parametrize(("name", "read"), [("match.toml", read_scene), ("shot.toml", read_project)])
def test_a_field_is_tried_without_another_fault(name, read, tmp_path):
    plain = tomllib.loads((prepared() / name).read_text("utf-8"))
    lens = tomllib.loads((prepared() / "lens.toml").read_text("utf-8"))
    beside = set()
    for path in fields(name):
        data = {**plain, "lens": lens} if path[0] == "lens" else plain
        (tmp_path / name).write_text(file_text(with_value(name, data, path, 1)), "utf-8")
        try:
            read(tmp_path / name)
        except FlarewrightError as error:
            problems = error.problems or (str(error),)
            if len(problems) > 1 or path[-1].strip("[]") not in problems[0]:
                beside.add(".".join(path))
    assert beside <= ONE_IS_OUT
    assert any("kind=distant" in path for path in fields("match.toml"))
