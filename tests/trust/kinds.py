"""All kinds of hostile input: functions from a seed to a `Verdict`."""

from __future__ import annotations

from collections.abc import Callable

from . import (
    cache_damage,
    editor_posts,
    hostile_fields,
    hostile_files,
    hostile_flags,
    kill_and_resume,
    socket_messages,
)
from .verdict import Verdict

KINDS: dict[str, Callable[[int], Verdict]] = {
    "flags": hostile_flags.run,
    "fields": hostile_fields.run,
    "files": hostile_files.run,
    "posts": editor_posts.run,
    "sockets": socket_messages.run,
    "cache": cache_damage.run,
    "kill": kill_and_resume.run,
}
