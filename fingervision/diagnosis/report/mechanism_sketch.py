"""Sketch of the mechanism on the page: every body as predicted and as measured, with the difference magnified.

A slider selects the time within each run, or the input if the rows have no times.
"""

import json
import re
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_evidence import BodyEvidence
from fingervision.models.mechanism_bodies import LinkBody
from fingervision.models.place_answers import PlaceAnswers

Array = NDArray[np.float64]

STEPS = 15
"""Number of positions of the slider over the input: parts of the input's range, each with the mean of its rows."""
TIME_STEPS, FEWEST_STEPS = 24, 4
"""Number of positions of the slider over time in all runs together, and least number in one run: opening and closing at
both ends."""
SHOWN = 0.05
"""Largest displayed difference, as a share of the mechanism's size."""
CHORDS = 9
"""Points of a drawn arc: chords of a quarter circle then miss it by half a per cent of its radius."""
PARTS = ("x_mm", "y_mm", "angle_mrad")
COLOURS = (("#7a8b99", 3.0), ("#c9a227", 6.0), ("#c1440e", np.inf))
"""Colour of a body whose mean deviation is up to a given number of standard deviations."""


def sketch_html(evidence: BodyEvidence, answers: PlaceAnswers) -> str:
    """Draw the bodies whose poses were measured, with a slider that selects the part of the recording.

    Parameters
    ----------
    evidence : BodyEvidence
        Results of comparing the measured channels with the drawing.
    answers : PlaceAnswers
        Predictions of the drawing.
    """
    u = evidence.prediction.input_mm
    parts, said_at = _parts(evidence)
    bodies = [body for body in answers.model.bodies if body.is_fixed or body.name in answers.moving_bodies]
    corners = {body.name: _corners(body) for body in bodies}
    every = np.concatenate(list(corners.values()), axis=1)
    low, high = every.min(axis=1), every.max(axis=1)
    size = float(np.hypot(*(high - low)))
    reach = {body.name: float(np.hypot(*(corners[body.name] - body.centroid_mm[:, None])).max()) for body in bodies}
    off = {body.name: _differences(body.name, evidence, parts) for body in bodies}
    measured = [body.name for body in bodies if any(f"{body.name}.{part}" in evidence.names for part in PARTS)]
    partly = [name for name in measured if any(f"{name}.{part}" not in evidence.names for part in PARTS)]
    unseen = [body.name for body in bodies if not body.is_fixed and body.name not in measured]
    largest = max(
        (float(np.hypot(*rows[:2])) + 1e-3 * abs(float(rows[2])) * reach[name]
         for name, (means, _) in off.items() for rows in means), default=0.0,
    )  # fmt: skip
    magnified = SHOWN * size / largest if largest > 0.0 else 1.0
    places = [list(answers.channels).index(f"{body.name}.{part}") if not body.is_fixed else -1
              for body in bodies for part in PARTS]  # fmt: skip
    slopes = answers.answer().by_input
    frames = []
    for step, part in enumerate(parts):
        at = float(u[part].mean())
        shown = []
        for number, body in enumerate(bodies):
            own = [slopes[k] * at if k >= 0 else 0.0 for k in places[3 * number : 3 * number + 3]]
            means, sigma = off[body.name]
            seen = [own[k] + magnified * float(means[step][k]) for k in range(3)]
            is_measured = body.name in measured
            shown.append({"predicted": own, "measured": seen if is_measured else None,
                          "colour": _colour(float(sigma[step])), "sigma": float(f"{sigma[step]:.3g}"),
                          "off": _off_words(body.name, evidence, means[step])})  # fmt: skip
        frames.append({"at": f"{said_at[step]}input {at:.4g} mm", "input": round(at, 4), "bodies": shown})
    shapes = []
    for kind in ("drawn", "predicted", "measured"):
        for number, body in enumerate(bodies):
            points = " ".join(f"{x:.3f},{y:.3f}" for x, y in corners[body.name].T)
            shapes.append(f'<polygon class="{kind}" id="{kind}-{number}" points="{points}"><title>{body.name}</title>'
                          "</polygon>")  # fmt: skip
    hinges = _hinges(evidence, answers, size)
    margin = 0.12 * size
    box = f"{low[0] - margin:.2f} {-high[1] - margin:.2f} {high[0] - low[0] + 2 * margin:.2f} " + (
        f"{high[1] - low[1] + 2 * margin:.2f}"
    )
    data = json.dumps({"frames": frames, "centres": [body.centroid_mm.tolist() for body in bodies],
                       "names": [body.name for body in bodies]})  # fmt: skip
    said = (
        "Grey: as drawn. Dashed: as predicted, to scale. Filled: as measured, with the difference from the prediction "
        f"magnified {magnified:.3g} times. Colour: mean deviation of a body in units of its standard uncertainty u "
        "from noise: grey up to 3 u, yellow up to 6 u, red above. Rings: hinges; a hinge that the result names has a "
        "heavy ring. Fixed bodies are not measured."
    )
    if unseen:
        said += f" Not measured: {', '.join(unseen)}."
    if partly:
        said += f" Measured in part, otherwise drawn as predicted: {', '.join(partly)}."
    return (
        f"<style>{_STYLE}</style>"
        f'<svg id="mechanism" viewBox="{box}" role="img" aria-label="The mechanism as predicted and as measured">'
        f'<g transform="scale(1,-1)">{"".join(shapes)}</g>{hinges}</svg>'
        f'<p><label>{"Input" if evidence.time_s is None else "Time"} <input id="mechanism-at" type="range" min="0" '
        f'max="{len(frames) - 1}" value="{_most_off(frames)}"></label><output id="mechanism-said" '
        f'for="mechanism-at"></output></p><p class="hint">{said}</p>'
        f'<script type="application/json" id="mechanism-data">{data}</script><script>{_SCRIPT}</script>'
    )


def _parts(evidence: BodyEvidence) -> tuple[list[NDArray[np.intp]], list[str]]:
    """Rows of the table at every position of the slider, with a description of each position."""
    u, noise = evidence.prediction.input_mm, evidence.findings.noise
    if evidence.time_s is None:
        order = np.flatnonzero(noise.kept)[np.argsort(u[noise.kept], kind="stable")]
        parts = [part for part in np.array_split(order, min(STEPS, order.size)) if part.size]
        return parts, [""] * len(parts)
    found, words = list[NDArray[np.intp]](), list[str]()
    each = max(TIME_STEPS // len(noise.runs), FEWEST_STEPS)
    for number, run in enumerate(noise.runs):
        rows = np.arange(run.start, run.stop)[noise.kept[run]]
        for part in np.array_split(rows, min(each, max(rows.size, 1))):
            if part.size:
                found.append(part)
                of_run = f"run {number + 1}, " if len(noise.runs) > 1 else ""
                words.append(f"{of_run}{float(evidence.time_s[part].mean()):.4g} s, ")
    return found, words


def _most_off(frames: Sequence[dict[str, Any]]) -> int:
    """Position of the slider at which a body deviates most from its prediction; the HTML page opens there."""
    worst = [max((own["sigma"] for own in frame["bodies"] if own["measured"]), default=0.0) for frame in frames]
    return int(np.argmax(worst))


def _off_words(name: str, evidence: BodyEvidence, mean: Array) -> str:
    """Deviation of a body from its predicted pose, in words: `12 um, 0.62 mrad`."""
    there = [f"{name}.{part}" in evidence.names for part in PARTS]
    words = [f"{1e3 * float(np.hypot(*mean[:2])):.3g} um"] if there[0] or there[1] else []
    return ", ".join([*words, *([f"{abs(float(mean[2])):.3g} mrad"] if there[2] else [])])


def _hinges(evidence: BodyEvidence, answers: PlaceAnswers, size: float) -> str:
    """Rings at the hinges of the drawing, with names; a hinge that the result names has a heavy ring."""
    places = {member.candidate.place for member in evidence.findings.members}
    told = " ".join(places) if not evidence.findings.structure else ""
    shapes = []
    for flexure in answers.mechanism.flexures:
        (x, y), name = flexure.at_mm, escape(flexure.name)
        kind = "hinge told" if re.search(rf"(?<!\w){re.escape(flexure.name)}(?!\w)", told) else "hinge"
        shapes.append(f'<circle class="{kind}" cx="{x:.3f}" cy="{-y:.3f}" r="{0.012 * size:.3f}"/>')
        shapes.append(f'<text x="{x + 0.02 * size:.3f}" y="{-y + 0.009 * size:.3f}" font-size="{0.026 * size:.3f}">'
                      f"{name}</text>")  # fmt: skip
    return "".join(shapes)


def _differences(name: str, evidence: BodyEvidence, parts: Sequence[NDArray[np.intp]]) -> tuple[Array, Array]:
    """Mean difference of a body's measured and predicted pose in every part of the range, shape (parts, 3).

    The second returned value is the largest significance of the differences.
    """
    means, sigma = np.zeros((len(parts), 3)), np.zeros(len(parts))
    for k, part in enumerate(PARTS):
        channel = f"{name}.{part}"
        if channel not in evidence.prediction.channels:
            continue
        place = evidence.prediction.channels.index(channel)
        for step, rows in enumerate(parts):
            mean = float(evidence.findings.before[rows, place].mean())
            means[step, k] = mean
            noise = float(evidence.findings.noise.sd[place]) / float(np.sqrt(rows.size))
            sigma[step] = max(sigma[step], abs(mean) / noise)
    return means, sigma


def _colour(sigma: float) -> str:
    return next(colour for colour, limit in COLOURS if sigma <= limit)


def _corners(body: LinkBody) -> Array:
    return np.concatenate(
        [c.at(np.linspace(c.t0, c.t1, 2 if c.is_straight else CHORDS))[:, :-1] for c in body.outline.curves], axis=1
    )


_STYLE = """
#mechanism { width: 100%; max-height: 70vh }
#mechanism polygon { vector-effect: non-scaling-stroke; fill: none }
#mechanism .drawn { stroke: #bbb; stroke-width: 1 }
#mechanism .predicted { stroke: currentColor; stroke-width: 1.2; stroke-dasharray: 5 4 }
#mechanism .measured { fill-opacity: .45; stroke-width: 1.4 }
#mechanism .hinge { fill: none; stroke: currentColor; stroke-width: 1; vector-effect: non-scaling-stroke }
#mechanism .told { stroke: #c1440e; stroke-width: 3.5 }
#mechanism text { fill: currentColor; stroke: none }
#mechanism-at { width: min(75%, 40rem); vertical-align: middle }
#mechanism-said { display: block; min-height: 3em }
"""
_SCRIPT = """
(() => {
  const data = JSON.parse(document.getElementById("mechanism-data").textContent);
  const slider = document.getElementById("mechanism-at"), said = document.getElementById("mechanism-said");
  const place = (shape, [x, y, mrad], [cx, cy]) =>
    shape.setAttribute("transform", `translate(${x},${y}) rotate(${mrad * 0.18 / Math.PI},${cx},${cy})`);
  const show = () => {
    const frame = data.frames[slider.value];
    const off = [];
    frame.bodies.forEach((body, k) => {
      place(document.getElementById(`predicted-${k}`), body.predicted, data.centres[k]);
      const shape = document.getElementById(`measured-${k}`);
      shape.style.display = body.measured ? "" : "none";
      if (!body.measured) return;
      place(shape, body.measured, data.centres[k]);
      shape.style.fill = shape.style.stroke = body.colour;
      if (body.sigma > 3) off.push(`${data.names[k]} ${body.off} off (${body.sigma} u)`);
    });
    said.textContent = `${frame.at}: ` + (off.length ? off.join("; ") : "no body is off by more than 3 u");
    slider.setAttribute("aria-valuetext", said.textContent);
  };
  slider.addEventListener("input", show);
  show();
})();
"""
