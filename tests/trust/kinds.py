"""All kinds of hostile input: functions from a seed to a `Verdict`."""

from __future__ import annotations

from collections.abc import Callable

from . import cache_damage, hostile_fields, hostile_files, hostile_flags, kill_and_resume, limited_machine
from .editor import foreign_account, hostile_page, posts, sockets
from .verdict import Verdict

KINDS: dict[str, Callable[[int], Verdict]] = {
    "flags": hostile_flags.run,
    "fields": hostile_fields.run,
    "files": hostile_files.run,
    "posts": posts.run,
    "sockets": sockets.run,
    "cache": cache_damage.run,
    "kill": kill_and_resume.run,
    "memory": limited_machine.memory,
    "disk": limited_machine.disk,
    "account": foreign_account.run,
    "page": hostile_page.run,
    "stages": kill_and_resume.run_long,
}

# jobs of minutes: only when named, or when there is time for them, minutes
SLOW = {"stages": 30.0}
