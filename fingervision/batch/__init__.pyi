"""Types of the two functions, which `__init__.py` imports when they are first asked for."""

from fingervision.cli._batch_list import diagnose as diagnose
from fingervision.cli._batch_list import measure as measure
