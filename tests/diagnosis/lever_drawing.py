"""A small mechanism for tests: a finger with two notch hinges, one at the fixed body and one at a guided shuttle."""

from copy import deepcopy
from pathlib import Path
from typing import Any

TABLES: dict[str, Any] = {
    "schema": 1,
    "name": "lever",
    "plate_mm": 3.0,
    "material": {"name": "PA2200", "youngs_modulus_mpa": 1650.0, "poisson_ratio": 0.34, "density_kg_m3": 930.0,
                 "yield_mpa": 48.0},
    "body": [
        {"name": "pillar", "box_mm": [31, 39, 0, 40]},
        {"name": "shuttle", "box_mm": [14, 22, 10, 40]},
        {"name": "finger", "box_mm": [10, 39, 40, 50]},
        {"name": "finger", "box_mm": [10, 18, 40, 90]},
    ],
    "flexure": [
        {"name": "hinge 1", "kind": "circular", "at_mm": [35, 34], "axis_deg": 90, "thickness_mm": 0.8, "radius_mm": 3},
        {"name": "hinge 2", "kind": "circular", "at_mm": [18, 34], "axis_deg": 90, "thickness_mm": 0.8, "radius_mm": 3},
    ],
    "fixed": [{"name": "clamp", "box_mm": [31, 39, 0, 0]}],
    "drive": {"box_mm": [14, 22, 10, 10], "direction": [0, 1], "across": "held"},
    "probe": [{"name": "tip", "at_mm": [10, 89]}, {"name": "stop", "at_mm": [31, 5]}],
    "pair": [{"name": "gap", "of": ["stop", "tip"]}],
}  # fmt: skip


def changed(**flexures: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of the drawing with changed dimensions of `hinge_1` or `hinge_2`."""
    tables = deepcopy(TABLES)
    for flexure in tables["flexure"]:
        flexure.update(flexures.get(flexure["name"].replace(" ", "_"), {}))
    return tables


def write_toml(path: Path) -> Path:
    """Write the drawing as mechanism.toml."""
    lines = []
    for key, value in TABLES.items():
        if isinstance(value, list):
            continue
        if not isinstance(value, dict):
            lines.append(f"{key} = {value!r}".replace("'", '"'))
    for key, value in TABLES.items():
        for table in value if isinstance(value, list) else [value] if isinstance(value, dict) else []:
            lines += ["", f"[[{key}]]" if isinstance(value, list) else f"[{key}]"]
            lines += [f"{name} = {number!r}".replace("'", '"') for name, number in table.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
