"""Names of lights on the page, and messages of the program that number them."""

from __future__ import annotations

import re

from ...model import Project

# lights found in a plate, of which there may be many
_FOUND = re.compile(r"plate-\d+")
# a light in messages of renders and of design
_COUNTED = re.compile(r"\blight (\d+) \(counted from 0\)|(?<=\bat )light (\d+)\b")


def light_label(project: Project, number: int) -> str:
    """Return what the button of a light shows: its name, "Light 1", or a mere number for one of a plate."""
    name = project.lights[number].name
    if project.lit_by_plate and _FOUND.fullmatch(name):
        return str(number + 1)
    return f"Light {number + 1}" if name == "light" else name[:1].upper() + name[1:]


def with_light_names(words: str, project: Project) -> str:
    """Return a message with the page's names instead of "light 0 (counted from 0)" and "at light 0"."""

    def name(found: re.Match[str]) -> str:
        number = int(found[1] or found[2])
        if number >= len(project.lights):
            return found[0]
        label = light_label(project, number).removeprefix("Light ")
        return f"light {label}" if label.isdigit() else label

    return _COUNTED.sub(name, words)
