"""How a verdict is reached: the questions that the diagnosis asks, in their order."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

QUESTIONS = (
    ("Is an explanation by effects more\nprobable than none, by 20 to 1?", "no", "agrees"),
    ("Does structure or too much remain, or\nis an unseen half not predicted?", "yes", "unknown"),
    ("Are there other minimal explanations\nwithin the squared distance of 12?", "yes", "ambiguous"),
)


def draw() -> Figure:
    """Draw the questions as a column and the verdicts beside it."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set(xlim=(0.0, 10.0), ylim=(-0.2, 4.2))
    for row, (question, answer, verdict) in enumerate(QUESTIONS):
        y = 3.7 - 1.15 * row
        _box(axes, 3.2, y, question, "#eef3fb")
        _box(axes, 8.6, y, verdict, "#fdf3e4")
        axes.annotate(answer, (7.65, y), (5.75, y), va="center", arrowprops={"arrowstyle": "->"})
        axes.annotate("", (3.2, y - 0.8), (3.2, y - 0.36), arrowprops={"arrowstyle": "->"})
        axes.text(3.3, y - 0.6, "no" if answer == "yes" else "yes", va="center")
    _box(axes, 3.2, 0.2, "named", "#e6f4e6")
    return figure


def _box(axes: Axes, x: float, y: float, words: str, colour: str) -> None:
    axes.text(x, y, words, ha="center", va="center", bbox={"boxstyle": "round,pad=0.5", "facecolor": colour})
