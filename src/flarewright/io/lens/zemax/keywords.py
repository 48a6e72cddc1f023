"""Keywords of `.zmx` files: those that the reader uses, and those without effect on a ghost.

`reader` names every other keyword in a remark; `configurations` reads the rows of the table of configurations.
Source: the files of makers and vendors, and the OpticStudio help.
"""

from __future__ import annotations

TEXTS = frozenset({"NAME", "NOTE", "COMM", "COAT", "SLAB", "PFIL", "COFN", "DBDT"})
"""Their words are text, so a comma in it is no decimal comma."""

USED = frozenset({
    "MODE", "NAME", "NOTE", "UNIT", "GCAT", "FNUM", "ENPD", "FLOA", "OBNA", "FTYP", "XFLN", "YFLN", "XFLD", "YFLD",
    "WAVM", "WAVL", "WAVN", "PWAV", "ENVD", "MNUM",
})  # fmt: skip

VIGNETTING = ("VDXN", "VDYN", "VCXN", "VCYN", "VANN")
"""Vignetting factors of the fields; without effect when all are 0."""

HARMLESS = frozenset({
    # version, display, ray aiming, sampling and weights of its analyses, settings of non-sequential parts, stock number
    "VERS", "PFIL", "LANG", "PICB", "SDMA", "OMMA", "HYPR", "ROPD", "RAIM", "FWGN", "FWGT", "WWGT", "WWGN", "POLS",
    "GLRS", "GSTD", "NSCD", "COFN", "GFAC", "DBDT", "PUSH",
    # tolerances, and rows of the table of configurations, which `configurations` reads
    "TOL", "MOFF", "BLNK", "SDIA", "THIC", "CRVT", "CONN", "PRAM", "YFIE", "XFIE", "STPS", "APER", "MCOM",
    *VIGNETTING,
})  # fmt: skip

IDLE_OPERANDS = frozenset({"MOFF", "BLNK", "MCOM", "FLWT", "WLWT", "FVDX", "FVDY", "FVCX", "FVCY", "FVAN", "SATP"})
"""Rows of the table of configurations without effect on a ghost: comments, weights, vignetting factors."""

RIM_OPERANDS = frozenset({"SDIA", "APMN", "APMX", "APTP", "APDX", "APDY", "CHZN", "MCSD"})
"""Rows of that table that change rims; a remark names their surfaces."""

USED_OF_SURFACE = frozenset({
    "TYPE", "CURV", "CONI", "PARM", "XDAT", "DISZ", "GLAS", "DIAM", "CLAP", "FLAP", "COAT", "STOP",
})  # fmt: skip

_NOT_ROUND = ("SQAP", "ELAP", "UDAA", "UDAP", "SPID", "OBSC", "SQOB", "ELOB", "UDOB")

HARMLESS_OF_SURFACE = frozenset({
    # names and drawing, mechanical rims, settings of physical optics, substrate of mirrors
    "COMM", "SLAB", "HIDE", "FIMP", "POPS", "MIRR", "MEMA", "OEMA", "MAZH", "FLOA",
    # in `APERTURES`
    "OBDC", *_NOT_ROUND,
})  # fmt: skip

APERTURES = (
    (_NOT_ROUND, "apertures that are not round are treated as round"),
    (("OBDC",), "decentred apertures are treated as centred"),
    (("CLAP", "FLAP"), "annular apertures are treated as open in the middle"),
)
"""Keywords of apertures that the reader simplifies, and the remark."""
