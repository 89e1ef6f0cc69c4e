"""The command line: parse, call, print."""

from __future__ import annotations

import csv
import errno
import json
import math
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import experiments
from .errors import ModelFileError, ReadError, SettingError, UnconstrainError

if TYPE_CHECKING:  # everything heavy is imported by the command that needs it
    from collections.abc import Iterator

    from .demonstration import Demonstration, Recording
    from .experiments.trials import Progress, Result
    from .policies import Policy
    from .preparation import Recipe

__all__ = ["main"]

MODELS = ("local", "rbf", "linear")
LEARNERS = ("hybrid", "inconsistency", "direct")


class Names(click.ParamType):  # type: ignore[type-arg]  # generic in the newest click only
    """Names separated by commas."""

    name = "names"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        """Split at the commas."""
        return tuple(part.strip() for part in str(value).split(",") if part.strip())


class Numbers(click.ParamType):  # type: ignore[type-arg]
    """Finite numbers separated by commas."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Split at the commas."""
        try:
            numbers = tuple(float(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if not numbers or not all(map(math.isfinite, numbers)):
            self.fail(f"got {value!r}, expected finite numbers separated by commas, such as 0.1,0,-2.", param, ctx)
        return numbers


class Group(click.Group):
    """Turns our errors, and those of the file system, into one sentence and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        said, result = "", None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.showwarning = _show_warning  # type: ignore[assignment]
                result = super().invoke(ctx)
        except UnconstrainError as error:
            said = str(error)
        except OSError as error:
            if error.errno == errno.EPIPE:  # whoever read our output has seen enough; click leaves quietly
                raise
            said = f"{error.filename}: {error.strerror}." if error.filename and error.strerror else str(error)
        if said:
            click.echo(f"Error: {said}", err=True)
            ctx.exit(2)
        return result


def options_for_reading(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that say how files are to be understood."""
    for option in reversed(
        [
            click.argument("files", nargs=-1, required=True, metavar="FILE..."),
            click.option("--state", type=Names(), help="Columns that make the state, such as x,y,z."),
            click.option("--action", type=Names(), help="Columns that make the action, such as vx,vy,vz."),
            click.option("--differentiate", is_flag=True, help="Take the velocity of the state as the action."),
            click.option(
                "--by",
                type=click.Choice(["savgol", "central"]),
                help="How to differentiate, savgol by default; implies --differentiate.",
            ),
            click.option("--window", type=float, help="Smoothing window of savgol, seconds."),
            click.option("--rate", type=float, help="Resample to this many samples a second."),
            click.option("--centre", is_flag=True, help="States relative to the mean of each demonstration."),
            click.option("--group", help="Column that names the demonstration."),
            click.option("--time", help="Column with the time in seconds."),
        ]
    ):
        command = option(command)
    return command


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="unconstrain")
def main() -> None:
    """Learn the policy behind movements that were recorded under unknown, changing constraints.

    \b
    unconstrain demo                      the car-washing job, with a report
    unconstrain inspect *.csv             what is in your recordings
    unconstrain fit *.csv -o policy.npz   learn from them
    """  # noqa: D301 - click's mark for lines that stay as they are


@main.command(epilog="\b\nExample:\n  unconstrain inspect wipe_*.csv --state x,y,z")
@options_for_reading
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def inspect(files: Sequence[str], as_json: bool, **reading: Any) -> None:
    """Say what is in FILEs, such as rates, gaps and zero actions."""
    from .preparation import survey

    recipe = _recipe(**reading)
    recordings = _recordings(_paths(files), **reading)
    surveys = [survey(recording, recipe) for recording in recordings]
    if as_json:
        click.echo(json.dumps([asdict(found) for found in surveys], indent=2))
        return
    rows = [
        [
            found.name,
            str(found.samples),
            _number(found.duration_s, "{:.2f} s"),
            _number(found.rate_hz, "{:.1f} Hz"),
            _number(found.jitter, "{:.1%}"),
            "; ".join(f"{gap.length:.2f} s at {gap.start:.2f} s" for gap in found.gaps[:3])
            + (f" and {len(found.gaps) - 3} more" if len(found.gaps) > 3 else "")
            or "none",
            ", ".join(f"{name}: {count}" for name, count in found.missing.items()) or "none",
            _number(found.zero_actions, "{}"),
        ]
        for found in surveys
    ]
    head = ["demonstration", "samples", "length", "rate", "jitter", "gaps", "missing", "zero actions"]
    _table(head, rows)
    for columns in dict.fromkeys(found.columns for found in surveys):
        click.echo(f"columns: {', '.join(columns)}")
    for found in surveys:
        if found.non_increasing:
            click.echo(f"'{found.name}': time does not increase at row {found.non_increasing[0]}.")
    try:
        click.echo(f"fit takes {_said_recipe(_complete(recipe, recordings[0]))}.")
    except UnconstrainError as error:
        click.echo(f"fit needs to know more: {error}")


@main.command(epilog="\b\nExample:\n  unconstrain fit wipe_*.csv --state x,y,z --differentiate -o wipe.npz")
@options_for_reading
@click.option("-o", "--output", required=True, type=click.Path(dir_okay=False), help="File for the policy (.npz).")
@click.option("--model", type=click.Choice(MODELS), default="local", show_default=True, help="What the policy is.")
@click.option("--learner", type=click.Choice(LEARNERS), default="hybrid", show_default=True, help="What it minimises.")
@click.option("--variance", type=float, help="Local: σ² of the receptive fields. By default from the data.")
@click.option("--centres", type=click.IntRange(1), help="RBF: number of kernels, 25 by default.")
@click.option("--alpha", type=float, help="Hybrid: weight of the standard risk in choosing the threshold.")
@click.option("--softness", type=float, help="Hybrid: soften the split; 0.1 is good on noisy recordings.")
@click.option(
    "--folds", type=click.IntRange(2), default=10, show_default=True, help="Folds to choose the threshold on."
)
@click.option(
    "--hold-out", type=click.Choice(["auto", "demonstration", "sample"]), default="auto", help="What a fold holds."
)
@click.option("--report", type=click.Path(dir_okay=False), help="Also write an HTML report there.")
def fit(
    files: Sequence[str],
    output: str,
    model: str,
    learner: str,
    variance: float | None,
    centres: int | None,
    alpha: float | None,
    softness: float | None,
    folds: int,
    hold_out: Any,
    report: str | None,
    **reading: Any,
) -> None:
    """Learn a policy from the demonstrations in FILEs."""
    from . import features, policies, preparation, storage, validation

    paths = _paths(files)
    for written in filter(None, (output, report)):
        if Path(written).resolve() in {Path(path).resolve() for path in paths}:
            raise SettingError(f"{written}: is one of the files to learn from; give another name to write to.")
    for option, value, needed in (("--variance", variance, "local"), ("--centres", centres, "rbf")):
        if value is not None and model != needed:
            raise SettingError(f"{option}: belongs to --model {needed}, got --model {model}.")
    recordings = _recordings(paths, **reading)
    recipe = _complete(_recipe(**reading), recordings[0])
    demonstrations = preparation.prepare(recordings, recipe)
    chosen: dict[str, Any] = {
        "learner": _learner(learner, alpha, softness),
        "validation": validation.Folds(folds, hold_out),
    }
    policy: Policy
    if model == "local":
        policy = policies.LocallyLinearPolicy(variance, **chosen)
    else:
        shape = features.KMeansRBF(centres or 25) if model == "rbf" else features.Affine()
        policy = policies.ParametricPolicy(shape, **chosen)
    policy.fit_demonstrations(demonstrations)
    notes = {"recipe": recipe.to_dict(), "group": reading["group"], "time": reading["time"]}
    storage.save(policy, output, notes)
    click.echo(f"Learnt from {_said_recipe(recipe)}.")
    _say_fit(policy, demonstrations, learner)
    click.echo(f"policy: {output}")
    if report is not None:
        from .report import policy_page

        Path(report).write_text(policy_page(policy, demonstrations, Path(output).stem), encoding="utf-8")
        click.echo(f"report: {report}")


@main.command(epilog="\b\nExample:\n  unconstrain score wipe.npz other.csv --plane 0,0.3,1 --json")
@click.argument("policy", type=click.Path())
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--plane", type=Numbers(), help="Normal of the plane that was held, for the constrained error.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def score(policy: str, files: Sequence[str], plane: tuple[float, ...] | None, as_json: bool) -> None:
    """Say how well POLICY explains the demonstrations in FILEs.

    They are prepared as those were that it learnt from.
    """
    from . import metrics, preparation, storage
    from .constraints import Plane

    learnt, notes = _fitted(policy), storage.load_notes(policy)
    recipe = preparation.Recipe.from_dict(notes.get("recipe", {}))
    recordings = _recordings(_paths(files), group=notes.get("group"), time=notes.get("time"))
    demonstrations = preparation.prepare(recordings, recipe)
    constraint = None if plane is None else Plane(plane)  # type: ignore[arg-type]
    if plane is not None and len(plane) != learnt.n_outputs_:
        raise SettingError(f"--plane: got {len(plane)} numbers, expected {learnt.n_outputs_}, one for each action.")

    def scores(of: Demonstration | Sequence[Demonstration], name: str, samples: int) -> dict[str, Any]:
        found = {"demonstration": name, "samples": samples, "ninc": metrics.ninconsistency(learnt, of)}
        return found | ({"ncpe": metrics.ncpe(learnt, of, constraint)} if constraint is not None else {})

    rows = [scores(demo, demo.name, len(demo)) for demo in demonstrations]
    whole = scores(demonstrations, "all", sum(map(len, demonstrations)))
    if as_json:
        click.echo(json.dumps({"policy": policy, "rows": rows, "all": whole}, indent=2))
        return
    head = ["demonstration", "samples", "normalised inconsistency", *(["nCPE"] if plane is not None else [])]
    _table(head, [[str(v) if not isinstance(v, float) else f"{v:.4g}" for v in one.values()] for one in [*rows, whole]])


@main.command(epilog="\b\nExample:\n  unconstrain rollout wipe.npz --start 0.1,0,0 --plane 0,0.3,1 -o path.csv")
@click.argument("policy", type=click.Path())
@click.option("--start", type=Numbers(), required=True, help="Where to start, one number for each state.")
@click.option("--steps", type=click.IntRange(1), default=200, show_default=True, help="Number of samples.")
@click.option("--dt", type=float, default=0.02, show_default=True, help="Seconds between samples.")
@click.option("--plane", type=Numbers(), help="Normal of a plane to stay on.")
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, allow_dash=True),
    default="-",
    show_default=True,
    help="CSV file; - prints.",
)
def rollout(
    policy: str, start: tuple[float, ...], steps: int, dt: float, plane: tuple[float, ...] | None, output: str
) -> None:
    """Follow POLICY, freely or on a plane, and write it as CSV."""
    from . import rollouts, storage
    from .constraints import Plane

    learnt, recipe = _fitted(policy), storage.load_notes(policy).get("recipe", {})
    if len(start) != learnt.n_features_in_:
        raise SettingError(f"--start: got {len(start)} numbers, expected {learnt.n_features_in_}, one for each state.")
    if plane is not None and len(plane) != len(start):
        raise SettingError(f"--plane: got {len(plane)} numbers, expected {len(start)}, as many as states.")
    constraint = None if plane is None else Plane(plane)  # type: ignore[arg-type]
    path = rollouts.rollout(learnt, list(start), steps, dt, constraint)
    states = recipe.get("states") or [f"x{i + 1}" for i in range(len(start))]
    try:
        support = learnt.support(path.states)
    except SettingError:  # an affine policy, say, is at home everywhere
        support = None
    assert path.times is not None
    with click.open_file(output, "w") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["t", *states, *(f"v{name}" for name in states)])
        writer.writerows([f"{value:.9g}" for value in row] for row in _columns(path))
    if support is not None and support.min() < 1e-3:
        click.echo(
            f"Note: from {path.times[int((support < 1e-3).argmax())]:.2f} s on the movement is far from all data.",
            err=True,
        )


@main.command(epilog="\b\nExample:\n  unconstrain reproduce table1 --trials 100 --out results")
@click.argument("experiment", type=click.Choice(experiments.NAMES))
@click.option("--trials", type=click.IntRange(1), help="Data sets; the paper's number by default.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of everything random.")
@click.option(
    "--workers", type=int, default=-1, help="Processes; one for each core by default. The numbers do not depend on it."
)
@click.option(
    "--out",
    type=click.Path(file_okay=False),
    default="results",
    show_default=True,
    help="Folder for NAME.json and NAME.html.",
)
def reproduce(experiment: str, trials: int | None, seed: int, workers: int, out: str) -> None:
    """Run one of the paper's experiments, beside its printed values.

    An interrupted run goes on where it stopped.
    """
    from .experiments.journal import Journal

    if workers == 0:
        raise SettingError("--workers: got 0, expected a number of processes, or -1 for one on each core.")
    module = experiments.find(experiment)
    settings = replace(module.Settings(), seed=seed)
    if not hasattr(settings, "trials"):
        if trials is not None:
            raise SettingError(f"--trials: {experiment} is a single data set.")
        with _progress(experiment) as progress:
            result = module.run(settings, workers, progress)
        _deliver(result, module.headlines(result), out)
        return
    if trials is not None:
        settings = replace(settings, trials=trials)
    journal = Journal(Path(out) / f".{experiment}.trials", settings)
    with _progress(experiment) as progress:
        result = module.run(settings, workers, progress, journal)
    if _deliver(result, module.headlines(result), out):
        journal.finish()


@main.command(epilog="\b\nExample:\n  unconstrain demo --real --download --out wiping")
@click.option("--real", is_flag=True, help="Learn from recorded wiping of a car rim, leaving one tilt out at a time.")
@click.option("--download", is_flag=True, help="Fetch those recordings (3 MB) if they are not there.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the simulated demonstrator.")
@click.option(
    "--out", type=click.Path(file_okay=False), default="demo", show_default=True, help="Folder for the report."
)
def demo(real: bool, download: bool, seed: int, out: str) -> None:
    """Wash a car: learn on some surfaces, be tested on others.

    Writes a report to look at.
    """
    from .experiments import washing

    if not real:
        click.echo("Seven plates are wiped, five to learn from, two to be tested on.")
    try:
        with _progress("washing") as progress:
            result = washing.run(washing.Settings(real=real, download=download, seed=seed), 1, progress)
    except ReadError as error:
        raise error if download else ReadError(f"{error} On the command line, --download allows it.") from error
    _deliver(result, washing.headlines(result), out)


def _deliver(result: Result, headlines: Sequence[str], out: str) -> bool:
    """Print and write a result; False where it could not be written."""
    from . import report
    from .errors import MissingExtraError

    _result_table(result)
    for line in headlines:
        click.echo(line)
    try:
        data, page = report.write(result, Path(out))
    except MissingExtraError as error:
        click.echo(f"No report: {error}", err=True)
        return False
    click.echo(f"numbers: {data}\nreport:  {page}")
    return True


def _result_table(result: Result) -> None:
    """The paper's values stay in the files: mean and s.d. fill the 80 columns of a terminal."""
    from .experiments.trials import LABELS

    titles = {"constraint": "constr.", "theta_max": "θmax", "ninc": "norm. incon."} | {
        name: LABELS[name] for name in ("nupe", "ncpe")
    }
    first = result.rows[0]
    names = [name.removesuffix("_mean") for name in first if not name.startswith("paper_") and not name.endswith("_sd")]
    rows = [
        [_cell(row[name]) if name in row else f"{row[f'{name}_mean']:.2g} ± {row[f'{name}_sd']:.2g}" for name in names]
        for row in result.rows
    ]
    _table([titles.get(name, name) for name in names], rows)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _recipe(
    state: tuple[str, ...] | None = None,
    action: tuple[str, ...] | None = None,
    differentiate: bool = False,
    by: str | None = None,
    window: float | None = None,
    rate: float | None = None,
    centre: bool = False,
    **_: Any,
) -> Recipe:
    from .preparation import Recipe

    if differentiate or by:
        if action is not None:
            raise SettingError("--action: got columns, and --differentiate or --by too; give one or the other.")
        by = by or "savgol"
    recipe = Recipe(state, action, by, rate=rate, centre=centre)
    return recipe if window is None else replace(recipe, window_s=window)


def _complete(recipe: Recipe, recording: Recording) -> Recipe:
    """Guess what was not said; what was said has to be there."""
    from .preparation.recipes import complete_recipe

    recording.select([*(recipe.states or ()), *(recipe.actions or ())])
    return complete_recipe(recipe, recording)


def _said_recipe(recipe: Recipe) -> str:
    states = ", ".join(recipe.states or ())
    smoothed = f"savgol, {recipe.window_s:g} s" if recipe.differentiate == "savgol" else "central differences"
    actions = f"their velocity ({smoothed})" if recipe.actions is None else f"{', '.join(recipe.actions)} as actions"
    return f"{states} as states and {actions}" + ("" if recipe.actions else " as actions")


def _paths(files: Sequence[str]) -> list[str]:
    """Expand patterns where the shell did not."""
    from glob import glob

    # A pattern may be absolute, which Path.glob refuses.
    return [
        path
        for name in files
        for path in (sorted(glob(name)) if any(c in name for c in "*?[") else []) or [name]  # noqa: PTH207
    ]


def _recordings(paths: Sequence[str], group: str | None = None, time: str | None = None, **_: Any) -> list[Recording]:
    from .readers import read

    return read(paths, group=group, time=time)


def _fitted(path: str) -> Policy:
    from . import storage

    policy = storage.load(path)
    if not hasattr(policy, "solution_"):
        raise ModelFileError(f"{path}: holds a policy that has learnt nothing yet. Fit it before saving.")
    return policy


def _learner(name: str, alpha: float | None, softness: float | None) -> Any:
    from .learners import Direct, Hybrid, Inconsistency

    given = {key: value for key, value in (("alpha", alpha), ("softness", softness)) if value is not None}
    if name != "hybrid" and given:
        raise SettingError(f"--{next(iter(given))}: belongs to the hybrid learner, got --learner {name}.")
    if name != "hybrid":
        return Direct() if name == "direct" else Inconsistency()
    if alpha is not None and softness:
        raise SettingError("--alpha: chooses a threshold, and --softness does without one; give one of the two.")
    # A softened split needs no threshold on top.
    return Hybrid(**given, threshold=0.0 if softness else None)  # type: ignore[arg-type]


def _say_fit(policy: Policy, demonstrations: Sequence[Demonstration], learner: str) -> None:
    from .metrics import ninconsistency

    solution = policy.solution_
    samples = sum(map(len, demonstrations))
    click.echo(
        f"{len(demonstrations)} demonstrations, {samples} samples, {len(solution.weights)} local models."
        if len(solution.weights) > 1
        else f"{len(demonstrations)} demonstrations, {samples} samples."
    )
    if learner != "direct":
        click.echo(
            f"The inconsistency determined {solution.determined_share:.0%} of {solution.directions} weight directions"
            + (" of each model" if len(solution.weights) > 1 else "")
            + ("; the rest follows the standard risk." if learner == "hybrid" else ".")
        )
    click.echo(f"normalised inconsistency on the training data: {ninconsistency(policy, demonstrations):.4g}")


def _columns(path: Demonstration) -> Any:
    import numpy as np

    assert path.times is not None
    return np.column_stack([path.times, path.states, path.actions])


def _number(value: Any, form: str) -> str:
    return "-" if value is None else form.format(value)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(*head, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    # Piped output is for programs and files: no wrapping there.
    console = Console(width=None if sys.stdout.isatty() else 10_000)
    console.print(table)


@contextmanager
def _progress(title: str) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
        job = bar.add_task(title, total=None)
        yield lambda done, of: bar.update(job, completed=done, total=of)


def _show_warning(message: Warning | str, *_: Any) -> None:
    click.echo(f"Note: {message}", err=True)
