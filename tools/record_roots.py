"""Record which kernels the commands call with which types, for `src/flarewright/kernels/jit/roots.json`.

    python tools/record_roots.py

A first run and `flarewright warm-up` compile the kernels of that table ahead (docs/adr/0007). Run this tool after a
change of a kernel's parameters or of their types, and when a command calls a new kernel; a test compares the table with
the sources and with calls. It renders small pictures, each in a separate process, and compiles each kernel in an empty
cache: some five minutes of CPU.

The table keeps, for each kernel, the smallest sets of features (`render.warmup.traits`) with which a command called it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TABLE = Path(__file__).resolve().parents[1] / "src" / "flarewright" / "kernels" / "jit" / "roots.json"
SIZE = {"size_px": (64, 36)}
# a render with as few features as possible
PLAIN: dict[str, Any] = {
    "lens": "heliar-tronnier", "coating": {"kind": "everywhere", "coating": {"kind": "none"}}, "camera": SIZE,
    "iris": {"blades": 6}, "lights": [{"field_deg": (8.0, 4.0)}], "output": {"starburst": False},
    "quality": {"wavelengths": 3, "bridge": False, "ringing": "off"},
}  # fmt: skip
COATED = {"coating": {"kind": "preset", "name": "staggered"}}
COLOURS = {"quality": {"bridge": True}}
SEEN_RINGS = {"quality": {"ringing": "collins"}, "f_number": 16.0}
# wide open, rings are rarely visible: with this light none are
RINGS = {"quality": {"ringing": "collins"}, "lights": [{"field_deg": (12.0, 7.0)}]}
SPIKES = {"output": {"starburst": True}}
FAN = {"output": {"starburst": True}, "iris": {"blades": 0}}
MASKED = {"iris": {"blades": 0, "mask": "iris.png"}}
SCATTER = {"scatter": {"model": "abg"}}
DISC = {"lights": [{"field_deg": (8.0, 4.0), "diameter_deg": 0.25}]}
CROWD = {"lights": [{"field_deg": (8.0 - 0.5 * k, 4.0)} for k in range(8)]}
SHAPED = {"imperfection": {"seed": 1}}
# (features,), each of which selects kernels
RENDERS: tuple[tuple[dict[str, Any], ...], ...] = (
    (), (COLOURS,), (COLOURS, COATED), (RINGS,), (SEEN_RINGS,), (SPIKES,), (FAN,), (SCATTER,), (MASKED,),
    (MASKED, SPIKES), (MASKED, COLOURS, COATED), (MASKED, SEEN_RINGS), (COLOURS, COATED, SEEN_RINGS, SPIKES),
    (DISC,), (MASKED, DISC),
)  # fmt: skip
DRAFTS = (
    (),
    (COLOURS,),
    (COATED,),
    (COLOURS, COATED),
    (CROWD,),
    (SPIKES,),
    (FAN,),
    (SCATTER,),
    (MASKED,),
    (COATED, SPIKES),
    (COATED, FAN),
    (COLOURS, COATED, SPIKES),
    (COLOURS, COATED, FAN),
)
REFERENCES = ((), (SCATTER,))
# features that no trait names: their kernels are compiled by `warm-up`, or at their first call
OTHERS: tuple[dict[str, Any], ...] = (
    {"output": {"gamut": "compress"}},
    {"lights": [{"field_deg": (8.0, 4.0), "diameter_deg": 0.53}], "output": {"starburst": True}},
    {"lights": [{"field_deg": (8.0, 4.0), "diameter_deg": 4.0}], "output": {"starburst": True}},
    {"lights": CROWD["lights"], "output": {"starburst": True}},
    {"lights": CROWD["lights"], "output": {"starburst": True}, "iris": {"blades": 0}},
    {"lights": CROWD["lights"], "output": {"starburst": True}, "iris": {"blades": 6, "rounding": 0.3}},
    {"quality": {"orders": 4, "bridge": True}},
    {"quality": {"mode": "reference", "reference_from": "camera", "reference_samples": 1000},
     "lights": [{"field_deg": (8.0, 4.0), "diameter_deg": 4.0}]},
    {"iris": {"blades": 6, "roughness_um": 5.0}, "output": {"starburst": True}, "f_number": 8.0},
)  # fmt: skip
LENS = "heliar-tronnier"
COMMANDS = (f"ghosts {LENS} --light 8,4 --json", f"ghosts {LENS} --light 8,4 --imperfection 1 --json")
# their kernels that no render calls are compiled by `warm-up` alone
OTHER_COMMANDS = (
    f"ghosts {LENS} --light 8,4 --glare --json",
    f"predict {LENS} --samples 5 --check 0 --luminance 50,5000 --glare -o report.html",
    f"predict {LENS} --quality draft --samples 5 --check 0 --json",
    *(f"render {LENS} --light 8,4 --size 64x36 --view {view} -o view.exr" for view in ("srgb", "filmic")),
    "dataset pairs.toml -n 1 -o pairs --processes 1",
    "edit",
)
# of the data set
PAIRS = f"""
size_px = [32, 32]
[lens]
names = "{LENS}"
[sensor]
full_well_e = 5000
"""


def merged(*features: dict[str, Any]) -> dict[str, Any]:
    """Return the plain project with features; nested tables are merged."""
    project = {key: dict(value) if isinstance(value, dict) else value for key, value in PLAIN.items()}
    for feature in features:
        for key, value in feature.items():
            table = project.get(key)
            joined = isinstance(table, dict) and isinstance(value, dict) and key in ("quality", "output")
            project[key] = table | value if joined else value
    return project


def scenarios() -> Iterator[tuple[dict[str, Any] | str, bool]]:
    """Yield a project or the words of a command, and whether its features decide which kernels it calls."""
    modes = (("final", RENDERS), ("draft", DRAFTS), ("reference", REFERENCES))
    for mode, renders in modes:
        limit = {"reference_samples": 1000} if mode == "reference" else {}
        for features in renders:
            for shape in ((), (SHAPED,)):
                yield merged({"quality": {"mode": mode, **limit}}, *features, *shape), True
    yield from ((merged(feature), False) for feature in OTHERS)
    yield from ((words, True) for words in COMMANDS)
    yield from ((words, False) for words in OTHER_COMMANDS)


def watch(scenario: dict[str, Any] | str) -> dict[str, Any]:
    """Run a command in this process; return its traits and the kernels that it called with their types."""
    from PIL import Image

    from flarewright.cli.app import run
    from flarewright.io.project.project_text import project_text
    from flarewright.kernels.jit.roots import needed
    from flarewright.model import Project
    from flarewright.render import warmup
    from flarewright.render.ghosts import traced_ghosts

    # small pictures have no visible steps of lateral colour, which larger ones fill
    traced_ghosts.BRIDGE_PX = 0.01
    seen: list[list[str]] = []
    warmup.needed = lambda traits: seen.append(sorted(traits)) or needed(traits)
    if scenario == "edit":
        first_picture()
    else:
        if not isinstance(scenario, str):
            Image.new("L", (32, 32), 255).save("iris.png")
            Path("shot.toml").write_text(project_text(Project(**scenario)))
            scenario = "render --project shot.toml -o shot.exr"
        Path("pairs.toml").write_text(PAIRS)
        assert run(scenario.split()) == 0, scenario
    return {"traits": seen[0] if seen else [], "called": called()}


def first_picture() -> None:
    """Open the editor without a page and wait for its first picture at rest."""
    from threading import Event

    from flarewright.editor.preview.viewport import packed_pixels
    from flarewright.editor.server.workspace import Workspace
    from flarewright.editor.session.session import begin

    session, _ = begin(None)
    screen = Workspace(session).screen
    idle, prepare = Event(), screen.idle

    def finish() -> None:
        assert prepare is not None
        prepare()
        idle.set()

    screen.idle = finish
    screen.start()
    assert idle.wait(300.0)
    assert screen.wait(60.0)
    assert not screen.problem, screen.problem
    packed_pixels(screen)
    session.writer.close()


def kernels() -> list[Any]:
    """Return the kernels of the loaded modules that Python calls."""
    found = {
        id(each): each for name, module in list(sys.modules.items()) if name.startswith("flarewright.kernels.")
        for each in vars(module).values()
        if hasattr(each, "py_func") and getattr(each._cache, "cache_path", None) is not None
    }  # fmt: skip
    return list(found.values())


def called() -> list[tuple[str, str]]:
    """Return the kernels called in this process, each with the types of its arguments."""
    return sorted(
        (name_of(each.py_func), ", ".join(text_of(one) for one in types))
        for each in kernels()
        for types in each.signatures
    )


def name_of(function: Any) -> str:
    """Return the path of a function or class under `flarewright.kernels`."""
    return f"{function.__module__}.{function.__qualname__}".removeprefix("flarewright.kernels.")


def text_of(one: Any) -> str:
    """Return a type as an expression in Numba's names of types (`flarewright.kernels.jit.warmup.types`)."""
    from numba.core import types

    if isinstance(one, types.Array):
        if one.mutable and one.layout in "AC":
            axes = [":"] * one.ndim
            axes[-1] = "::1" if one.layout == "C" else ":"
            return f"{text_of(one.dtype)}[{','.join(axes)}]"
        return f"Array({text_of(one.dtype)}, {one.ndim}, {one.layout!r}, {not one.mutable})"
    if isinstance(one, types.BaseNamedTuple):
        return f"NamedTuple(({', '.join(map(text_of, one.types))},), {name_of(one.instance_class)!r})"
    if isinstance(one, types.UniTuple):
        return f"UniTuple({text_of(one.dtype)}, {one.count})"
    if isinstance(one, types.BaseTuple):
        return f"Tuple(({', '.join(map(text_of, one.types))},))"
    short = {"float64": "f8", "float32": "f4", "int64": "i8", "int32": "i4", "uint8": "u1", "bool": "b1"}
    return short.get(str(one), str(one))


def compile_each(roots: list[tuple[str, str]]) -> list[dict[str, Any]]:
    """Compile each kernel in a fork of this process that has compiled no other."""
    from numba import njit

    from flarewright.kernels.jit import warmup
    from flarewright.kernels.jit.roots import Root

    # the start of the compiler belongs to no kernel
    njit(lambda x: x + 1.0)(1.0)
    found = []
    for kernel, types in roots:
        table = {"": Root(kernel, types, 0.0, "", 0.0, ())}
        warmup.roots = lambda table=table: table
        warmup.kernel("")
        reader, writer = os.pipe()
        if os.fork() == 0:
            os.write(writer, json.dumps(compile_alone(warmup.kernel(""), warmup.types(""))).encode())
            os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as answer:
            found.append(json.load(answer))
        os.wait()
    return found


def compile_alone(kernel: Any, types: tuple[Any, ...]) -> dict[str, Any]:
    """Compile one kernel; return the CPU seconds, and those of each inner kernel without its callees'."""
    import time

    from numba.core import event

    running: list[list[float]] = []
    inner: dict[str, float] = defaultdict(float)

    class Listener(event.Listener):
        def on_start(self, _: Any) -> None:
            running.append([time.thread_time(), 0.0])

        def on_end(self, ended: Any) -> None:
            started, callees = running.pop()
            total = time.thread_time() - started
            if running:
                running[-1][1] += total
                inner[f"{ended.data['dispatcher'].py_func.__qualname__} {ended.data['args']}"] += total - callees

    started = time.thread_time()
    with event.install_listener("numba:compile", Listener()):
        kernel.compile(types)
    return {"seconds": time.thread_time() - started, "inner": inner}


def in_a_process(cache: str | None, *words: Any) -> Any:
    """Call a function of this module in another process and an empty folder; return its result."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "FLAREWRIGHT_HELPER": "1", "FLAREWRIGHT_STATE": folder}
        environment["NUMBA_CACHE_DIR"] = cache or str(Path(folder) / "cache")
        done = subprocess.run(
            [sys.executable, __file__, json.dumps(words)], cwd=folder, env=environment, stdout=subprocess.PIPE,
            check=True, text=True,
        )  # fmt: skip
    return json.loads(done.stdout.splitlines()[-1])


def smallest(sets: set[frozenset[str]]) -> list[str]:
    """Return the sets that contain no other one, as words."""
    return sorted(" ".join(sorted(one)) for one in sets if not any(other < one for other in sets))


def record() -> dict[str, Any]:
    """Return the table of roots."""
    needs: dict[tuple[str, str], set[frozenset[str]]] = {}
    runs: dict[tuple[str, str], set[int]] = defaultdict(set)
    with tempfile.TemporaryDirectory() as cache:
        for number, (scenario, decides) in enumerate(scenarios()):
            found = in_a_process(cache, "watch", scenario)
            print(scenario, found["traits"], len(found["called"]), file=sys.stderr)
            for kernel, types in found["called"]:
                sets = needs.setdefault((kernel, types), set())
                runs[kernel, types].add(number)
                if decides:
                    sets.add(frozenset(found["traits"]))
    # the types that were recorded first, those of a plain render, get the name without a number
    found = sorted(needs, key=lambda root: root[0])
    times = dict(zip(found, in_a_process(None, "compile_each", found), strict=True))
    names: dict[tuple[str, str], str] = {}
    for kernel, types in times:
        name = kernel.rpartition(".")[2]
        same = sum(other[0].rpartition(".")[2] == name for other in names)
        names[kernel, types] = f"{name}-{same + 1}" if same else name
    table = {}
    for root, name in names.items():
        seconds, inner = times[root]["seconds"], times[root]["inner"]
        shared = {
            other: sum(inner[one] for one in inner.keys() & times[other]["inner"].keys())
            for other in names if times[other]["seconds"] > seconds and runs[root] & runs[other]
        }  # fmt: skip
        kin = max(shared, key=shared.__getitem__, default=root)
        related = shared.get(kin, 0.0) >= 0.1
        table[name] = {
            "kernel": root[0], "types": root[1], "seconds": round(seconds, 2), "kin": names[kin] if related else "",
            "seconds_after_kin": round(seconds - shared[kin], 2) if related else round(seconds, 2),
            "needs": smallest(needs[root]),
        }  # fmt: skip
    return table


if __name__ == "__main__":
    if len(sys.argv) > 1:
        function, *arguments = json.loads(sys.argv[1])
        print(json.dumps({"watch": watch, "compile_each": compile_each}[function](*arguments)))
    else:
        TABLE.write_text(json.dumps(record(), indent=1) + "\n", encoding="utf-8")
