"""A picture that does not fit into memory is an error before the system kills the program."""

from math import inf

import pytest

from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.render.render import render
from flarewright.render.scene import memory_check


def reported(monkeypatch, tmp_path, megabytes):
    """Simulate a system with this much available memory."""
    file = tmp_path / "meminfo"
    file.write_text(f"MemTotal: 99999999 kB\nMemAvailable: {megabytes * 1024} kB\nSwapFree: 0 kB\nHugePages_Total: 0\n")
    monkeypatch.setattr(memory_check, "MEMINFO", file)


def project(width, height, layers):
    return Project(
        lens="heliar-tronnier",
        lights=(Light(field_deg=(3.0, 2.0)),),
        camera=Camera(size_px=(width, height)),
        quality=Quality(mode="draft", wavelengths=3),
        output=Output(layers=layers),
    )


def test_spare_bytes_of_the_system(monkeypatch, tmp_path):
    reported(monkeypatch, tmp_path, 7)
    assert memory_check.spare_bytes() == 7 * 1024**2
    monkeypatch.setattr(memory_check, "MEMINFO", tmp_path / "none")
    assert memory_check.spare_bytes() == inf


def test_a_picture_larger_than_the_memory_is_refused_at_once(monkeypatch, tmp_path):
    # three passes of 12 bytes a pixel are 12.4 GB: computing them would make the test visibly slow
    reported(monkeypatch, tmp_path, 10_000)
    with pytest.raises(MemoryError):
        render(project(32768, 10_500, "passes"))


def test_many_layers_are_refused_when_they_outgrow_the_memory(monkeypatch, tmp_path):
    # the passes take 0.9 MB, 28 ghosts that fill most of the picture several times that
    reported(monkeypatch, tmp_path, 2)
    render(project(200, 120, "passes"))
    with pytest.raises(MemoryError):
        render(project(200, 120, "ghosts"))
