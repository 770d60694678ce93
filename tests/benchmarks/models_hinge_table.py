"""Print the factors of `fingervision/models/hinge_correction.py`: brick elements over beam theory, per direction."""

import numpy as np

from fingervision.domain.gripper import Material
from fingervision.models.hinge_compliance import beam_compliance
from fingervision.models.hinge_solid import solid_compliance
from fingervision.models.notch import circular_notch

MATERIAL = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)


def main() -> None:
    """Print one line per t / R and b / t."""
    print("t/R b/t | x y z about-x about-y about-z")
    for t_over_r in (0.05, 0.1, 0.25, 0.5, 0.8):
        along = 40 if t_over_r < 0.2 else 24
        for b_over_t in (1.0, 3.0, 10.0):
            notch = circular_notch(1.0 / t_over_r, 1.0, b_over_t)
            solid = np.diag(solid_compliance(notch, MATERIAL, along))
            factors = solid / np.diag(beam_compliance(notch, MATERIAL))
            print(t_over_r, b_over_t, "|", ", ".join(f"{factor:.4f}" for factor in factors), flush=True)


if __name__ == "__main__":
    main()
