"""The progress of a render rises over all its passes, and reaches its end with the last one."""

from flarewright.model import Camera, Light, Project, Quality, Scatter
from flarewright.render.render import render
from flarewright.render.scattering import scatter_pass

PROJECT = Project(
    lens="triplet-pestrecov", lights=(Light(field_deg=(9.0, 4.0)),), f_number=8.0, camera=Camera(size_px=(32, 18)),
    quality=Quality(wavelengths=1, ringing="off", orders=4, order4_limit=5e-2), scatter=Scatter(model="abg"),
)  # fmt: skip


def test_progress_rises_through_the_passes_to_the_end(monkeypatch):
    # scatter at few points from few rays
    few = scatter_pass.FINE._replace(rays=6, rings=12, spokes=12, fan=8)
    monkeypatch.setattr(scatter_pass, "FINE", few)
    seen = []
    render(PROJECT, progress=lambda part, words: seen.append((part, words)))
    parts, words = zip(*seen, strict=True)
    assert list(parts) == sorted(parts)
    assert parts[-1] == 1.0
    assert {"searching ghosts", "four reflections", "scattered light", "starburst"} <= set(words)
    # the bar stands at its end only when the last pass is drawn
    assert parts[-2] < 1.0
    assert words[-2:] == ("starburst", "starburst")
