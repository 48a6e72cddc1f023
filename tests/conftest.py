"""Common ground of all tests: helpers importable by name, and compiled kernels that fit the sources."""

import hashlib
import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / part) for part in ("physics", "design", "measure", "predict")]

# Numba notices a changed kernel but not a changed kernel that it calls, so the cache is named after all their sources
_sources = sorted((HERE.parent / "src" / "flarewright" / "kernels").glob("*.py"))
_digest = hashlib.sha256(b"".join(path.read_bytes() for path in _sources)).hexdigest()[:16]
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / f"flarewright-kernels-{_digest}"))
