"""Domain types: immutable records with stated units, used by all other packages."""

import copyreg
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


def read_only(mapping: Mapping[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a read-only view of a mapping; the type itself cannot be named in a pickle."""
    return MappingProxyType(mapping)


# Read-only mappings are the defaults of frozen records, and results are sent to other processes.
copyreg.pickle(MappingProxyType, lambda mapping: (read_only, (dict(mapping),)))
