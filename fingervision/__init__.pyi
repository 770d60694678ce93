"""Types of the public names, which `__init__.py` imports when they are first asked for."""

from fingervision.domain.errors import ArgumentError as ArgumentError
from fingervision.domain.errors import DataError as DataError
from fingervision.domain.errors import FingervisionError as FingervisionError
from fingervision.domain.errors import OutputError as OutputError
from fingervision.domain.errors import UsageError as UsageError
from fingervision.domain.parameter import Parameter as Parameter
from fingervision.interface.measure import measure as measure
from fingervision.interface.measurement import Measurement as Measurement

__version__: str
