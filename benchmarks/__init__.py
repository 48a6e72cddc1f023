"""Benchmarks of Flarewright: `python -m benchmarks`."""

# as the commands do, before NumPy is imported: a second thread of linear algebra waits in a busy loop, and its waiting
# would count as work
import flarewright.cli  # noqa: F401
