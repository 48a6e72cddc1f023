"""The outcome of one hostile input."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """Whether the program kept its promises on one input.

    Attributes
    ----------
    kind : str
        The fuzzer.
    subject : str
        The input, in short.
    held : bool
    remark : str
        What the program answered, or what was wrong.
    """

    kind: str
    subject: str
    held: bool
    remark: str

    @property
    def skipped(self) -> bool:
        """Whether this machine lacks something that the input needs; the remark begins with the word."""
        return self.held and self.remark.startswith("skipped: ")
