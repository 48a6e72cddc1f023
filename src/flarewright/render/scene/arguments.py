"""Arguments of `render`: a project or a lens, with settings that correspond to the flags of the command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from inspect import Parameter, signature
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, ParamSpec, TypedDict, TypeVar, Unpack

from pydantic import ValidationError

from ...errors import ProjectError
from ...model import Lens, Project, Quality
from ...sentences import record_sentences, summary

if TYPE_CHECKING:
    from ...model import (  # fmt: skip
        Art,
        Backplate,
        Camera,
        Coating,
        CoatingChoice,
        Design,
        Dirt,
        Holdout,
        Imperfection,
        Iris,
        Light,
        Output,
        Plate,
        ProjectCurve,
        Scatter,
        Starburst,
        Timeline,
    )


class _AsInProject:
    """Default of a setting in a signature."""

    def __repr__(self) -> str:
        return "<as in the project>"


P = ParamSpec("P")
R = TypeVar("R")


class Settings(TypedDict, total=False):
    """The fields of a project except its lens; `coating` and `quality` can also be texts of the command line."""

    f_number: float | None
    iris: Iris | None
    coating: str | PathLike[str] | Coating | CoatingChoice | None
    lights: Sequence[Light]
    camera: Camera
    quality: Quality | str
    output: Output
    dirt: Dirt
    starburst: Starburst
    zoom: str | float | None
    filter: Plate | None
    imperfection: Imperfection | None
    scatter: Scatter | None
    holdout: Holdout | None
    art: Art
    design: Design | None
    curves: Sequence[ProjectCurve]
    timeline: Timeline
    plate: Backplate | None


def project_of(given: Project | Lens | str | PathLike[str], **settings: Unpack[Settings]) -> Project:
    """Return a project with some settings changed, or a new project for a lens.

    Parameters
    ----------
    given : Project, Lens, str or path
        A project; or a prescription, the name of a shipped lens, or a lens file, which gets a project of `settings`.
    **settings : Settings
        Fields of the project; they override those of `given`.

    Raises
    ------
    ProjectError
        A setting is invalid, or a lens is given without lights.
    """
    if isinstance(given, Project) and not settings:
        return given
    fields: dict[str, Any] = {**settings}
    if isinstance(given, Project):
        fields = {**{name: getattr(given, name) for name in Project.model_fields}, **fields}
    else:
        fields["lens"] = given if isinstance(given, Lens) else fspath(given)
        if "lights" not in fields:
            raise ProjectError("no light is given; say where it is: lights=[Light(field_deg=(10, 5))] (degrees)")
    if "coating" in settings:
        from ...io.lens.coating_text import coating_choice

        fields["coating"] = coating_choice(settings["coating"])
    if isinstance(word := fields.get("quality"), str):
        # as --quality does, it keeps the other settings
        fields["quality"] = (given.quality if isinstance(given, Project) else Quality()).replace(mode=word)
    try:
        return Project.model_validate(fields)
    except ValidationError as error:
        findings = record_sentences(error, Project, fields)
        raise ProjectError(summary("the project", findings), tuple(findings)) from None


def naming_settings(function: Callable[P, R]) -> Callable[P, R]:
    """Add the fields of `Settings` to a function's signature, for help texts and completion."""
    plain = signature(function)
    named = [one for one in plain.parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
    named += [
        Parameter(name, Parameter.KEYWORD_ONLY, default=_AsInProject(), annotation=annotation.__forward_arg__)
        for name, annotation in Settings.__annotations__.items()
    ]
    # `inspect.signature` reads this attribute
    function.__signature__ = plain.replace(parameters=named)  # type: ignore[attr-defined]
    return function
