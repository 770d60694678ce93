"""Drawing of the published physical sample, the default gripper of a simulated test bed."""

from fingervision.domain.gripper import Body, Gripper, Material
from fingervision.models.reference_mesh import REFERENCE_HINGE, REFERENCE_LEVER, REFERENCE_LINKS


def sample_gripper() -> Gripper:
    """Return the drawing of the published gripper; only its material and body are published values."""
    return Gripper(
        material=Material("PA2200", 1650.0, 0.34, 930.0, 48.0),
        body=Body(80.0, 100.0, 3.0, 4.0, 0.3),
        hinge=REFERENCE_HINGE,
        lever=REFERENCE_LEVER,
        links=REFERENCE_LINKS,
    )
