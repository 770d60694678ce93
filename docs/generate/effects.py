"""The reference of the effects: every entry of the catalogue with its law, source, bounds and picture."""

from pathlib import Path

import matplotlib as mpl

from fingervision.diagnosis.report.figure_files import effect_figure
from fingervision.domain.effect import Effect, Stage
from fingervision.effects import catalogue

WORDS = {
    Stage.DRIVE: "Drive: the input that the mechanism really receives",
    Stage.MECHANISM: "Mechanism: how the fingers move at this input",
    Stage.CAMERA: "Camera: what the picture shows of this motion",
}


def effects_page(pictures: Path) -> str:
    """Write the catalogue, stage by stage, and draw each effect's residual into `pictures`."""
    pictures.mkdir(exist_ok=True)
    effects = list(catalogue().values())
    parts = [_overview(effects)]
    for stage in Stage:
        parts.append(f"## {WORDS[stage]}")
        parts += [_section(effect, pictures) for effect in effects if effect.stage is stage]
    return "\n\n".join(parts) + "\n"


def _overview(effects: list[Effect]) -> str:
    rows = [f"| [`{e.name}`](#{e.name}) | {e.stage} | {e.words} |" for e in effects]
    return "\n".join(["| effect | acts in | what happens |", "|---|---|---|", *rows])


def _section(effect: Effect, pictures: Path) -> str:
    needs = [
        words
        for needed, words in (
            (effect.needs_times, "times (`time_s`)"),
            (effect.needs_shared_clock, "one clock shared by all runs"),
            (effect.needs_edges, "both edges (`left_mm`, `right_mm`)"),
            (effect.needs_force, "a force (`force_n`)"),
        )
        if needed
    ]
    lines = [
        f"### {effect.name}",
        f"{effect.words[0].upper()}{effect.words[1:]}.",
        f"* **Definition with a simulation table:** {effect.formula}\n"
        f"* **Source:** {effect.source or 'definition of this project'}\n"
        f"* **Residual (measured minus simulated):** {effect.residual}\n"
        f"* **Data needed beside input and gap:** {', '.join(needs) or 'none'}"
        + (
            f"\n* **Has memory;** its state at the start of a run: {effect.start or 'at rest'}" if effect.memory else ""
        ),
        "| parameter | unit | bounds | meaning |\n|---|---|---|---|\n"
        + "\n".join(
            f"| `{p.name}` | {p.unit or '1'} | {p.lower:g} to {p.upper:g} | {p.words} |" for p in effect.parameters
        ),
        f"![Residual caused by {effect.name}](../_generated/effects/{_drawn(effect.name, pictures)})",
    ]
    return "\n\n".join(lines)


def _drawn(name: str, pictures: Path) -> str:
    with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "path"}):
        effect_figure(name).savefig(pictures / f"{name}.svg", metadata={"Date": None})
    return f"{name}.svg"
