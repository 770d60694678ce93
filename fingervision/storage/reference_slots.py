"""Reference slots measured in a run on the test bed, from the run.json beside the run's table."""

from pathlib import Path

from fingervision.domain.reference_slot import ReferenceSlot
from fingervision.storage.plain_file import json_of
from fingervision.storage.run_files import RUN

KEY = "reference_slots"


def slots_beside(table: Path) -> tuple[ReferenceSlot, ...]:
    """Read the reference slots of the run to which a table belongs; empty without a run or without measured slots.

    Parameters
    ----------
    table : Path
        A table in a run folder, or any other table.
    """
    try:
        about = json_of(table.parent / RUN)
        names = (about["samples"], about.get("joined"))
        listed = about.get(KEY, []) if table.name in names else []
        return tuple(
            ReferenceSlot(*(float(slot[key]) for key in ("size_mm", "u_size_mm", "measured_mm", "u_random_mm")))
            for slot in listed
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        # The folder belongs to another program, or the run was interrupted.
        return ()
