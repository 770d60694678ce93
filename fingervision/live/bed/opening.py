"""Open a test bed by name, with its camera as the live source."""

from dataclasses import replace

from fingervision.domain.errors import FingervisionError
from fingervision.live.bed.bench import Bench
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.simulation.parse_injected_effects import hidden_from


def opened_bed(name: str, hide: tuple[str, ...], choices: Choices) -> tuple[Capture, Choices]:
    """Open a test bed; a simulated test bed runs in real time.

    Parameters
    ----------
    name : str
        The word "simulated", or the path of a configuration file.
    hide : tuple of str
        Effects injected into the simulated parts of the test bed.
    choices : Choices
        Settings chosen by the user; without a given scale and height, those of the test bed apply.

    Raises
    ------
    DataError, InputFileError, UsageError
        The test bed cannot be opened, or has neither camera nor scale.
    """
    hidden = hidden_from(hide)
    bed = open_bed(name, hidden, pace=1.0)
    try:
        bench = Bench(bed, hidden)
    except FingervisionError:
        bed.close()
        raise
    chosen = replace(choices, scale=bed.scale, scale_file=None, below_tip_mm=bed.below_tip_mm)
    return Capture(bench, again=None), chosen
