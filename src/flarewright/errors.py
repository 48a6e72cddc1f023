"""What Flarewright says when a person's input cannot be used.

Every message is one sentence that tells what is wrong, where, and what to do about it.
The command line prints it and ends with exit code 2; a library user catches `FlarewrightError`.
"""


class FlarewrightError(Exception):
    """A mistake in what a person gave; the message says what, where, and the remedy.

    Parameters
    ----------
    message : str
        One sentence for a person.
    problems : tuple of str, optional
        Every single finding, each with its row, when there are several.
    """

    def __init__(self, message: str, problems: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.problems = problems


class LensError(FlarewrightError):
    """A lens file that cannot be read or is no camera lens."""


class GlassError(FlarewrightError):
    """A glass that no catalogue knows, or a wavelength it is not known for."""


class ProjectError(FlarewrightError):
    """A project file or a combination of options that cannot be rendered."""


class OutputError(FlarewrightError):
    """A file that could not be written; nothing was left half-written."""
