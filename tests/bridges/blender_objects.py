"""Objects of Blender for tests."""

import bpy
import pytest


def added(scene, name, data, place=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    item = bpy.data.objects.new(name, data)
    item.location, item.rotation_euler = place, turn
    scene.collection.objects.link(item)
    return item


def camera(scene, place=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), **values):
    data = bpy.data.cameras.new("Camera")
    for key, value in values.items():
        setattr(data, key, value)
    scene.camera = added(scene, "Camera", data, place, turn)
    return scene.camera


def lamp(scene, kind, place=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), name="Lamp", **values):
    data = bpy.data.lights.new(name, kind)
    lacking = [key for key in values if not hasattr(data, key)]
    if lacking:
        pytest.skip(f"lamps of Blender {bpy.app.version_string} have no {lacking[0]}")
    for key, value in values.items():
        setattr(data, key, value)
    return added(scene, name, data, place, turn)


def plane(scene, place=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), half=0.5, name="Plane"):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    return added(scene, name, mesh, place, turn)


def material(item, kind, **inputs):
    """Give an object a material of one shader node, and return it."""
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    item.data.materials.append(made)
    return made


def keyed(item, path, *values):
    """Give a value of an object keys, one a frame from 1 on, without interpolation between."""
    for frame, value in enumerate(values, 1):
        setattr(item, path, value)
        item.keyframe_insert(path, frame=frame)


def finished(work):
    """Return what a work in steps returns at its end."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
