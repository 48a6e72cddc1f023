"""Random posts to the editor: none is a fault of the server, and each refusal is one sentence."""

import json
import random

from flarewright.editor.commands.registry import COMMANDS
from flarewright.editor.server.app import _GET, _POST

from ..verdict import Verdict
from .live_editor import live_editor

KIND = "editor post"
# requests of one seed
LENGTH = 12
LONGEST_SENTENCE = 400
NAMES = (
    "light", "x", "y", "values", "row", "column", "text", "lens", "ghost", "at_s", "number", "field_deg", "mask",
    "image", "depth", "blades", "rotation_deg", "intensity", "spectrum", "f_number", "zoom", "size_px", "kind", "gain",
    "tint", "seconds", "plate", "look", "exposure_stops", "name", "group", "table", "color", "structure", "from_row",
    "search", "stops", "threshold", "gain", "layer",
)  # fmt: skip
ODD = (
    None, True, False, 0, -1, 1, 7, 10**20, -(10**400), 1e308, -1e-308, 5e-324, 0.5, "", "1", "nan", "inf", "-0", "1,5",
    "heliar-tronnier", "N-BK7", "/etc/passwd", "../../x", "~nosuchuser/x", "a\x00b", "\ud800", "x" * 5000, "é", [], {},
    [[]], [1, 2], [0.0] * 50, {"a": {"a": {"a": {}}}}, "radius", "physical", "D65", "8-6", "row:1", "all", "#fff",
)  # fmt: skip
RAW = (
    b"", b"[]", b"null", b"7", b"{", b"\xff\xfe\x00", b"[" * 60_000, b'{"a":' * 20_000, b"NaN", b'{"values": 1e999}',
    b'{"name": "set_key", "values": {"light": 0, "at_s": Infinity}}', b" " * 2_000_000, b'{"a": 1}' * 2,
)  # fmt: skip
FOREIGN = (
    {"Cookie": ""}, {"Cookie": "flarewright_token=1"}, {"Origin": "http://evil.example"}, {"Origin": "null"},
    {"Origin": "http://["}, {"Host": "["}, {"Host": "evil.example"}, {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
)  # fmt: skip
FILES = (
    "a.toml",
    "a.lens",
    "a.zmx",
    "a.json",
    "a.png",
    "a.exr",
    "a.pdf",
    "",
    "../../a.toml",
    "x" * 300 + ".toml",
    "%00.png",
)


def run(seed):
    """Send a short series of random posts.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Verdict
    """
    chance, editor = random.Random(seed), live_editor()
    with editor.heard():
        for _ in range(LENGTH):
            path, body, headers = _request(chance)
            subject = f"seed {seed}: POST {path} {headers or ''} {body[:200]!r}"
            try:
                status, answer = editor.ask(path, body, headers)
            except ConnectionError:
                # a body that is refused unread may meet a closed connection
                status, answer = (413, b"{}") if len(body) > 2**20 else (0, b"")
            except OSError as error:
                return Verdict(KIND, subject, False, f"no answer: {error}")
            remark = _wrong(status, answer, bool(headers)) or editor.fault()
            if remark:
                return Verdict(KIND, subject, False, remark)
        # a search would outlast the series
        editor.ask("/api/stop", b"{}")
    return Verdict(KIND, f"seed {seed}", True, "")


def _request(chance):
    """Return path, body and further headers of a random post."""
    headers = chance.choice(FOREIGN) if chance.random() < 0.15 else {}
    path = chance.choice([*_POST, "/api/do", "/api/do", "/api/view", *(chance.choice(list(_GET)),)])
    if path == "/api/import":
        query = "&".join(
            f"{key}={chance.choice(('', 'mask', 'dirt', 'depth', '0', '99', 'nan'))}" for key in ("as", "light")
        )
        name = chance.choice(FILES).replace("/", "%2F").replace(" ", "")
        return f"{path}?name={name}&{query}", bytes(chance.randbytes(chance.choice((0, 9, 900)))), headers
    if chance.random() < 0.2:
        return path, chance.choice(RAW), headers
    body = {"name": chance.choice(list(COMMANDS)), "values": _values(chance), "text": chance.choice(ODD)}
    if path != "/api/do":
        body = _values(chance) | {"text": chance.choice(ODD), "number": chance.choice(ODD), "seconds": 1}
    for key in list(body):
        if chance.random() < 0.1:
            body[key] = chance.choice(ODD)
    return path, json.dumps(body).encode(), headers


def _values(chance):
    picked = chance.sample(NAMES, chance.randrange(6))
    return {name: _values(chance) if chance.random() < 0.2 else chance.choice(ODD) for name in picked}


def _wrong(status, answer, foreign):
    """Return what is wrong with an answer; empty: nothing."""
    if foreign and not 400 <= status < 500:
        return f"a foreign request is answered {status}"
    if not (200 <= status < 500 or status == 503):
        return f"status {status}: {answer[:200]!r}"
    if status < 400 or not answer.startswith(b"{"):
        return ""
    words = json.loads(answer).get("error", "")
    if "\n" in words or "Traceback" in words or len(words) > LONGEST_SENTENCE:
        return f"no sentence: {words[:300]!r}"
    return ""
