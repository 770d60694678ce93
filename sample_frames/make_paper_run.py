"""The paper's experiment on the simulated bed: the 17 inputs of Table 1, measured in pictures, beside the table.

Run as `python sample_frames/make_paper_run.py [FOLDER]`; without a folder the files of `paper_run` are replaced. The
simulated gripper opens as the table's own column Experiment says, so that what the bed measures can be held against it.
"""

import csv
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recipe_toml import read_recipe, write_recipe
from fingervision.storage.simulation_table import read_simulation_table
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe

HERE = Path(__file__).parent
SPEED_MM_S, FRAMES = 2.0, 5
BED = """# The simulated bed, with a gripper that opens as the paper measured it: Table 1, column Experiment.
schema = 1
name = "the paper's experiment"

[actuator]
kind = "simulated"

[camera]
kind = "simulated"

[gripper]
file = "gripper.csv"

[scale]
px_per_mm = 34.0

[limits]
lower_mm = -0.57
upper_mm = 1.59
gap_mm = 0.2
"""


def main(folder: Path) -> None:
    """Write the bed, the recipe, the table and the figure."""
    folder.mkdir(parents=True, exist_ok=True)
    with (HERE / "paper" / "table1.csv").open(encoding="utf-8") as source:
        published = list(csv.DictReader(source))
    inputs = [round(1000.0 * float(row["input_m"]), 6) for row in published]
    with (folder / "gripper.csv").open("w", encoding="utf-8", newline="\n") as table:
        print("input_mm,gap_mm", file=table)
        for at_mm, row in zip(inputs, published, strict=True):
            print(f"{at_mm:g},{row['experiment_mm']}", file=table)
    (folder / "bed.toml").write_text(BED, encoding="utf-8")
    steps = [{"kind": "move", "to_mm": at_mm, "speed_mm_s": SPEED_MM_S, "frames": FRAMES} for at_mm in inputs]
    write_recipe(folder / "recipe.toml", "Table 1", steps)

    bed = open_bed(str(folder / "bed.toml"))
    with tempfile.TemporaryDirectory() as away:
        run_recipe(read_recipe(folder / "recipe.toml"), bed, Path(away) / "run")
        samples = read_samples(Path(away) / "run" / "samples.csv")
    gripper = read_simulation_table(folder / "gripper.csv")
    measured = []
    for number in range(1, len(inputs) + 1):
        rows = [row for row in samples if row.step == number]
        measured.append(
            (float(np.mean([row.input_mm for row in rows])), float(np.mean([row.gap_mm for row in rows])))  # type: ignore[misc]
        )
    stage_mm, gap_mm = np.array(measured).T
    true_mm = gripper.respond(stage_mm).gap_mm
    with (folder / "measured.csv").open("w", encoding="utf-8", newline="\n") as out:
        print("input_mm,stage_mm,gap_mm,true_mm,experiment_mm,comsol_mm,simmechanics_mm", file=out)
        for k, row in enumerate(published):
            beside = f"{row['experiment_mm']},{row['comsol_mm']},{row['simmechanics_mm']}"
            print(f"{inputs[k]:g},{stage_mm[k]:.5f},{gap_mm[k]:.5f},{true_mm[k]:.5f},{beside}", file=out)
    _draw(folder / "measured.png", np.array(inputs), stage_mm, gap_mm, published)


def _draw(
    path: Path, inputs: np.ndarray, stage_mm: np.ndarray, gap_mm: np.ndarray, published: list[dict[str, str]]
) -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (above, below) = plt.subplots(
        2, 1, sharex=True, figsize=(7.0, 6.5), height_ratios=(3, 2), layout="constrained"
    )
    comsol = np.array([float(row["comsol_mm"]) for row in published])
    columns = (
        ("SimMechanics", "simmechanics_mm", "C1"),
        ("Comsol", "comsol_mm", "C2"),
        ("Experiment", "experiment_mm", "C0"),
    )
    for name, key, colour in columns:
        values = np.array([float(row[key]) for row in published])
        above.plot(inputs, values, "-", color=colour, linewidth=1.0, label=f"Table 1, {name}")
        below.plot(inputs, values - comsol, "-", color=colour, linewidth=1.0)
    above.plot(stage_mm, gap_mm, "k+", label="measured in the bed's pictures")
    below.plot(stage_mm, gap_mm - np.interp(stage_mm, inputs, comsol), "k+")
    above.set_ylabel("distance of the fingers (mm)")
    below.set_ylabel("less Comsol (mm)")
    below.set_xlabel("input displacement (mm)")
    above.legend(frameon=False)
    for axes in (above, below):
        axes.grid(visible=True, alpha=0.3)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "paper_run")
