"""Types of the public names, which `__init__.py` imports when they are first asked for."""

from fingervision import batch as batch
from fingervision.batch.run import Batch as Batch
from fingervision.domain.errors import ArgumentError as ArgumentError
from fingervision.domain.errors import ArgumentTypeError as ArgumentTypeError
from fingervision.domain.errors import DataError as DataError
from fingervision.domain.errors import DeviceError as DeviceError
from fingervision.domain.errors import FingervisionError as FingervisionError
from fingervision.domain.errors import InputFileError as InputFileError
from fingervision.domain.errors import InstallationError as InstallationError
from fingervision.domain.errors import LimitError as LimitError
from fingervision.domain.errors import MissingLibraryError as MissingLibraryError
from fingervision.domain.errors import ModelError as ModelError
from fingervision.domain.errors import NoCalibrationError as NoCalibrationError
from fingervision.domain.errors import OutputError as OutputError
from fingervision.domain.errors import ProcessError as ProcessError
from fingervision.domain.errors import StateError as StateError
from fingervision.domain.errors import UnknownNameError as UnknownNameError
from fingervision.domain.errors import UsageError as UsageError
from fingervision.domain.frame import Coding as Coding
from fingervision.domain.frame import Frame as Frame
from fingervision.domain.frame import LostFrame as LostFrame
from fingervision.domain.parameter import Parameter as Parameter
from fingervision.domain.status import Status as Status
from fingervision.effects.effect_list import EffectList
from fingervision.effects.trial import EffectAnswerError as EffectAnswerError
from fingervision.frames.source import Description as Description
from fingervision.frames.source import FrameSource as FrameSource
from fingervision.interface.bed import OpenBed as OpenBed
from fingervision.interface.bed import bed as bed
from fingervision.interface.calibrate import calibrate as calibrate
from fingervision.interface.calibration import Calibration as Calibration
from fingervision.interface.comparison import Comparison as Comparison
from fingervision.interface.comparison import compare as compare
from fingervision.interface.diagnosis import Diagnosis as Diagnosis
from fingervision.interface.diagnosis import diagnose as diagnose
from fingervision.interface.examples import example as example
from fingervision.interface.healthy_reference import Changes as Changes
from fingervision.interface.healthy_reference import changes_since as changes_since
from fingervision.interface.inspection import Inspection as Inspection
from fingervision.interface.inspection import inspect as inspect
from fingervision.interface.measure import measure as measure
from fingervision.interface.measurement import Measurement as Measurement
from fingervision.interface.own_effect import effect as effect
from fingervision.interface.prediction import Prediction as Prediction
from fingervision.interface.prediction import model as model
from fingervision.interface.simulation import Simulation as Simulation
from fingervision.interface.simulation import simulate as simulate
from fingervision.interface.tables import read_model as read_model
from fingervision.interface.tables import read_table as read_table
from fingervision.plugins.faults import MisfitError as MisfitError
from fingervision.plugins.faults import PluginError as PluginError
from fingervision.plugins.faults import PluginImportError as PluginImportError
from fingervision.plugins.faults import PluginNameError as PluginNameError
from fingervision.plugins.faults import PluginShapeError as PluginShapeError
from fingervision.plugins.faults import PluginTimeoutError as PluginTimeoutError
from fingervision.plugins.faults import PluginVersionError as PluginVersionError
from fingervision.tables.questions import OpenQuestionError as OpenQuestionError
from fingervision.testbed.run.recipe_run import RunDone as RunDone

__version__: str
effects: EffectList
