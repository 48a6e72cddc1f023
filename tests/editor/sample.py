"""Projects for the editor's tests: a fast sample, and plain lenses without photographic defaults."""

from flarewright.editor.session.files import project_for_lens
from flarewright.model import Camera, Iris, Light, Preset, Project
from flarewright.render.scene.resolve import load_lens


def few_ghosts():
    """Return a project with a lens of few, large ghosts, which renders fast."""
    return Project(
        lens="heliar-tronnier", f_number=16.0, iris=Iris(blades=6, rotation_deg=10.0), coating=Preset(name="thesis"),
        lights=(Light(field_deg=(8.0, 4.4)),), camera=Camera(size_px=(1920, 1080)),
    )  # fmt: skip


def plain_lens(name):
    """Return a project with a library lens: f/8, straight blades, one film everywhere, a point light."""
    found = project_for_lens(name)
    iris = load_lens(name).iris
    return found.replace(
        f_number=8.0, coating=Preset(name="single-coated"), iris=iris if iris.blades else Iris(blades=6),
        lights=(found.lights[0].replace(diameter_deg=0.0),),
    )  # fmt: skip
