"""The nodes that add the flare to a render."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy

from .document import frame_file
from .errors import FlareError


def put_into_compositor(scene: Any, pattern: Path, frames: tuple[int, int], offset_px: tuple[float, float]) -> Any:
    """Add the flare to what the compositor of a scene puts out, and return the node that does it.

    A node of an earlier call stays where it is, with its values; only its pictures are replaced.

    Parameters
    ----------
    scene : bpy.types.Scene
    pattern : path
        Files of the frames, "flare.####.exr".
    frames : tuple of int
        The first and the last one.
    offset_px : tuple of float
        From the middle of the render to that of the flare, right and up.

    Raises
    ------
    FlareError
        There is no picture for the first frame.
    """
    image = _sequence(pattern, frames[0])
    tree, output = _compositor_tree(scene)
    nodes = [node for node in tree.nodes if getattr(node, "node_tree", None) and node.node_tree.get("flarewright")]
    node = nodes[0] if nodes else None
    if node is None:
        group = bpy.data.node_groups.new("Flarewright", "CompositorNodeTree")
        group["flarewright"] = True
        node = tree.nodes.new("CompositorNodeGroup")
        node.node_tree, node.label = group, "Flarewright"
    kept = {socket.name: socket.default_value for socket in node.inputs if socket.type == "VALUE"}
    image_link = (
        node.inputs["Image"].links[0].from_socket if "Image" in node.inputs and node.inputs["Image"].links else None
    )
    following = [link.to_socket for link in node.outputs[0].links] if len(node.outputs) else []
    _fill_group(node.node_tree, image, frames, offset_px)
    for socket in node.inputs:
        if socket.type == "VALUE":
            socket.default_value = kept.get(socket.name, 0.0)
    if nodes:
        # a changed interface drops its links
        for to in following:
            tree.links.new(node.outputs["Image"], to)
        if image_link is not None:
            tree.links.new(image_link, node.inputs["Image"])
    else:
        _insert(tree, node, output)
    return node


def _sequence(pattern: Path, first: int) -> Any:
    """Return the pictures of the flare as one image."""
    file = frame_file(pattern, first)
    if not file.is_file():
        raise FlareError(f"{file} does not exist; render the flare first")
    image = bpy.data.images.load(str(file), check_existing=True)
    image.source = "SEQUENCE"
    # linear light with the primaries of Rec.709, whatever the working space of the file
    with suppress(TypeError):
        image.colorspace_settings.name = "Linear Rec.709"
    image.reload()
    return image


def _compositor_tree(scene: Any) -> tuple[Any, Any]:
    """Return the nodes of the compositor and the one that puts out its picture; both are made where they lack."""
    scene.render.use_compositing = True
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group
        if tree is None:
            tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
            scene.compositing_node_group = tree
        outputs = [item for item in tree.interface.items_tree if getattr(item, "in_out", "") == "OUTPUT"]
        if not outputs:
            tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        kind = "NodeGroupOutput"
    else:
        scene.use_nodes = True
        tree, kind = scene.node_tree, "CompositorNodeComposite"
    found = [node for node in tree.nodes if node.bl_idname == kind]
    output = next((node for node in found if getattr(node, "is_active_output", True)), None)
    if output is None:
        output = found[0] if found else tree.nodes.new(kind)
        output.location = (400.0, 0.0)
    return tree, output


def _insert(tree: Any, node: Any, output: Any) -> None:
    """Put a node before the output of the compositor."""
    target = output.inputs[0]
    if target.is_linked:
        source = target.links[0].from_socket
    else:
        layers = next((each for each in tree.nodes if each.bl_idname == "CompositorNodeRLayers"), None)
        if layers is None:
            layers = tree.nodes.new("CompositorNodeRLayers")
            layers.location = (output.location[0] - 600.0, output.location[1])
        source = layers.outputs["Image"]
    node.location = (output.location[0] - 200.0, output.location[1])
    tree.links.new(source, node.inputs["Image"])
    tree.links.new(node.outputs["Image"], target)


def _fill_group(group: Any, image: Any, frames: tuple[int, int], offset_px: tuple[float, float]) -> None:
    """Fill the group of nodes that adds the passes of a flare to a picture, each with an exposure."""
    group.nodes.clear()
    sockets = _pass_sockets(group, image, frames)
    wanted = ["Image", *sockets]
    if [item.name for item in group.interface.items_tree if getattr(item, "in_out", "") == "INPUT"] != wanted:
        group.interface.clear()
        group.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        group.interface.new_socket("Image", in_out="INPUT", socket_type="NodeSocketColor")
        for name in sockets:
            stops = group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
            stops.description = "Exposure of this pass, stops"
            stops.min_value, stops.max_value = -20.0, 20.0
    entry, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    entry.location, end.location = (-600.0, 200.0), (300.0 * len(sockets) + 300.0, 0.0)
    total = entry.outputs["Image"]
    for k, (name, socket) in enumerate(sockets.items()):
        exposure = group.nodes.new("CompositorNodeExposure")
        exposure.location = (300.0 * k - 100.0, -200.0)
        group.links.new(socket, exposure.inputs["Image"])
        group.links.new(entry.outputs[name], exposure.inputs["Exposure"])
        light = exposure.outputs[0]
        if offset_px != (0.0, 0.0):
            moved = group.nodes.new("CompositorNodeTranslate")
            moved.location = (300.0 * k, -400.0)
            group.links.new(light, moved.inputs["Image"])
            moved.inputs["X"].default_value, moved.inputs["Y"].default_value = offset_px
            light = moved.outputs[0]
        plus, first, second, result = _plus(group)
        plus.location = (300.0 * k + 100.0, 0.0)
        group.links.new(total, first)
        group.links.new(light, second)
        total = result
    group.links.new(total, end.inputs["Image"])


def _pass_sockets(group: Any, image: Any, frames: tuple[int, int]) -> dict[str, Any]:
    """Return the sockets of the passes that add up to the flare, by name."""
    node = _image_node(group, image, frames, 0)
    found = {socket.name: socket for socket in node.outputs if socket.enabled and socket.name != "Alpha"}
    # in Blender 4 the parts of a file are layers, one a node; in Blender 5 they are outputs of one node
    layers = [layer for layer in _layers(node) if _is_pass(layer)]
    for k, layer in enumerate(layers):
        each = node if k == 0 else _image_node(group, image, frames, k)
        each.layer = layer
        found[layer] = each.outputs[0]
    passes = {name: socket for name, socket in found.items() if _is_pass(name)}
    # a file with the beauty alone has one unnamed picture
    return passes or {"beauty": next(iter(found.values()))}


def _image_node(group: Any, image: Any, frames: tuple[int, int], row: int) -> Any:
    node = group.nodes.new("CompositorNodeImage")
    node.image, node.location = image, (-600.0, -200.0 - 350.0 * row)
    # the number in a file's name is that of the scene's frame
    node.frame_start, node.frame_offset = frames[0], frames[0] - 1
    node.frame_duration = frames[1] - frames[0] + 1
    node.use_auto_refresh = True
    return node


def _layers(node: Any) -> list[str]:
    """Return the layers of an image node; Blender lists them only for an unknown name."""
    if node.has_layers:
        try:
            node.layer = "?"
        except TypeError as error:
            return re.findall(r"'([^']*)'", str(error).rpartition("not found in")[2])
    return []


def _is_pass(name: str) -> bool:
    """Return whether a layer is one of those that add up to the beauty; single ghosts are in the pass of all."""
    return not (name in ("beauty", "Image", "Combined") or name.startswith("ghost_") or "variance" in name)


def _plus(group: Any) -> tuple[Any, Any, Any, Any]:
    """Return a node that adds two pictures, with its two inputs and its output; the first one gives the alpha."""
    try:
        node = group.nodes.new("CompositorNodeMixRGB")
    except RuntimeError:
        node = group.nodes.new("ShaderNodeMix")
        node.data_type, node.blend_type, node.clamp_result = "RGBA", "ADD", False
        inputs = [socket for socket in node.inputs if socket.type == "RGBA"]
        output = next(socket for socket in node.outputs if socket.type == "RGBA")
        node.inputs[0].default_value = 1.0
        return node, inputs[0], inputs[1], output
    node.blend_type, node.use_clamp = "ADD", False
    node.inputs[0].default_value = 1.0
    return node, node.inputs[1], node.inputs[2], node.outputs[0]
