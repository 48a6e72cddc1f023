"""Camera and lights of a scene of Blender, frame by frame, and what hides them."""

from collections.abc import Generator, Iterator
from math import floor, pi, sqrt
from typing import Any, NamedTuple

from .camera import CameraView, Window, axis_px, camera_state, drawn_window
from .document import LUMINANCE, MOST_FRAMES, LightPath, scene_data
from .errors import FlareError
from .light import Lamp, Sample, lamp_radius, lamp_samples, mesh_samples
from .vectors import Matrix, Vector, column, dot, length, minus, plus, times, unit

# rays to a glowing surface for each one to a lamp: many lie on its back, and its irradiance comes from them
_GLOW_RAYS = 32
# objects that have a surface
_SURFACES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
# a direction farther from the axis than 60 degrees is in no picture, so nothing before it is cut away there
_LEAST_AHEAD = 0.5


class Export(NamedTuple):
    """What a scene gives: its file, what the drawn picture is, and what the user must know."""

    data: dict[str, Any]
    window: Window
    frames: tuple[int, int, int]
    start: int
    remarks: list[str]


def read_scene(context: Any) -> Generator[str, None, Export]:
    """Read camera and lights of all frames, one a step.

    Raises
    ------
    FlareError
        The camera is none that has a lens, or no light reaches it.
    """
    scene = context.scene
    first, last, step = scene.frame_start, scene.frame_end, scene.frame_step
    numbers = list(range(first, last + 1, step))
    if len(numbers) + 2 > MOST_FRAMES:
        raise FlareError(f"the scene has {len(numbers)} frames, more than {MOST_FRAMES - 2}; draw a part of them")
    # an open shutter also sees how the lights move before the first and after the last frame
    numbers = [first - step, *numbers, numbers[-1] + step] if shutter_deg(scene) > 0.0 else numbers
    current, subframe = scene.frame_current, scene.frame_subframe
    paths: dict[Any, LightPath] = {}
    states: list[dict[str, Any]] = []
    window: Window | None = None
    remarks: dict[str, None] = {}
    axes = set()
    try:
        for n, frame in enumerate(numbers):
            yield f"reading frame {frame}, {n + 1} of {len(numbers)}"
            scene.frame_set(frame)
            graph = context.evaluated_depsgraph_get()
            camera = scene.camera
            if camera is None:
                raise FlareError("the scene has no camera; add one, and make it the active camera")
            camera = camera.evaluated_get(graph)
            view = _camera_view(scene, camera)
            window = drawn_window(view) if window is None else window
            axes.add(tuple(round(part, 3) for part in axis_px(view)))
            states.append(camera_state(frame, camera.matrix_world, view, window))
            sight = _Sight(scene, graph, camera)
            for found in _lights(scene, graph, remarks):
                _add_light(found, frame, sight, paths, scene.flarewright, remarks)
    finally:
        scene.frame_set(current, subframe=subframe)
    if shutter_deg(scene) > 0.0 and scene.render.motion_blur_position != "CENTER":
        remarks["the flare is blurred around each frame, and the render before or after it: choose Center"] = None
    if len(axes) > 1:
        remarks["the shift of the camera moves: ghosts are mirrored about its place in the first frame"] = None
    data = scene_data(scene.render.fps / scene.render.fps_base, scene.camera.name, states, list(paths.values()))
    dark = [path.name for path in paths.values() if not path.lit]
    if dark:
        remarks[f"no light of {', '.join(dark)[:200]} reaches the camera"] = None
    assert window is not None
    return Export(data, window, (first, last, step), numbers[0], list(remarks))


def shutter_deg(scene: Any) -> float:
    """Return the angle of the shutter, 0 without motion blur."""
    if not scene.render.use_motion_blur:
        return 0.0
    return min(360.0 * float(scene.render.motion_blur_shutter), 360.0)


def _camera_view(scene: Any, camera: Any) -> CameraView:
    """Return the camera of a frame.

    Raises
    ------
    FlareError
        It is no perspective camera.
    """
    data, render = camera.data, scene.render
    if camera.type != "CAMERA" or data.type != "PERSP":
        raise FlareError(f"the camera {camera.name!r} has no perspective, which a lens has; choose Perspective")
    part = render.resolution_percentage / 100
    size = max(int(render.resolution_x * part), 1), max(int(render.resolution_y * part), 1)
    region = (0, 0, *size)
    if render.use_border and render.use_crop_to_border:
        left, right = (floor(edge * size[0]) for edge in (render.border_min_x, render.border_max_x))
        bottom, top = (floor(edge * size[1]) for edge in (render.border_min_y, render.border_max_y))
        region = (left, bottom, right, top)
    return CameraView(
        data.lens, (data.sensor_width, data.sensor_height), data.sensor_fit, (data.shift_x, data.shift_y), size,
        (render.pixel_aspect_x, render.pixel_aspect_y), region,
    )  # fmt: skip


class _Found(NamedTuple):
    """A light source of a frame: its key over time, its object, and its matrix."""

    key: tuple[Any, ...]
    name: str
    item: Any
    matrix: Matrix


def _lights(scene: Any, graph: Any, remarks: dict[str, None]) -> Iterator[_Found]:
    """Find lamps and glowing objects of a frame, those of instances too."""
    chosen = scene.flarewright.collection
    names = None if chosen is None else {each.name for each in chosen.all_objects}
    for instance in graph.object_instances:
        item, parent = instance.object, instance.parent
        original = item.original
        marks = original.flarewright
        glows = marks.glows and item.type in _SURFACES
        if not (item.type == "LIGHT" or glows) or marks.ignored or not instance.show_self:
            continue
        own = [original, *([parent.original] if parent is not None else [])]
        if names is not None and not names & {each.name for each in own}:
            continue
        if any(_hidden(each, graph) for each in own):
            continue
        # a portal of Cycles guides samples and gives no light; without Cycles there is no such mark
        if item.type == "LIGHT" and getattr(getattr(item.data, "cycles", None), "is_portal", False):
            continue
        matrix = [tuple(row) for row in instance.matrix_world]
        if parent is None:
            yield _Found((original.name,), original.name, item, matrix)
        else:
            key = (parent.original.name, original.name, tuple(instance.persistent_id))
            yield _Found(key, f"{parent.original.name}/{original.name}", item, matrix)
    for each in scene.objects:
        if each.type == "LIGHT" and each.hide_viewport and not each.hide_render:
            remarks[f"{each.name} is hidden in the viewport, so it is left out"] = None


def _hidden(item: Any, graph: Any) -> bool:
    """Return whether an object is left out of renders, itself or with its collections."""
    if item.evaluated_get(graph).hide_render:
        return True
    collections = item.users_collection
    return bool(collections) and all(each.hide_render for each in collections)


class _Sight:
    """What the camera of a frame sees: whether something lies between it and a light."""

    # surfaces that a ray passes before it counts as seen
    MOST_PASSED = 64

    def __init__(self, scene: Any, graph: Any, camera: Any) -> None:
        self._scene, self._graph = scene, graph
        self.place: Vector = tuple(camera.matrix_world.translation)
        # what lies before the clipping plane is not rendered either
        self._near = camera.data.clip_start
        self._ahead = unit(times(column(camera.matrix_world, 2), -1.0))

    def sees(self, sample: Sample, others: bool = True, own: Any = None) -> bool:
        """Return whether nothing lies before a part of a light: no other object, and no part of the source itself."""
        start = self._near / max(dot(sample.direction, self._ahead), _LEAST_AHEAD)
        # a lamp inside a bulb or a glowing surface does not hide itself
        left = min(sample.distance * (1.0 - 1e-4) - start, 1e30)
        origin = plus(self.place, times(sample.direction, start))
        for _ in range(self.MOST_PASSED):
            if left <= 0.0:
                return True
            hit, place, _, _, item, _ = self._scene.ray_cast(self._graph, origin, sample.direction, distance=left)
            if not hit:
                return True
            original = item.original
            unseen = original.flarewright.passes or original.hide_render or not original.visible_camera
            if original == own or (others and not unseen):
                return False
            passed = length(minus(tuple(place), origin)) + 1e-5 * max(sample.distance if left < 1e29 else 1.0, 1.0)
            origin, left = plus(origin, times(sample.direction, passed)), left - passed
        return True


def _add_light(
    found: _Found, frame: int, sight: _Sight, paths: dict[Any, LightPath], settings: Any, remarks: dict[str, None]
) -> None:
    """Add the state of a light at a frame to its path."""
    item = found.item
    if item.type != "LIGHT":
        _add_glow(found, frame, sight, paths, settings)
        return
    lamp, colour = _lamp(item.data, found.matrix, found.name, remarks)
    samples = lamp_samples(lamp, sight.place, settings.rays)
    total = sum(each.irradiance for each in samples)
    seen = sum(each.irradiance for each in samples if not settings.occlusion or sight.sees(each))
    kind = lamp.kind.lower()
    path = paths.setdefault(found.key, LightPath(found.name, kind))
    size = lamp.angle * 180.0 / pi if kind == "sun" else lamp_radius(lamp)
    path.add(frame, found.matrix, times(colour, total), seen / total if total > 0.0 else 0.0, size)


def _lamp(data: Any, matrix: Matrix, name: str, remarks: dict[str, None]) -> tuple[Lamp, Vector]:
    """Return a lamp and its colour."""
    colour: Vector = tuple(data.color)
    if getattr(data, "use_temperature", False):
        colour = _product(colour, tuple(data.temperature_color))
    # the switch is expected to go with Blender 6
    if getattr(data, "use_nodes", True) and data.node_tree is not None:
        glow = _emission(data.node_tree)
        if glow is None:
            remarks[f"the nodes of {name} are more than an Emission with fixed values, so they are left out"] = None
        else:
            colour = _product(colour, glow)
    power = data.energy * 2.0 ** getattr(data, "exposure", 0.0)
    normalized = getattr(data, "normalize", True)
    match data.type:
        case "SUN":
            return Lamp("SUN", matrix, power, normalized=normalized, angle=data.angle), colour
        case "AREA":
            size = (data.size, data.size_y)
            lamp = Lamp("AREA", matrix, power, normalized=normalized, shape=data.shape, size=size, spread=data.spread)
            return lamp, colour
    lamp = Lamp(data.type, matrix, power, data.shadow_soft_size, getattr(data, "use_soft_falloff", True), normalized)
    if data.type == "SPOT":
        lamp = lamp._replace(spot_angle=data.spot_size, spot_blend=data.spot_blend)
    return lamp, colour


def _product(a: Vector, b: Vector) -> Vector:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _emission(tree: Any) -> Vector | None:
    """Return the light of a shader whose emission has fixed values; None for others."""
    output = tree.get_output_node("ALL")
    links = output.inputs["Surface"].links if output is not None else ()
    if not links:
        return None
    node = links[0].from_node
    names = {"EMISSION": ("Color", "Strength"), "BSDF_PRINCIPLED": ("Emission Color", "Emission Strength")}.get(
        node.type
    )
    if names is None or any(name not in node.inputs or node.inputs[name].is_linked for name in names):
        return None
    colour, strength = (node.inputs[name].default_value for name in names)
    return colour[0] * strength, colour[1] * strength, colour[2] * strength


def _add_glow(found: _Found, frame: int, sight: _Sight, paths: dict[Any, LightPath], settings: Any) -> None:
    """Add the state of a glowing object at a frame to its path.

    Its place is the centre of the light that is seen, and its size that of a disc with the area that is seen.
    """
    mesh = found.item.to_mesh()
    try:
        mesh.calc_loop_triangles()
        corners = [_moved(found.matrix, vertex.co) for vertex in mesh.vertices]
        slots: dict[int, list[tuple[Vector, Vector, Vector]]] = {}
        for each in mesh.loop_triangles:
            a, b, c = each.vertices
            slots.setdefault(each.material_index, []).append((corners[a], corners[b], corners[c]))
    finally:
        found.item.to_mesh_clear()
    path = paths.setdefault(found.key, LightPath(found.name, "area"))
    rgb: Vector = (0.0, 0.0, 0.0)
    place: Vector = (0.0, 0.0, 0.0)
    weight = area = 0.0
    for slot, triangles in slots.items():
        radiance = _radiance(found.item, slot)
        level = sum(part * value for part, value in zip(LUMINANCE, radiance, strict=True))
        if level <= 0.0:
            continue
        for sample in mesh_samples(triangles, sight.place, _GLOW_RAYS * settings.rays):
            # a surface hides its own back even where other objects hide nothing
            if not sight.sees(sample, settings.occlusion, found.item.original):
                continue
            rgb = plus(rgb, times(radiance, sample.irradiance))
            spot = plus(sight.place, times(sample.direction, sample.distance))
            place = plus(place, times(spot, level * sample.irradiance))
            weight += level * sample.irradiance
            area += sample.irradiance * sample.distance**2
    matrix = found.matrix
    if weight > 0.0:
        place = times(place, 1.0 / weight)
        matrix = [(*tuple(row)[:3], place[k]) if k < 3 else tuple(row) for k, row in enumerate(found.matrix)]
    path.add(frame, matrix, rgb, 1.0 if weight > 0.0 else 0.0, sqrt(area / pi))


def _radiance(item: Any, slot: int) -> Vector:
    """Return the radiance of a glowing object's material.

    Raises
    ------
    FlareError
        It cannot be read from the material.
    """
    marks = item.original.flarewright
    if marks.radiance > 0.0:
        return times(tuple(marks.colour), marks.radiance)
    slots = item.material_slots
    material = slots[min(slot, len(slots) - 1)].material if len(slots) else None
    glow = None if material is None or material.node_tree is None else _emission(material.node_tree)
    if glow is None:
        what = "no material" if material is None else f"the material {material.name!r}, whose emission is not fixed"
        raise FlareError(f"{item.original.name!r} has {what}; give its radiance in its properties under Flarewright")
    return glow


def _moved(matrix: Matrix, place: Any) -> Vector:
    x, y, z = (row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3] for row in matrix[:3])
    return x, y, z
