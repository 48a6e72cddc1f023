"""A shot of 24 small frames, and the bytes of a folder."""

from __future__ import annotations

from pathlib import Path

from flarewright import Camera, Light, LightKey, Output, Project, Quality

LAST = 24


def project():
    path = (LightKey(at_s=0.0, field_deg=(-6.0, 3.0)), LightKey(at_s=1.0, field_deg=(6.0, 3.0)))
    return Project(
        lens="heliar-tronnier", f_number=16, lights=[Light(field_deg=(5.0, 5.0), keyframes=path)],
        camera=Camera(size_px=(320, 180)), quality=Quality(mode="draft", wavelengths=3),
        output=Output(layers="ghosts", brightest=3, starburst=False),
    )  # fmt: skip


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()
    }
