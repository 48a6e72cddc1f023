"""Command words of CODE V's sequence files; `codev` reads the lens, `codev_zoom` its zoom positions."""

from __future__ import annotations

FIELDS = ("XAN", "YAN", "XIM", "YIM", "XRI", "YRI", "XOB", "YOB")
"""Columns of field points."""

VIGNETTING = ("VUX", "VLX", "VUY", "VLY")
"""Vignetting factors, one a field."""

IDLE = frozenset({
    "LEN", "GO", "INI", "WTW", "WTF", "CCY", "CCX", "THC", "KC", "GLC", "SLB", "PIM", "CUM", "THM", "UMY", "UCY",
    "HMY", "PIK", "TEM", "PRE", "CA", "SPH", "IC", "DEL", "CUF", "RDF", "FRZ", "WAV", "DER", "END", "NOR", "GL1", "GL2",
    "MTH", "CLS", "CRA", "POL", "TOL", "DLT", "DLN", "DLR", "DLF", "TIR", "COM", "AFI", "AC", "BC", "CC", "DC", "EC",
    "FC", "GC", "HC", "JC", "PUY", "PUX",
})  # fmt: skip
"""Codes and targets of optimization, weights, labels, dates, solves that state their result, tolerances."""

UNSUPPORTED = frozenset({
    "ADE", "BDE", "CDE", "XDE", "YDE", "ZDE", "ALP", "BET", "GAM", "INC", "SPS", "CYL", "XTO", "YTO", "AAS", "GRT",
    "DIF", "FRE", "HOE", "GRX", "ARR", "UDS", "ZRN", "SPL", "BEN", "DAR", "REV", "RET", "GLB", "NSS", "CUX", "RDX",
})  # fmt: skip
"""What tilts, shifts or shapes a surface, or makes it no refracting one."""

IN_ITS_LINE = frozenset({"RDY", "CUY", "THI", "GLA", "RMD"})
"""What the line S of a surface states."""

SHIFTS = frozenset({"ADE", "BDE", "CDE", "XDE", "YDE", "ZDE", "ALP", "BET", "GAM", "CUX", "RDX"})
"""Those of `UNSUPPORTED` that 0 makes idle."""
