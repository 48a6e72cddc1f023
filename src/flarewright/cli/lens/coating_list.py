"""`flarewright coating list`: the standard coatings."""

from __future__ import annotations

from typing import Any

from ..common import console, print_json
from ..shared_options import Json

EPILOG = "Use one with: flarewright render takumar-50-f1.4 --light -9,5 --coating modern-broadband -o flare.exr"


def listing(as_json: Json = False) -> None:
    """List the standard coatings: era, films, mean reflectance over 420 to 680 nm on three glasses, source."""
    from ...model import Standard
    from ...optics.coatings.presets import STANDARD_COATINGS
    from ...optics.coatings.response import coating_response

    glasses = (1.52, 1.65, 1.80)
    found: list[dict[str, Any]] = []
    for known in STANDARD_COATINGS:
        responses = [coating_response(Standard(name=known.name), n, n, 0.0) for n in glasses]
        found.append(
            {
                "name": known.name,
                "era": known.era,
                "design": known.design,
                "source": known.source,
                "on_glass": [
                    {
                        "n": n,
                        "mean_reflectance": float(response.mean_reflectance[0]),
                        "films": [{"index": f.index, "thickness_nm": f.thickness_nm} for f in response.films],
                    }
                    for n, response in zip(glasses, responses, strict=True)
                ],
            }
        )
    if as_json:
        print_json({"coatings": found})
        return
    from rich.table import Table

    out = Table(
        caption="Mean reflectance of one surface over 420 to 680 nm at normal incidence, by index of the glass."
    )
    out.add_column("name", no_wrap=True)
    out.add_column("era")
    for n in glasses:
        out.add_column(f"{n:.2f}", justify="right", no_wrap=True)
    out.add_column("films, from air")
    for row in found:
        means = (f"{100.0 * glass['mean_reflectance']:.2f} %" for glass in row["on_glass"])
        out.add_row(row["name"], row["era"], *means, row["design"])
    console().print(out)
