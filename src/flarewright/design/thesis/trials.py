"""The tests of Van Acoleyen 2025, chapter 6: their list, the thesis' results, and the measures for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..coatings.colors import Kind
from ..problem.grey_picture import GAIN

Name = Literal["heliar", "canon", "scratch"]


@dataclass(frozen=True)
class Case:
    """A lens of the thesis and its settings in the thesis' program.

    Attributes
    ----------
    lens : str
        Shipped name.
    stop_diameter : float
        mm.
    blades : int
    gain : float
        For `grey_picture.grey_picture`. The thesis does not state the light's intensity; this value makes a black
        picture differ from the target by the PSNR in the thesis.
    coatings_nm : dict of int to float
        Centre wavelengths in the thesis' program by row; 550 elsewhere.
    """

    lens: str
    stop_diameter: float
    blades: int
    gain: float
    coatings_nm: dict[int, float]


CASES = {
    "heliar": Case(
        "heliar-tronnier", 4.5, 6, GAIN,
        {0: 430.0, 1: 370.0, 2: 510.0, 3: 600.0, 4: 310.0, 6: 550.0, 7: 580.0, 8: 650.0},
    ),
    "canon": Case("canon-28-80", 10.5, 8, 0.76, {}),
}  # fmt: skip


@dataclass(frozen=True)
class Thesis:
    """Best run of the thesis: PSNR in dB, and where reported SSIM and seconds on eight cores."""

    psnr_db: float
    ssim: float | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Measure:
    """A number for comparing runs.

    Attributes
    ----------
    key : str
        Attribute of the run; with `along`, also of the points of its trace.
    title : str
    best : {"min", "max"}
    along : bool
        Whether it is drawn against time.
    """

    key: str
    title: str
    best: Literal["min", "max"]
    along: bool


_LENS = (
    Measure("fitness_algorithm1", "Algorithm 1", "min", True), Measure("fitness", "fitness mm²", "min", True),
    Measure("psnr_db", "PSNR dB", "max", False), Measure("ssim", "SSIM", "max", False),
)  # fmt: skip
_COLORS = (Measure("fitness_algorithm2", "Algorithm 2", "min", True), Measure("psnr_db", "PSNR dB", "max", False))


@dataclass(frozen=True)
class Trial:
    """One test.

    Attributes
    ----------
    name : {"heliar", "canon", "scratch"}
        Lens whose ghosts or colours are the targets; scratch: random ghosts.
    angle_deg : float
        Yaw and pitch of the light source.
    ghosts : int
        Number of random ghosts.
    films : {"quarter-wave", "film"} or None
        Search coatings of this kind; None: search the lens.
    layers : int
        Largest number of free films on a surface.
    unsigned : bool
        Neither signs nor brightness, as in the thesis.
    fresnel : bool
        The irradiance of uncoated surfaces is known as well.
    """

    name: Name
    angle_deg: float = 5.45
    ghosts: int = 5
    films: Kind | None = None
    layers: int = 1
    unsigned: bool = False
    fresnel: bool = False

    @property
    def title(self) -> str:
        """The test in words."""
        what = f"{self.ghosts} ghosts from scratch" if self.name == "scratch" else self.name
        if self.films is not None:
            free = "one free film" if self.layers == 1 else f"up to {self.layers} free films"
            what += f", coatings of {'quarter waves' if self.films == 'quarter-wave' else free}"
        return f"{what}, {self.angle_deg:g} degrees"

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Measures for comparing runs."""
        return _LENS if self.films is None else _COLORS

    @property
    def thesis(self) -> Thesis | None:
        """The thesis' result of this test."""
        return _REACHED.get(self._key)

    @property
    def figures(self) -> tuple[str, str]:
        """The thesis' figures: fitness against time, and the picture; "-" for none."""
        return _FIGURES.get(self._key, ("-", "-"))

    @property
    def _key(self) -> tuple[str, float, str]:
        if self.name == "scratch":
            return "scratch", float(self.ghosts), ""
        return self.name, self.angle_deg, "" if self.films is None else f"{self.films}:{self.layers}"


_REACHED = {
    ("heliar", 5.45, ""): Thesis(25.89, 0.9146, 600.0),
    ("heliar", 13.40, ""): Thesis(30.38, 0.8512, 600.0),
    ("canon", 5.45, ""): Thesis(27.20, 0.8898, 3600.0),
    ("heliar", 5.45, "quarter-wave:1"): Thesis(31.82),
    ("canon", 5.45, "quarter-wave:1"): Thesis(24.44),
    ("heliar", 5.45, "film:1"): Thesis(31.64),
    ("scratch", 5.0, ""): Thesis(34.85, 0.9582),
    ("scratch", 10.0, ""): Thesis(26.08, 0.8798),
    ("scratch", 15.0, ""): Thesis(23.77, 0.8185),
}

_FIGURES = {
    ("heliar", 5.45, ""): ("6.1", "6.3"),
    ("heliar", 13.40, ""): ("6.2", "6.4"),
    ("canon", 5.45, ""): ("6.6", "6.7"),
    ("heliar", 5.45, "quarter-wave:1"): ("6.8", "6.10"),
    ("canon", 5.45, "quarter-wave:1"): ("6.9", "6.11"),
    ("heliar", 5.45, "film:1"): ("6.12", "6.13"),
    ("scratch", 5.0, ""): ("-", "6.14"),
    ("scratch", 10.0, ""): ("-", "6.15"),
    ("scratch", 15.0, ""): ("-", "6.16"),
}


def figures_shown(trial: Trial, solvers: tuple[str, ...]) -> tuple[str, str]:
    """Return which figures of the thesis runs of these solvers show.

    Parameters
    ----------
    trial : Trial
    solvers : tuple of str
        The texts that the user gave, like "pso:15x15".

    Returns
    -------
    tuple of str
        Fitness against time, and the picture; "-" for none. Several sizes of one algorithm are figure 6.5 at 13.40
        degrees. Several sizes with one large population beside islands are 6.17 and 6.18, which compare these, and
        processors.
    """
    figures = trial.figures
    parts = [solver.partition(":") for solver in solvers]
    if trial.films is not None or len(parts) < 2 or len({name for name, _, _ in parts}) > 1:
        return figures
    if (trial.name, trial.angle_deg) == ("heliar", 13.40):
        return "6.5", figures[1]
    single = any(size.startswith("1x") for _, _, size in parts) and any(not size.startswith("1x") for *_, size in parts)
    if single and trial.name != "scratch":
        return "6.17" if trial.name == "heliar" else "6.18", figures[1]
    return figures
