"""The path of a light: its keyframes."""

from __future__ import annotations

from ...errors import ProjectError
from ...model import LightKey, Project
from ...workflow.keyframes import project_at
from .shot import light_of

# time step of keys: two times within half a step belong to the same key
STEP_S = 0.01


def go_to(project: Project, at_s: float) -> Project:
    """Put everything that moves at its value of a time; angles are rounded for display."""
    placed = project_at(project, float(at_s))
    lights = (
        light.replace(field_deg=tuple(round(angle, 4) for angle in light.field_deg)) if light.keyframes else light
        for light in placed.lights
    )
    return placed.replace(lights=tuple(lights))


def set_key(project: Project, light: int, at_s: float, field_deg: list[float] | None = None) -> Project:
    """Set a key of a light at a time, at its present or given angles; an existing key is moved."""
    chosen = light_of(project, light)
    at_s = round(max(float(at_s), 0.0) / STEP_S) * STEP_S
    place = chosen.field_deg if field_deg is None else tuple(field_deg)
    new = LightKey(at_s=round(at_s, 6), field_deg=place)
    others = [key for key in chosen.keyframes if abs(key.at_s - new.at_s) > 0.5 * STEP_S]
    return _with_keys(project, light, [*others, new])


def move_key(project: Project, light: int, number: int, at_s: float) -> Project:
    """Change the time of a key; two keys cannot have the same time."""
    key = _key(project, light, number)
    at_s = round(round(max(float(at_s), 0.0) / STEP_S) * STEP_S, 6)
    others = [each for k, each in enumerate(light_of(project, light).keyframes) if k != number]
    if any(abs(each.at_s - at_s) <= 0.5 * STEP_S for each in others):
        raise ProjectError(f"there is a key at {at_s:g} s already; move or remove it first")
    return _with_keys(project, light, [*others, key.replace(at_s=at_s)])


def remove_key(project: Project, light: int, number: int) -> Project:
    """Remove a key."""
    gone = _key(project, light, number)
    return _with_keys(project, light, [key for key in light_of(project, light).keyframes if key is not gone])


def clear_keys(project: Project, light: int) -> Project:
    """Remove the whole path; the light stays where it is."""
    light_of(project, light)
    return _with_keys(project, light, [])


def _key(project: Project, light: int, number: int) -> LightKey:
    keys = light_of(project, light).keyframes
    if not 0 <= number < len(keys):
        raise ProjectError(f"there is no key {number}; the path has {len(keys)}")
    return keys[number]


def _with_keys(project: Project, light: int, keys: list[LightKey]) -> Project:
    lights = list(project.lights)
    lights[light] = lights[light].replace(keyframes=tuple(sorted(keys, key=lambda key: key.at_s)))
    return project.replace(lights=tuple(lights))
