"""Predict how the flare of two lenses grows and falls as the light moves away from the axis.

Usage: python flare_curves.py
"""

import flarewright as fw
from flarewright.predict import Wanted
from flarewright.workflow import flare_curves


def main() -> None:
    """Print the mean flare of a bare and of a coated lens at some light angles."""
    light = fw.Light(field_deg=(0.0, 0.0))
    for name, coating in (("bare", fw.AsLens()), ("coated", fw.Everywhere(coating=fw.Standard(name="single-1950s")))):
        project = fw.Project(lens="tessar-brendel", f_number=5.6, lights=(light,), coating=coating)
        curves = flare_curves(project, Wanted(to_deg=20.0, samples=9, checks=0), quality="draft").curves
        means = (f"{angle:g} degrees {curves.at(angle).mean:.2e}" for angle in (0.0, 5.0, 10.0, 20.0))
        print(f"{name}: mean of the flare over the light's irradiance: {', '.join(means)}")


if __name__ == "__main__":
    main()
