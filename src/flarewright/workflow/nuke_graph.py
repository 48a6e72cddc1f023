"""The nodes that split a flare into passes and add them in Nuke, and their text.

A script is a list of nodes. `push $NAME` puts the result of an earlier node on a stack, a node takes its inputs from
the stack's top (the first one last pushed), and `set NAME [stack 0]` names its result. Values with other letters than
those of plain words stand in quotation marks, in which Tcl's special characters have a backslash.

Source: scripts that the program saves, and the names of its nodes and knobs in its reference.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

_PLAIN = re.compile(r"[A-Za-z0-9_./#%:+-]+")
_SPECIAL = re.compile(r'([\\"\[\]{}$])')
# rows and columns of the node graph, pixels
_ROW, _COLUMN = 90, 130


@dataclass(frozen=True)
class Node:
    """A node.

    Attributes
    ----------
    kind : str
        Its class: Read, Shuffle, Grade, Merge2.
    name : str
        Letters, digits and underscores.
    knobs : tuple of (str, str)
        Values in the words of the file (`quoted`).
    inputs : tuple of str
        Names of nodes; of a Merge2 first B, then A.
    place : tuple of int
        Column and row in the node graph.
    """

    kind: str
    name: str
    knobs: tuple[tuple[str, str], ...] = ()
    inputs: tuple[str, ...] = ()
    place: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class Passes:
    """What a flare consists of.

    Attributes
    ----------
    scale : float
        Factor of the values in the file.
    passes : tuple of str
        Layers that add up to the beauty; empty: only the beauty itself.
    singles : tuple of str
        Layers of single ghosts, to be graded one by one; what they leave of the pass `ghosts` is graded as the rest.
    """

    scale: float = 1.0
    passes: tuple[str, ...] = ()
    singles: tuple[str, ...] = field(default=())


def quoted(text: str) -> str:
    r"""Return a value in the words of a script.

    Examples
    --------
    >>> print(quoted("/shots/flare.####.exr"), quoted("/my shots/[a].exr"))
    /shots/flare.####.exr "/my shots/\[a\].exr"
    """
    if _PLAIN.fullmatch(text):
        return text
    return '"' + _SPECIAL.sub(r"\\\1", " ".join(text.splitlines())) + '"'


def flare_nodes(flare: Passes, source: str, gains: str = "", overall: str = "1") -> list[Node]:
    """Return the nodes that split a flare into passes, grade each, and add them.

    Parameters
    ----------
    flare : Passes
    source : str
        Name of the node that reads the flare.
    gains : str
        Beginning of the expressions for the gain of each pass, "parent." in a gizmo with a knob for each; empty: 1.
    overall : str
        Gain of everything, a number or an expression.

    Returns
    -------
    list of Node
        The last one has the sum.
    """
    # the values of the file become irradiances, and then those of the plate
    made = [
        Node("Multiply", "Irradiance", (("channels", "all"), ("value", repr(1.0 / flare.scale))), (source,), (0, 1)),
        Node("Multiply", "Exposure", (("channels", "all"), ("value", overall)), ("Irradiance",), (0, 2)),
    ]
    if not flare.passes:
        return [*made, _grade("beauty", "Exposure", gains, (0, 3))]
    branches: list[str] = []
    for layer in flare.passes:
        column = len(branches)
        made.append(_shuffle(layer, (column, 3)))
        if layer != "ghosts" or not flare.singles:
            made.append(_grade(layer, f"Pass_{layer}", gains, (column, 5)))
            branches.append(f"Gain_{layer}")
            continue
        for k, single in enumerate(flare.singles, 1):
            made.append(_shuffle(single, (column + k, 3)))
            made.append(_grade(single, f"Pass_{single}", gains, (column + k, 5)))
        total = made_sum(made, [f"Pass_{single}" for single in flare.singles], "Singles", column + 1)
        # B - A: the light of ghosts without a layer
        made.append(Node("Merge2", "Rest", (("operation", "from"),), (f"Pass_{layer}", total), (column, 4)))
        made.append(_grade("rest", "Rest", gains, (column, 5)))
        branches += ["Gain_rest", *(f"Gain_{single}" for single in flare.singles)]
    made_sum(made, branches, "Flare", 0, row=6)
    return made


def made_sum(nodes: list[Node], names: Sequence[str], name: str, column: int, row: int = 4) -> str:
    """Append the nodes that add several results, and return the name of the sum."""
    total = names[0]
    for k, other in enumerate(names[1:], 1):
        label = name if k == len(names) - 1 else f"{name}_{k}"
        nodes.append(Node("Merge2", label, (("operation", "plus"),), (total, other), (column, row + k - 1)))
        total = label
    return total


def _shuffle(layer: str, place: tuple[int, int]) -> Node:
    return Node("Shuffle", f"Pass_{layer}", (("in", layer), ("alpha", "black")), ("Exposure",), place)


def _grade(layer: str, source: str, gains: str, place: tuple[int, int]) -> Node:
    # colours outside the primaries have negative channels, which are light
    gain = f"{{{{{gains}{layer}}}}}" if gains else "1"
    knobs = (("channels", "rgb"), ("white", gain), ("black_clamp", "false"))
    return Node("Grade", f"Gain_{layer}", knobs, (source,), place)


def nodes_text(nodes: Sequence[Node], indent: str = "") -> str:
    """Return the text of nodes, each after those of its inputs."""
    lines: list[str] = []
    for node in nodes:
        lines += [f"push ${name}" for name in reversed(node.inputs)]
        lines += [f"{node.kind} {{"]
        if len(node.inputs) != 1:
            lines.append(f" inputs {len(node.inputs)}")
        x, y = node.place
        knobs = (*node.knobs, ("name", node.name), ("xpos", str(x * _COLUMN)), ("ypos", str(y * _ROW)))
        lines += [f" {knob} {value}" for knob, value in knobs]
        lines += ["}", f"set {node.name} [stack 0]"]
    return "".join(f"{indent}{line}\n" for line in lines)


def layers_text(layers: Sequence[str]) -> str:
    """Return the lines that declare layers with red, green and blue."""
    return "".join(f"add_layer {{{name} {name}.red {name}.green {name}.blue}}\n" for name in layers)
