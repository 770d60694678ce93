"""Table 1 of Hricko & Havlik (2015): the two published models and the only measurement of the real gripper.

Source: American Journal of Mechanical Engineering 3(6), 2015, 201-206, table 1, with the digits as printed. No
parameter of a model is fitted to the table.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INPUT_MM: Array = np.array(
    [-0.57, -0.51, -0.42, -0.30, -0.18, -0.09, 0.0, 0.15, 0.30, 0.45, 0.60, 0.75, 0.90, 1.05, 1.20, 1.50, 1.59]
)
SIMMECHANICS_MM: Array = np.array([
    0.075000, 0.487700, 1.107000, 1.993000, 2.760000, 3.938000, 4.000000, 5.340000, 6.690000, 7.105000, 8.141000,
    9.177000, 10.210000, 11.250000, 12.290000, 14.360000, 14.990000,
])  # fmt: skip
COMSOL_MM: Array = np.array([
    -0.023242, 0.062176, 0.757087, 1.683635, 2.610182, 3.305093, 4.000004, 5.158188, 6.316373, 7.474558, 8.632742,
    9.790927, 10.949112, 12.107296, 13.265481, 15.581850, 16.276761,
])  # fmt: skip
EXPERIMENT_MM: Array = np.array([
    0.441180, 0.470590, 1.088000, 2.352900, 3.117600, 3.792500, 4.000000, 5.852900, 6.764600, 7.940000, 8.823500,
    10.441200, 11.558800, 12.500000, 13.705900, 15.823500, 17.050000,
])  # fmt: skip
