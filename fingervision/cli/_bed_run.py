"""`fingervision bed run`: execute a recipe on the test bed and write the table that `diagnose` reads."""

from pathlib import Path

import click

from fingervision.cli._effects_option import effects_option
from fingervision.cli._on_bed import bed_option, hide_option

EXAMPLES = """
\b
Examples:
  fingervision bed run recipe.toml --out run
  fingervision bed run recipe.toml --hide backlash:play_mm=0.2 --hide camera_tilt --out hidden
  fingervision bed run recipe.toml --hide sealed.toml --out sealed
  fingervision bed run next_run.toml --after run --out second
  fingervision diagnose run/samples.csv --model run/simulation.csv --out diagnosis

\b
Files written to --out:
  samples.csv   one row per frame: input, gap, both edges, force    video.mp4     every frame, lossless (FFV1)
  run.json      recipe, test bed, clocks, digests                   events.jsonl  what happened, when
  recipe.toml   the recipe                                          simulation.csv the predicted gap

If a run was interrupted, for whatever reason, the same command continues it. On a terminal, p and Enter pauses and
resumes a run, q and Enter or Ctrl-C ends it; the motor is stopped first.
"""


@click.command(epilog=EXAMPLES)
@click.argument("recipe_toml", metavar="RECIPE.toml", type=click.Path(path_type=Path))
@bed_option
@hide_option
@effects_option
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("run"), show_default=True, help="Folder for the results."
)
@click.option(
    "--after",
    type=click.Path(path_type=Path),
    help="Earlier run on this test bed; joined.csv then holds the rows of both runs.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    help="Seed of all randomness in simulated parts; the same seed gives the same run.",
)
@click.option("--real-time", is_flag=True, help="Run a simulated test bed in real time instead of as fast as possible.")
@click.option("--json", "as_json", is_flag=True, help="Print the result of the run as JSON.")
def command(
    recipe_toml: Path,
    bed_name: str,
    hide: tuple[str, ...],
    out: Path,
    after: Path | None,
    seed: int | None,
    real_time: bool,
    as_json: bool,
) -> None:
    """Run a recipe on the test bed and measure every video frame.

    The whole recipe is checked against the limits of the test bed before anything moves.
    """
    import json
    import sys

    from fingervision.measuring.rehearsal import rehearse
    from fingervision.storage.recipe_toml import read_recipe
    from fingervision.testbed.bed_factory import open_bed
    from fingervision.testbed.run.recipe_run import run_recipe
    from fingervision.testbed.run.run_folder import rows_before, times_of
    from fingervision.testbed.simulation.parse_injected_effects import hidden_from

    recipe, hidden = read_recipe(recipe_toml), hidden_from(hide)
    before = [] if after is None else rows_before(after)
    rehearse()
    bed = open_bed(bed_name, hidden, pace=1.0 if real_time else 0.0, seed=seed, earlier_s=times_of(before))
    try:
        with click.progressbar(length=1000, label="running", file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
            done = run_recipe(
                recipe,
                bed,
                out,
                hidden,
                before=before,
                on_progress=lambda now, total: bar.update(max(0, int(1000 * now / total) - bar.pos) if total else 0),
                say=lambda words: click.echo(words, err=True),
            )
    finally:
        bed.close()
    if as_json:
        counts = done.counts
        document = {"folder": str(done.folder), "frames": counts.recorded, "frames_with_gap": counts.with_gap}
        click.echo(json.dumps({**document, "frames_lost": counts.lost, "resumed_after": done.resumed_after}))
        return
    went_on = f", after {done.resumed_after} recorded before the interruption" if done.resumed_after else ""
    click.echo(f"{done.counts.recorded} frames{went_on}, {done.counts.with_gap} with a gap: {out / 'samples.csv'}")
    if bed.model is not None:
        table = out / ("samples.csv" if after is None else "joined.csv")
        click.echo(f"next: fingervision diagnose {table} --model {out / 'simulation.csv'} --out diagnosis")
