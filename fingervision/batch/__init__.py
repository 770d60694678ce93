"""Batch processing of many recordings or tables, on the cores of this computer or on an existing Dask cluster.

Each input has a result folder of its own. `fingervision.batch.measure` and `fingervision.batch.diagnose` are the
commands `batch measure` and `batch diagnose`; both run the single command on each input, so that they stand beside it.
"""

from importlib import import_module
from typing import Any

__all__ = ["diagnose", "measure"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=import_module(__name__))
    return getattr(import_module("fingervision.cli._batch_calls"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
