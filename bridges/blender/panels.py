"""Settings, commands and panels."""

import json
import os
import shlex
import subprocess
import time
from collections.abc import Generator
from contextlib import suppress
from typing import Any, ClassVar

import bpy

from .compositor import put_into_compositor
from .document import frame_pattern, write_json
from .errors import FlareError
from .job import Job, Work
from .program import Order, Running, find_program, shot_command
from .scene import Export, read_scene, shutter_deg


class _State:
    """What runs in this session, and what the panels show; lenses have a focal length in mm."""

    job: Job | None = None
    program: Running | None = None
    lenses: ClassVar[dict[str, float]] = {}


def program_words() -> str:
    """Return the program of the preferences, or FLAREWRIGHT of the environment where a script has no preferences."""
    addon = bpy.context.preferences.addons.get(__package__)
    if addon is None:
        return os.environ.get("FLAREWRIGHT", "flarewright")
    return str(addon.preferences.program)


def flare_order(scene: Any, export: Export) -> Order:
    """Return what is to be drawn."""
    settings = scene.flarewright
    pattern, file = frame_pattern(_absolute(settings.output, "output"))
    lens = settings.lens.strip()
    if not lens:
        raise FlareError("no lens is given; write a name of `flarewright lenses`, or the path of a lens file")
    return Order(
        lens=lens if not lens.startswith("//") else _absolute(lens, "lens"),
        scene=file,
        pattern=pattern,
        frames=export.frames,
        start=export.start,
        fps=export.data["fps"],
        size_px=export.window.size_px,
        sensor_mm=tuple(export.data["camera"]["frames"][0]["sensor_mm"]),
        f_number=settings.f_number,
        quality=settings.quality,
        shutter_deg=shutter_deg(scene),
        more=settings.options,
    )


def _absolute(text: str, what: str) -> str:
    """Return a path, which may be relative to the file of the scene."""
    if text.startswith("//") and not bpy.data.filepath:
        raise FlareError(f"the {what} {text!r} lies beside the scene, which has no file yet; save it first")
    return str(bpy.path.abspath(text))


def exported(context: Any) -> Generator[str, None, tuple[Export, Order]]:
    """Read the scene and write its file."""
    # what is wrong with the settings is found before the work
    frame_pattern(_absolute(context.scene.flarewright.output, "output"))
    export = yield from read_scene(context)
    order = flare_order(context.scene, export)
    write_json(export.data, order.scene)
    # frames that another machine draws are put into the compositor later
    context.scene["flarewright_offset_px"] = export.window.offset_px
    return export, order


def rendered(context: Any) -> Generator[str, None, list[str]]:
    """Read the scene, draw its flare, and put it into the compositor."""
    scene = context.scene
    program = find_program(program_words())
    export, order = yield from exported(context)
    running = _State.program = Running(shot_command(program, order))
    try:
        while not running.poll():
            yield running.words
    finally:
        running.cancel()
        _State.program = None
    if running.code != 0:
        raise FlareError(running.error)
    count = len(running.summary().get("frames", ()))
    if scene.flarewright.composite:
        put_into_compositor(scene, order.pattern, export.frames[:2], export.window.offset_px)
    made = f"the flare of {count} frame{'s'[: count != 1]} is in {order.pattern.parent}"
    return [made, *export.remarks, *running.remarks]


class FlarewrightPreferences(bpy.types.AddonPreferences):
    """Where the program is."""

    bl_idname = __package__
    __annotations__ = {
        "program": bpy.props.StringProperty(
            name="Program", default="flarewright", subtype="FILE_PATH",
            description="The program flarewright: a name on PATH, its path, or 'python -m flarewright'",
        )
    }  # fmt: skip

    def draw(self, context: Any) -> None:
        """Draw the preferences."""
        self.layout.prop(self, "program")
        self.layout.operator("flarewright.check")


def _suggest_lenses(settings: Any, context: Any, text: str) -> list[str]:
    return [name for name in _State.lenses if text.lower() in name]


# the module of Blender 4.2 crashes at its end after a property with such suggestions
_SUGGESTIONS = {"search": _suggest_lenses, "search_options": {"SUGGESTION"}} if bpy.app.version >= (5, 0, 0) else {}


class FlarewrightSettings(bpy.types.PropertyGroup):
    """Settings of a scene."""

    __annotations__ = {
        "lens": bpy.props.StringProperty(
            name="Lens", default="takumar-50-f1.4", **_SUGGESTIONS,
            description="A lens of Flarewright or of your library, or the path of a lens file",
        ),
        "f_number": bpy.props.FloatProperty(
            name="f-number", default=0.0, min=0.0, max=128.0, description="0: as photographers stop the lens down"
        ),
        "quality": bpy.props.EnumProperty(
            name="Quality", default="draft",
            items=[("draft", "Draft", "Matrices, fast"), ("final", "Final", "Traced rays, with diffraction")],
        ),
        "output": bpy.props.StringProperty(
            name="Output", default="//flare/flare.####.exr", subtype="FILE_PATH",
            description="Files of the frames; #### is the number",
        ),
        "collection": bpy.props.PointerProperty(
            name="Lights", type=bpy.types.Collection, description="Lights that flare; empty: all of the scene"
        ),
        "occlusion": bpy.props.BoolProperty(
            name="Objects hide lights", default=True, description="Cast rays from the camera to each light"
        ),
        "rays": bpy.props.IntProperty(
            name="Rays", default=32, min=1, max=1024, description="Rays to a light that is no point"
        ),
        "composite": bpy.props.BoolProperty(
            name="Put into compositor", default=True, description="Add the flare to the compositor's picture"
        ),
        "options": bpy.props.StringProperty(
            name="Options", default="", description="More options of `flarewright shot`, such as --blades 8"
        ),
    }  # fmt: skip


class FlarewrightObject(bpy.types.PropertyGroup):
    """Marks of an object."""

    __annotations__ = {
        "ignored": bpy.props.BoolProperty(name="Makes no flare", description="Leave this light out"),
        "glows": bpy.props.BoolProperty(
            name="Glowing surface makes flare", description="Its emission is a light source"
        ),
        "radiance": bpy.props.FloatProperty(
            name="Radiance", min=0.0, description="Strength of its emission; 0: that of its material"
        ),
        "colour": bpy.props.FloatVectorProperty(
            name="Color", subtype="COLOR", default=(1.0, 1.0, 1.0), min=0.0, max=1.0
        ),
        "passes": bpy.props.BoolProperty(
            name="Does not hide lights", description="Lights are seen through it, as through glass"
        ),
    }  # fmt: skip


class _Steps(bpy.types.Operator):
    """Work in small steps: beside the interface, or at once from a script."""

    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Return whether nothing else runs."""
        return _State.job is None

    def work(self, context: Any) -> Work:
        """Return the work."""
        raise NotImplementedError

    def execute(self, context: Any) -> set[str]:
        """Do all at once."""
        job = _State.job = Job(self.work(context))
        said = ""
        try:
            while job.advance(1.0):
                if job.words != said and bpy.app.background:
                    print(f"Flarewright: {job.words}", flush=True)
                said = job.words
                time.sleep(0.02)
        finally:
            _State.job = None
        return self._result(job)

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Begin, and continue with each tick of a timer."""
        _State.job = Job(self.work(context))
        self._timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Take the next steps."""
        job = _State.job
        if job is None:
            return {"CANCELLED"}
        if event.type == "ESC":
            job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        more = True
        try:
            more = job.advance(0.05)
        finally:
            if not more or job.state != "RUNNING":
                context.window_manager.event_timer_remove(self._timer)
                _State.job = None
        for area in context.screen.areas if context.screen else ():
            if area.type == "PROPERTIES":
                area.tag_redraw()
        return {"PASS_THROUGH"} if more else self._result(job)

    def cancel(self, context: Any) -> None:
        """Stop when Blender ends the operator itself, as for another file."""
        job, _State.job = _State.job, None
        if job is not None:
            job.cancel()
            # the scene may be gone
            with suppress(ReferenceError):
                job.advance(0.0)

    def _result(self, job: Job) -> set[str]:
        kind = {"FINISHED": "INFO", "CANCELLED": "WARNING"}.get(job.state, "ERROR")
        for line in job.said:
            self.report({kind}, line)
        return {"FINISHED" if job.state == "FINISHED" else "CANCELLED"}


class FlarewrightExport(_Steps):
    """Write the camera and the lights as JSON for `flarewright shot --track`."""

    bl_idname = "flarewright.export"
    bl_label = "Export JSON"

    def work(self, context: Any) -> Work:
        """Read the scene and write it."""
        export, order = yield from exported(context)
        return [f"wrote {order.scene}", *export.remarks]


class FlarewrightRender(_Steps):
    """Draw the flare of all frames, and add it in the compositor."""

    bl_idname = "flarewright.render"
    bl_label = "Render Flare"

    def work(self, context: Any) -> Work:
        """Read the scene, run the program, put its frames into the compositor."""
        return (yield from rendered(context))


class FlarewrightCommand(_Steps):
    """Export the scene, and copy the command that draws its flare, for another machine."""

    bl_idname = "flarewright.copy_command"
    bl_label = "Copy Command"

    def work(self, context: Any) -> Work:
        """Write the scene and the command."""
        export, order = yield from exported(context)
        words = shlex.join(shot_command(["flarewright"], order))
        context.window_manager.clipboard = words
        return [words, *export.remarks]


class FlarewrightCompositor(bpy.types.Operator):
    """Add the frames that are there to the picture of the compositor."""

    bl_idname = "flarewright.composite"
    bl_label = "Put into Compositor"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        """Put the frames into the compositor."""
        scene = context.scene
        try:
            pattern, _ = frame_pattern(_absolute(scene.flarewright.output, "output"))
            offset = tuple(scene.get("flarewright_offset_px", (0.0, 0.0)))
            put_into_compositor(scene, pattern, (scene.frame_start, scene.frame_end), offset)
        except FlareError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class FlarewrightCancel(bpy.types.Operator):
    """Stop; finished frames are kept, and the same command resumes."""

    bl_idname = "flarewright.cancel"
    bl_label = "Cancel Flare"

    def execute(self, context: Any) -> set[str]:
        """Stop what runs."""
        if _State.job is not None:
            _State.job.cancel()
        return {"FINISHED"}


class FlarewrightCheck(bpy.types.Operator):
    """Start the program once: report its version, and learn the names of its lenses."""

    bl_idname = "flarewright.check"
    bl_label = "Check Program"

    def execute(self, context: Any) -> set[str]:
        """Ask the program for its version and its lenses."""
        try:
            program = find_program(program_words())
            version, lenses = (
                subprocess.run([*program, *words], capture_output=True, text=True, timeout=120, check=True).stdout
                for words in (["--version"], ["library", "search", "--json"])
            )
            _State.lenses = {lens["name"]: float(lens["efl_mm"] or 0.0) for lens in json.loads(lenses)["lenses"]}
        except FlareError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except (subprocess.SubprocessError, OSError, ValueError, KeyError, TypeError):
            self.report({"ERROR"}, f"{program_words()!r} is no Flarewright that works; run it in a terminal")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{version.strip()}, {len(_State.lenses)} lenses")
        return {"FINISHED"}


def _focal_words(scene: Any) -> str:
    """Return a sentence on a lens that is much longer or shorter than the camera's; empty for others."""
    focal = _State.lenses.get(scene.flarewright.lens.strip())
    camera = scene.camera
    if not focal or camera is None or camera.type != "CAMERA":
        return ""
    own = camera.data.lens
    return f"the lens has {focal:.0f} mm, the camera {own:.0f} mm" if not 0.8 < focal / own < 1.25 else ""


class FlarewrightPanel(bpy.types.Panel):
    """Settings of the scene's flare."""

    bl_idname = "FLAREWRIGHT_PT_render"
    bl_label = "Flarewright"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw settings and commands."""
        layout, settings = self.layout, context.scene.flarewright
        layout.use_property_split = True
        layout.prop(settings, "lens")
        words = _focal_words(context.scene)
        if words:
            layout.label(text=words, icon="INFO")
        for name in ("f_number", "quality", "collection", "occlusion"):
            layout.prop(settings, name)
        rays = layout.row()
        rays.active = settings.occlusion
        rays.prop(settings, "rays")
        for name in ("output", "options", "composite"):
            layout.prop(settings, name)
        if _State.job is not None:
            layout.label(text=_State.job.words)
            layout.operator("flarewright.cancel", icon="CANCEL")
            return
        layout.operator("flarewright.render", icon="RENDER_ANIMATION")
        row = layout.row()
        for name in ("export", "copy_command", "composite"):
            row.operator(f"flarewright.{name}")


class FlarewrightObjectPanel(bpy.types.Panel):
    """Marks of an object."""

    bl_idname = "FLAREWRIGHT_PT_object"
    bl_label = "Flarewright"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw what counts for this kind of object."""
        layout, item = self.layout, context.object
        layout.use_property_split = True
        marks = item.flarewright
        if item.type == "LIGHT":
            layout.prop(marks, "ignored")
            return
        layout.prop(marks, "passes")
        layout.prop(marks, "glows")
        if marks.glows:
            layout.prop(marks, "radiance")
            row = layout.row()
            row.active = marks.radiance > 0.0
            row.prop(marks, "colour")


_CLASSES = (
    FlarewrightPreferences,
    FlarewrightSettings,
    FlarewrightObject,
    FlarewrightExport,
    FlarewrightRender,
    FlarewrightCommand,
    FlarewrightCompositor,
    FlarewrightCancel,
    FlarewrightCheck,
    FlarewrightPanel,
    FlarewrightObjectPanel,
)


def register() -> None:
    """Add everything to Blender."""
    for each in _CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.flarewright = bpy.props.PointerProperty(type=FlarewrightSettings)
    bpy.types.Object.flarewright = bpy.props.PointerProperty(type=FlarewrightObject)


def unregister() -> None:
    """Remove everything from Blender, and end what runs."""
    if _State.program is not None:
        _State.program.cancel()
    del bpy.types.Scene.flarewright, bpy.types.Object.flarewright
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)
