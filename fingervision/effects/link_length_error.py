"""Link length error: a link is longer or shorter than in the drawing, which displaces a hinge or measuring point."""

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Divide the opening by 1 + ratio, as for a lever with a longer short arm: a table does not describe links."""
    opening_mm = response.gap_mm - history.rest_gap_mm
    return response.with_gap(history.rest_gap_mm + opening_mm / (1.0 + values["ratio"]))


EFFECT = PointEffect(
    name="link_length_error",
    stage=Stage.MECHANISM,
    order=171,
    words="a link is longer or shorter than in the drawing",
    formula="o / (1 + ratio); with a drawing, one end of this link moved along it",
    source="kinematics of a lever",
    residual="proportional to the opening; the poses of the bodies show which link",
    parameters=(Parameter("ratio", "", -0.1, 0.1, "relative error of the link's length", typical=0.01),),
    needs_bodies=True,
    in_drawing=DrawingForm(
        DrawnPart.LINK, Parameter("ratio", "", -0.1, 0.1, "relative error of the length", typical=0.01), reference=0.003
    ),
    act=act,
)
