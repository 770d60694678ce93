"""Types of the two functions, which `__init__.py` imports when they are first asked for."""

from fingervision.cli._batch_calls import diagnose as diagnose
from fingervision.cli._batch_calls import measure as measure
