"""Assembly asymmetry: one finger opens more than the other."""

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: one finger opens more than the other."""
    return response.shifted(values["share"] * (response.gap_mm - history.rest_gap_mm))


EFFECT = PointEffect(
    name="assembly_asymmetry",
    stage=Stage.MECHANISM,
    order=140,
    words="one finger opens more than the other",
    formula="right share 1/2 + share, left 1/2 - share; the gap does not change",
    source="definition",
    residual="a midline that moves in proportion to the opening; the gap is unchanged",
    parameters=(
        Parameter(
            "share", "", -0.5, 0.5, "share of the opening that shifts from the left to the right finger", typical=0.05
        ),
    ),
    needs_edges=True,
    checks={FurtherCheck.TURN: True},
    odd=("share",),
    demonstrated=True,
    in_drawing=DrawingForm(
        DrawnPart.LINKS_OPPOSITE,
        Parameter(
            "share", "", -0.5, 0.5, "share of the opening that the right finger has beyond one half", typical=0.01
        ),
    ),
    act=act,
)
