"""Flarewright: lens flare as physics."""

from ._version import __version__ as __version__
