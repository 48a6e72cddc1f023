"""Random messages to the editor's sockets, floods and sudden ends: the editor keeps answering."""

import json
import logging
import random

from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from ..verdict import Verdict
from .live_editor import PATIENCE_S, live_editor

# the client's library logs tracebacks of connections that the editor ends
CLIENT = logging.getLogger("flarewright.trust.client")
CLIENT.setLevel(logging.CRITICAL + 1)

KIND = "socket message"
LENGTH = 10
# messages of a flood, whose answers no client reads
FLOOD = 300
ODD = (None, True, 0, -1, 10**20, 1e308, "", "1", "nan", "first", [], {}, [1, 2], "x" * 500)
RAW = (
    "", "[]", "null", "7", "{", "[" * 30_000, '{"number": NaN}', '{"room": [1e999, 3]}', b"", b"\xff\xfe", b"{}",
    "x" * 70_000, b"x" * 70_000,
)  # fmt: skip


def run(seed):
    """Open a socket, send random messages, and end it at a random moment.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Verdict
    """
    chance, editor = random.Random(seed), live_editor()
    path = chance.choice(("/ws", "/ws/moving", "/ws/moving"))
    address, subject = f"{editor.address.replace('http', 'ws')}{path}", f"seed {seed}: {path}"
    with editor.heard():
        if chance.random() < 0.1:
            if _enters(address, {"Cookie": "flarewright_token=1"}, editor.address):
                return Verdict(KIND, subject, False, "a client without the token entered")
            if _enters(address, {"Cookie": editor.headers["Cookie"]}, "http://evil.example"):
                return Verdict(KIND, subject, False, "a page of another website entered")
        cookie = {"Cookie": editor.headers["Cookie"]}
        try:
            with connect(
                address, additional_headers=cookie, open_timeout=PATIENCE_S, close_timeout=0.2, logger=CLIENT
            ) as socket:  # fmt: skip
                _talk(chance, socket)
        except (WebSocketException, OSError):
            # it may end a connection whose messages no page sends
            pass
        remark = editor.fault()
    return Verdict(KIND, subject, not remark, remark)


def _enters(address, headers, origin):
    try:
        with connect(address, additional_headers=headers, origin=origin, open_timeout=PATIENCE_S):
            return True
    except WebSocketException:
        return False


def _talk(chance, socket):
    for _ in range(LENGTH):
        if chance.random() < 0.2:
            moved = json.dumps({"number": 1, "light": 0, "x": str(chance.uniform(-9, 9)), "y": "1"})
            for _ in range(FLOOD):
                socket.send(moved)
        elif chance.random() < 0.3:
            socket.send(chance.choice(RAW))
        else:
            names = ("number", "light", "x", "y", "at", "revision", "room")
            socket.send(json.dumps({name: chance.choice(ODD) for name in chance.sample(names, 4)}))
        if chance.random() < 0.3:
            socket.recv(timeout=PATIENCE_S)
        if chance.random() < 0.05:
            # a page that vanishes
            socket.socket.close()
            return
