"""Another account of the computer meets a running editor: it enters nothing, reads no token and writes no file.

Needs root, to start a process of the account `nobody`, and an interpreter that this account may run.
"""

from __future__ import annotations

import json
import os
import pwd
import random
import shutil
import subprocess
import tempfile
from contextlib import ExitStack
from functools import cache
from pathlib import Path

from ..verdict import Verdict
from .long_drag import running_editor

KIND = "foreign account"
PATIENCE_S = 60.0
PATHS = (
    "", "api/state", "api/picture", "api/target", "api/section", "api/export/project", "api/export/exr", "api/do",
    "api/save", "api/open", "api/undo", "api/import?name=a.toml", "static/app.js", "ws", "ws/moving",
)  # fmt: skip
# run by the other account: prints what it achieved, one line each
ATTACK = """
import json, os, sys, urllib.error, urllib.request
given = json.load(sys.stdin)
for path, body, cookie in given["requests"]:
    headers = {"Origin": given["address"], **({"Cookie": cookie} if cookie else {})}
    if path.startswith("ws"):
        headers |= {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
                    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    asked = urllib.request.Request(given["address"] + "/" + path, None if body is None else body.encode(), headers)
    try:
        with urllib.request.urlopen(asked, timeout=30) as answer:
            print("entered", path, answer.status)
    except urllib.error.HTTPError as error:
        if error.code != 403:
            print("entered", path, error.code)
    except OSError:
        pass
for path in given["secret"]:
    try:
        data = open(path, "rb").read()
        print("read", path) if given["token"].encode() in data else None
    except OSError:
        pass
for path in given["written"]:
    try:
        open(path, "ab").close()
        print("wrote", path)
    except OSError:
        pass
for path in given["made"]:
    try:
        open(path, "xb").close()
        print("made", path)
    except OSError:
        pass
print("over")
"""


def run(seed: int) -> Verdict:
    """Try random requests and all files as another account.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Verdict
    """
    chance, python = random.Random(f"foreign {seed}"), shutil.which("python3", path="/usr/bin:/bin")
    if os.geteuid() != 0 or python is None:
        return Verdict(
            KIND, f"seed {seed}", True, "skipped: another account needs root, and an interpreter in /usr/bin"
        )
    folder, number, address = _editor()
    state = folder / "state"
    token = (state / "editor-token").read_text("ascii").strip()
    port = address.rpartition(":")[2]
    cookies = ("", f"flarewright_token_{port}=1", f"flarewright_token_{port}=", f"flarewright_token_{port}={'0' * 64}")
    requests = [
        (path, chance.choice((None, "{}", '{"name": "undo"}', '{"text": "/tmp/x.toml"}')), chance.choice(cookies))
        for path in chance.sample(PATHS, 6)
    ]
    files = [str(path) for path in folder.rglob("*") if path.is_file()]
    facts = {
        "address": address, "requests": requests, "token": token, "written": files,
        "secret": [*files, f"/proc/{number}/cmdline", f"/proc/{number}/environ", f"/proc/{number}/mem"],
        "made": [str(state / "x"), str(folder / "x"), str(state / "editor-token")],
    }  # fmt: skip
    account = pwd.getpwnam("nobody")
    done = subprocess.run(
        [python, "-c", ATTACK], input=json.dumps(facts), capture_output=True, text=True, cwd="/", env={},
        timeout=PATIENCE_S, check=False, user=account.pw_uid, group=account.pw_gid, extra_groups=[],
    )  # fmt: skip
    *achieved, over = done.stdout.splitlines() or [""]
    held = over == "over" and not achieved
    subject = f"seed {seed}: {', '.join(path or '/' for path, _, _ in requests)}"
    return Verdict(KIND, subject, held, "; ".join(achieved)[:400] if over == "over" else done.stderr[-300:])


@cache
def _editor() -> tuple[Path, int, str]:
    """Return folder, process and address of an editor whose folders others may enter; it ends with this process."""
    stack = ExitStack()
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="trust-", ignore_cleanup_errors=True)))
    # the least private folders that there are
    folder.chmod(0o755)
    (folder / "state").mkdir(mode=0o755)
    (folder / "shot.toml").write_text('lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [5, 3]\n')
    number, address, _ = stack.enter_context(running_editor(folder, "shot.toml"))
    import atexit

    atexit.register(stack.close)
    return folder, number, address
