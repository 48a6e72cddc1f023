"""Keep Dask's log and warnings from stderr."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from ...errors import optional

# loggers of Dask, of which each writes to stderr
_LOGGERS = ("distributed", "distributed.client", "distributed.gc", "tornado", "tornado.application", "bokeh", "asyncio")


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Dask's log and warnings from stderr inside the block: its incidents become sentences of ours."""
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    levels = [logger.level for logger in loggers]
    # the import sets other levels
    optional("distributed", "cluster", "--cluster")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"(distributed|dask|dask_jobqueue|tornado)(\.|$)")
        warnings.filterwarnings("ignore", message=r"\s*Sending large graph")
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        try:
            yield
        finally:
            for logger, level in zip(loggers, levels, strict=True):
                logger.setLevel(level)
