"""
A video: the gap with its uncertainty, and what limits it
=========================================================

Any video of the two fingers is measured frame by frame. `inspect` says first what to change at the set-up.
"""

import tempfile

import matplotlib.pyplot as plt

import fingervision as fv

folder = fv.example("measure", tempfile.mkdtemp())
print(fv.inspect(folder / "opening.mp4", px_per_mm=34.0, seconds=0.5).report())

# %%
# Frames 40 to 100 of the recording, with the calibration of its camera and the log of its stage:

measured = fv.measure(
    folder / "opening.mp4", calibration=folder / "calibration.json", drive=folder / "drive.csv", frames=(40, 100)
)
print(measured)

figure, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
upper.plot(measured.time_s, measured.gap_mm, ".-")
upper.set_ylabel("gap, mm")
lower.plot(measured.time_s, 2e3 * measured.u_gap_mm, label="U of the gap (k = 2)")
lower.plot(measured.time_s, 2e3 * measured.u_random_mm, label="its random part")
lower.set(xlabel="time, s", ylabel="µm", ylim=(0.0, None))
lower.legend()
