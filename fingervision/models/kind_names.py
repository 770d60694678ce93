"""Names of the kinds of model, listed by `--help` without importing any model."""

import pkgutil
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

GROUP = "fingervision.models"


@cache
def built_in_kinds() -> tuple[str, ...]:
    """List the names of the modules of this package that define KIND, sorted."""
    here = Path(__file__).parent
    return tuple(
        sorted(
            module.name
            for module in pkgutil.iter_modules([str(here)])
            if not module.ispkg
            and f'\nKIND = "{module.name}"\n' in (here / f"{module.name}.py").read_text(encoding="utf-8")
        )
    )


def kind_names() -> tuple[str, ...]:
    """List the names of all kinds of model, both built in and installed."""
    return tuple(dict.fromkeys((*built_in_kinds(), *(point.name for point in entry_points(group=GROUP)))))
