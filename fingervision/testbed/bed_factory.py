"""Build a test bed from its configuration."""

import re
from collections.abc import Collection
from contextlib import ExitStack, closing
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any, cast

from calib.calibration import BareScale
from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model
from fingervision.measuring.scale import Scale
from fingervision.models.answer_figures import Physics
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import REGISTRY, GripperModel, build_model, kinds
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.drive_csv import SAMPLE_COLUMNS
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.toml_section import Section, read_section
from fingervision.tables.read import read_simulation_table
from fingervision.testbed.actuator import Actuator, StageLimits
from fingervision.testbed.bed import Bed
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.clocks.clock import Clock, HostClock, VirtualClock
from fingervision.testbed.device_kinds import Kind, kind_of
from fingervision.testbed.force_sensor import ForceSensor
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.simulation.gripper import Followed, SimulatedGripper, sample_gripper
from fingervision.testbed.simulation.injected_effects import NOTHING, Hidden
from fingervision.testbed.text_protocol import sensor
from fingervision.testbed.text_protocol.sensor import TextSensor, opened_sensor

SIMULATED = "simulated"
SCHEMA = 1
NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
PARTS = ("actuator", "force_sensor", "camera")
TOP_KEYS = ("name", "seed", "below_tip_mm", *PARTS, "channel", "gripper", "limits", "scale")


def open_bed(
    name: str,
    hidden: Hidden = NOTHING,
    *,
    pace: float = 0.0,
    seed: int | None = None,
    earlier_s: tuple[float, float] | None = None,
) -> Bed:
    """Build a test bed and open its parts.

    Parameters
    ----------
    name : str
        `simulated`, or a configuration file (its format is in README.md).
    hidden : Hidden
        Effects that act in the simulated parts.
    pace : float
        Seconds of a completely simulated test bed per second of the computer; 0 is as fast as possible.
    seed : int, optional
        Seed of everything random in the simulated parts; by default that of the configuration.
    earlier_s : (float, float), optional
        First and last time of the earlier runs that this run continues on a completely simulated test bed. Warming and
        drift started at the first time, and continue from the last time.

    Raises
    ------
    DataError, InputFileError, UsageError
        The configuration is not valid, or a part cannot be opened; parts that are already open are closed.
    """
    top, sections, parts = stated_parts(name)
    all_simulated = all(kind.SIMULATED for kind in parts.values())
    has_gripper = "gripper" in top.values
    if hidden.effects and not has_gripper:
        raise UsageError(f"--hide adds an effect to a simulated gripper, but {name} has no [gripper]: add one.")
    clock: Clock = VirtualClock(pace, earlier_s[1] if earlier_s else 0.0) if all_simulated else HostClock()
    context = BuildContext(
        clock=clock,
        folder=top.path.parent,
        seed=top.whole("seed", 1, low=0) if seed is None else seed,
        hidden=hidden,
        limits=stated_limits(top.table("limits")),
        scale=stated_scale(top.table("scale"), top.path.parent),
        below_tip_mm=top.number("below_tip_mm", 0.3, above=0.0),
        since_s=earlier_s[0] if earlier_s else None,
    )
    model = gripper_model(top.table("gripper"), top.path.parent) if has_gripper else None
    return _built(top, sections, parts, context, model, replays=all_simulated)


def _built(
    top: Section,
    sections: dict[str, Section],
    parts: dict[str, Kind],
    context: BuildContext,
    model: Model | None,
    *,
    replays: bool,
) -> Bed:
    with ExitStack() as opened:

        def build(part: str) -> Any:
            return opened.enter_context(closing(parts[part].build(sections[part], context)))

        actuator: Actuator = build("actuator")
        limits = limits_within(context.limits, actuator.limits, top.table("limits"))
        if model is not None:
            if context.motion is None:
                followed = Followed(actuator)
                actuator, context.motion = cast("Actuator", followed), followed.motion
            context.gripper = SimulatedGripper(model, context.motion, context.hidden, context.play_mm, context.since_s)
        force: ForceSensor | None = build("force_sensor") if "force_sensor" in parts else None
        camera: BedCamera | None = build("camera") if "camera" in parts else None
        channels: dict[str, TextSensor] = {}
        for section in top.tables("channel"):
            name = channel_name(section, channels)
            channels[name] = opened.enter_context(closing(opened_sensor(section, context)))
        opened.pop_all()
    return Bed(
        clock=context.clock,
        actuator=actuator,
        limits=limits,
        force_sensor=force,
        camera=camera,
        scale=context.scale,
        below_tip_mm=context.below_tip_mm,
        model=model,
        replays=replays,
        about={
            "name": top.word("name", top.path.stem),
            "configuration": top.text,
            "seed": context.seed,
            "actuator": actuator.name,
            "force_sensor": None if force is None else force.name,
            "camera": None if camera is None else camera.description.name,
            **({"channels": {name: channel.name for name, channel in channels.items()}} if channels else {}),
        },
        channels=channels,
    )


def channel_name(section: Section, known: Collection[str]) -> str:
    """Read the name of a channel, which becomes a column of samples.csv."""
    section.only(("name", "kind", *sensor.KEYS))
    section.word("kind", "serial_text", of=("serial_text",))
    name = section.word("name")
    if not NAME.fullmatch(name) or name in (*SAMPLE_COLUMNS.split(","), *known):
        section.refuse("name", f"must be letters, digits and _, and no other column's name, but is {name!r}.")
    return name


def stated_parts(name: str) -> tuple[Section, dict[str, Section], dict[str, Kind]]:
    """Read the configuration of a test bed: the whole, and the section and kind of each of its devices."""
    top = read_configuration(name)
    sections = {part: top.table(part) for part in PARTS if part in top.values}
    if "actuator" not in sections:
        top.refuse(None, "must have an [actuator], but has none: add it with its kind.")
    return top, sections, {part: kind_of(part, section) for part, section in sections.items()}


def read_configuration(name: str) -> Section:
    """Read the configuration of a test bed, without opening anything.

    Raises
    ------
    DataError, InputFileError, UsageError
        The file does not exist, or does not describe a test bed.
    """
    if name == SIMULATED:
        with resources.as_file(resources.files("fingervision.testbed").joinpath("simulated.toml")) as path:
            return read_section(path, "bed", TOP_KEYS, SCHEMA)
    path = Path(name)
    if path.suffix.lower() != ".toml":
        raise UsageError(f"--bed must be the word simulated or a file CONFIG.toml, but is {name}.")
    return read_section(path, "bed", TOP_KEYS, SCHEMA)


def stated_limits(section: Section) -> SoftLimits:
    """Read the soft limits that a configuration states."""
    limits = section.record(SoftLimits)
    if "upper_mm" in section.values:
        section.number("upper_mm", above=limits.lower_mm)
    return limits


def limits_within(limits: SoftLimits, able: StageLimits, section: Section) -> SoftLimits:
    """Narrow the test bed's limits to those of its actuator."""
    within = limits.within(able)
    if not within.lower_mm < within.upper_mm:
        section.refuse(
            None,
            f"must overlap the range of the actuator, but the actuator moves from {able.lower_mm:g} to "
            f"{able.upper_mm:g} mm.",
        )
    return within


def stated_scale(section: Section, folder: Path) -> Scale | None:
    """Read the camera's scale from a configuration; None if none is stated."""
    section.only(("px_per_mm", "calibration"))
    if "calibration" in section.values:
        return read_calibration(folder / section.word("calibration"))
    if "px_per_mm" in section.values:
        return BareScale(section.number("px_per_mm", above=0.0))
    return None


def gripper_model(section: Section, folder: Path) -> Model:
    """Read the gripper model that simulated parts use, and that predicts gap and force for the limits."""
    section.only(("file", "columns", "kind", "large_rotation", "contact"))
    if "file" in section.values:
        path = folder / section.word("file")
        if path.suffix.lower() != ".toml":
            columns = folder / section.word("columns") if "columns" in section.values else None
            return read_simulation_table(path, columns)
        gripper = read_gripper(path)
    else:
        gripper = sample_gripper()
    physics = Physics(large_rotation=section.flag("large_rotation"), contact=section.flag("contact"))
    kind = section.word("kind", "lumped", of=kinds())
    if physics.large_rotation:
        # Its equilibria are followed from those that were found before, so that runs of one process would differ.
        return build_model(kind, gripper, physics, HingeTheory.CORRECTED)
    return _kept_model(kind, gripper, physics, REGISTRY.version)


@lru_cache(maxsize=8)
def _kept_model(kind: str, gripper: Gripper, physics: Physics, version: int) -> GripperModel:
    """Build a model once in a process for each drawing: it takes most of the time of opening a simulated bed."""
    del version
    return build_model(kind, gripper, physics, HingeTheory.CORRECTED)
