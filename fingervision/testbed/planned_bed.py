"""A test bed as needed for checking a recipe: limits, model, camera and possible motions, without opening hardware."""

from dataclasses import dataclass

from fingervision.domain.model import Model
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import MoveCheck
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import (
    PARTS,
    gripper_model,
    limits_within,
    open_bed,
    read_configuration,
    stated_limits,
    stated_scale,
)
from fingervision.testbed.device_kinds import PluggedKind, kind_of
from fingervision.testbed.motion.move_limits import SoftLimits

CAMERA_PX, CAMERA_HZ = (640, 480), 25.0
"""Size and frame rate of a camera whose section states none: those of the published test bed."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedBed:
    """The test bed against which a recipe is checked.

    Parameters
    ----------
    name : str
        Name of the test bed.
    limits : SoftLimits
        Soft limits of position, speed, force and gap.
    actuator : MoveCheck
        Motions that the stage can make.
    model : Model or None
        Model of the gripper: gap and force at each position.
    rate_hz : float
        Frames per second.
    size_px : (int, int)
        Width and height of the pictures.
    px_per_mm : float or None
        Scale of the camera; None if the configuration states none.
    is_simulated : bool
        Whether every part is simulated.
    plugged : tuple of str
        Devices (`actuator`, `force_sensor`, `camera`) whose kind is a file or comes from another distribution.
    """

    name: str
    limits: SoftLimits
    actuator: MoveCheck
    model: Model | None
    rate_hz: float
    size_px: tuple[int, int]
    px_per_mm: float | None
    is_simulated: bool
    plugged: tuple[str, ...] = ()

    @property
    def view_mm(self) -> float:
        """Width of the camera's view (mm); infinite if the scale is unknown."""
        return float("inf") if self.px_per_mm is None else self.size_px[0] / self.px_per_mm


def planned_bed(name: str) -> PlannedBed:
    """Read a test bed's configuration for planning; hardware is neither opened nor moved.

    Parameters
    ----------
    name : str
        `simulated`, or the path of a configuration file.

    Raises
    ------
    DataError, InputFileError, UsageError
        The configuration is not valid, or its kind of actuator does not state its limits without hardware.
    """
    top = read_configuration(name)
    sections = {part: top.table(part) for part in PARTS if part in top.values}
    if "actuator" not in sections:
        top.refuse(None, "must have an [actuator], but has none: add it with its kind.")
    kinds = {part: kind_of(part, section) for part, section in sections.items()}
    plugged = tuple(part for part, kind in kinds.items() if isinstance(kind, PluggedKind))
    if all(kind.SIMULATED for kind in kinds.values()):
        bed = open_bed(name)
        try:
            return _of(bed, top, plugged)
        finally:
            bed.close()
    folder, kind = top.path.parent, kinds["actuator"]
    describe = getattr(kind, "without_hardware", None)
    if describe is None:
        sections["actuator"].refuse(
            "kind",
            "must state its limits without its hardware, but has no function without_hardware(section, folder): add "
            "this function to its file, or let `bed run` check the recipe at its start.",
        )
    actuator: MoveCheck = describe(sections["actuator"], folder)
    scale = stated_scale(top.table("scale"), folder)
    camera = sections.get("camera", top.table("camera"))
    return PlannedBed(
        name=name,
        limits=limits_within(stated_limits(top.table("limits")), actuator.limits, top.table("limits")),
        actuator=actuator,
        model=gripper_model(top.table("gripper"), folder) if "gripper" in top.values else None,
        rate_hz=camera.number("rate_hz", CAMERA_HZ, above=0.0),
        size_px=(
            camera.whole("width_px", CAMERA_PX[0], low=16, high=16384),
            camera.whole("height_px", CAMERA_PX[1], low=16, high=16384),
        ),
        px_per_mm=None if scale is None else scale.px_per_mm,
        is_simulated=False,
        plugged=plugged,
    )


def _of(bed: Bed, top: Section, plugged: tuple[str, ...]) -> PlannedBed:
    if bed.camera is None:
        top.refuse(None, "must have a [camera], but has none: add it with its kind.")
    described = bed.camera.description
    return PlannedBed(
        name=str(bed.about["name"]),
        limits=bed.limits,
        actuator=bed.actuator,
        model=bed.model,
        rate_hz=described.rate_hz or CAMERA_HZ,
        size_px=(described.width_px, described.height_px),
        px_per_mm=None if bed.scale is None else bed.scale.px_per_mm,
        is_simulated=True,
        plugged=plugged,
    )
