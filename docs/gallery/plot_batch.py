"""
A day's recordings in one call
==============================

`fv.batch.measure` measures many recordings on all cores; what is done is not done again. In a script, the call stands
under `if __name__ == "__main__":`, because the worker processes import the script.
"""

import csv
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import fingervision as fv

if __name__ == "__main__":
    folder = fv.example("measure", tempfile.mkdtemp())
    day = Path(tempfile.mkdtemp()) / "day"
    done = fv.batch.measure([folder / "frames", folder / "opening.mp4"], out=day, px_per_mm=34.0, frames="0:9")
    print(done)

    with (day / "batch.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            print({key: row[key] for key in list(row)[:4]})

    # %%
    # The overview that a batch draws of all its results:

    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    axes.imshow(plt.imread(day / "batch.png"))
    axes.set_axis_off()
