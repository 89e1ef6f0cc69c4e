"""``unconstrain score``: how well a policy explains recordings."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import click

import unconstrain as uc

from ..base.display import innermost, listed, percent
from ..base.errors import InvalidDataError, SettingError
from .constraining import hand_of, held_of, options_for_held
from .informing import TOLD, learnt_from
from .printing import explained, number, option_for_json, print_table, refuse_warnings, say_verdict
from .progress import shown
from .reading import fitted_policy, options_for_reading, prepared, to_copy

LEAST, ENOUGH = 5, 5.0
"""Samples that it takes to tell noise, and standard deviations of it that are enough in half a usual action."""

HERE = "the starts of these recordings"
"""Where a policy is run from, in words: ``fit`` runs it from those that it learnt from."""


@click.command(epilog="\b\nExample:\n  unconstrain score wipe.npz other.csv --plane 0,0.3,1 --json")
@click.argument("policy", type=click.Path())
@options_for_reading
@options_for_held("that held these recordings, to score under it, too")
@option_for_json
def score(policy: str, files: Sequence[str], plane: Any, constraint: str | None, as_json: bool, **reading: Any) -> None:
    """Score how well POLICY explains recordings.

    The demonstrations in each FILE are read and prepared as the training data of the policy was, but for what options
    say. What it explains is a weighted share of the squared motion, along the recorded directions alone.
    """
    from ..pages.fit import replayed

    moving, notes, verdicts = fitted_policy(policy), uc.storage.load_notes(policy), uc.evaluation.verdicts
    learnt, arm = innermost(moving), hand_of(reading.pop("jacobian"), reading.pop("tip"))
    with shown("reading"):
        demonstrations, recipe, recordings = prepared(files, reading, notes)
    refuse_warnings(reading["strict"])
    states, known = uc.stack(demonstrations).states, learnt_from(learnt, notes, recordings, recipe)
    held = held_of(plane, constraint, arm, recipe, states, learnt.n_outputs_)
    if (support_of(learnt, states) < uc.models.SUPPORTED).mean() > 0.5:
        click.echo(f"Note: {policy}: learnt far from most of these states: another task, or other units?", err=True)
    with shown("scoring"):
        short = [one.name for one in demonstrations if len(one) < LEAST]
        demonstrations, still = _moved(moving, _long_enough(demonstrations))
        before, demonstrations = _learnt(moving, held, demonstrations, known or ())
        rows = [_scores(moving, held, [demo], demo.name) for demo in demonstrations]
        whole = _scores(moving, held, demonstrations, "held out" if before else "all")
        planes = uc.evaluation.metrics.explained_in_planes(moving, demonstrations)
    given = None if held is None else 1.0 - whole["ncpe"], None if known is None else len(known) * (not before)
    judged = verdicts.of_score(whole["explains"], len(demonstrations), *given, notes.get(TOLD))
    judged = _missed(judged, moving, demonstrations, before) if whole["fast"] >= LEAST else verdicts.TOO_SLOW
    judged = verdicts.of_worst(judged, {one["demonstration"]: one["explains"] for one in rows if one["fast"] >= LEAST})
    judged = judged if held is not None else verdicts.of_planes(judged, planes, _motion(demonstrations))
    with shown("running it from the same starts"):
        found = replayed(judged, moving, demonstrations, recipe, held, recordings[0].units, starts=HERE)
    judged = _forbidden(_left(found.verdict, moving, demonstrations), held, demonstrations)
    verdict = to_copy(verdicts.of_unit(judged, _times(learnt, states)), policy, notes, of=files)
    if not as_json:
        _print_scores(verdict, [*before, *rows, whole], (still, short), found.in_figures, demonstrations)
        return
    told = {"policy": policy, "rows": rows, "all": whole, "learnt_from": known, "learnt": before, "hardly_moved": still}
    more = {"too_short": short, "in_planes": _known(planes), "replayed": found.medians, "ran": found.in_figures}
    click.echo(json.dumps(told | more | {"verdict": verdict.to_json()}, indent=2))


def _learnt(moving: Any, held: Any, of: list[uc.Demonstration], known: Sequence[str]) -> tuple[list[Any], Any]:
    """Scores of what was learnt from, each and all, where others were held out; and these, or else all."""
    old, new = ([one for one in of if (one.name in known) is seen] for seen in (True, False))
    parts = *((one.name, [one]) for one in old), ("learnt from", old)
    return ([_scores(moving, held, some, name) for name, some in parts], new) if old and new else ([], of)


def _missed(judged: Any, moving: Any, demonstrations: Sequence[uc.Demonstration], learnt: Sequence[Any]) -> Any:
    """A verdict with what a policy misses where it predicts, what noise makes of that, and what it learnt from."""
    share, noise = explained(moving, demonstrations), uc.evaluation.metrics.missed_for_noise(moving, demonstrations)
    judged = judged._replace(trust=judged.trust and f"{judged.trust} It {uc.evaluation.verdicts.misses(share, noise)}.")
    seen = len(learnt) - 1
    said = f"it learnt from {seen} of {seen + len(demonstrations)} demonstrations, scored apart: this judges the others"
    return uc.evaluation.verdicts.doubted(judged, said) if learnt else judged


def _left(judged: Any, moving: Any, demonstrations: Sequence[uc.Demonstration]) -> Any:
    """A verdict with how many samples leave where a policy learnt, if it misses more than noise, most of it there."""
    along, verdicts = uc.evaluation.metrics.along_motion, uc.evaluation.verdicts
    far = [support_of(innermost(moving), one.states) < verdicts.NEARBY for one in demonstrations]
    off = [one[rows] for one, rows in zip(demonstrations, far, strict=True) if rows.any()]
    usual = float(_motion(demonstrations).sum() / (size := sum(map(len, demonstrations)))) ** 0.5
    missed, motion = along(moving, demonstrations, usual)
    there = along(moving, off, usual)[0] if off else 0.0
    noise = uc.evaluation.metrics.missed_for_noise(moving, demonstrations) ** 2 * motion
    if missed - noise <= (1 - verdicts.MOSTLY) * motion or there <= 0.5 * missed:
        return judged
    left = f"leave where it was learnt, at {percent(sum(map(len, off)) / size)} of their samples"
    said = f"{judged.said} What it misses is likely ({percent(there / missed)}) as these recordings {left}."
    then = f"Demonstrate where they go, too ('unconstrain look' shows both). {judged.next}"
    return judged._replace(said=said, next=then.rstrip())


def _forbidden(judged: Any, held: Any, of: Sequence[uc.Demonstration]) -> Any:
    """The verdict, with what the constraint that was given would not have allowed."""
    metrics, verdicts = uc.evaluation.metrics, uc.evaluation.verdicts
    return judged if held is None else verdicts.of_forbidden(judged, metrics.forbidden(held, of))


def _print_scores(verdict: Any, rows: Any, left: Sequence[list[str]], ran: str, of: Sequence[Any]) -> None:
    """A verdict, scores of each demonstration and all, why others have none, and figures of runs from their starts."""
    say_verdict(verdict)
    noisy = any(one.noise is not None for one in of)  # which samples are fast is not known else
    head = ["demonstration", "fast " * noisy + "samples", "explains" + " (fast)" * noisy]
    head += ["normalised inconsistency" + " (noise too)" * noisy, "nPOE", "nCPE"]
    each = [_row(noisy, *one.values()) for one in rows]
    why = zip(("hardly moved", "too short"), left, strict=True)
    none = [[name, "", f"{how}: no score"] for how, names in why for name in names]
    print_table(head[: len(rows[-1]) - 1], [*each[:-1], *none, each[-1]])
    click.echo(f"Run from the same starts: {ran}." if ran else "", nl=bool(ran))


def _row(noisy: bool, name: str, size: int, fast: int, share: float, *rest: float | None) -> list[str]:
    said = percent(share) if share >= -1 else "worse than standing still"
    said = said if fast >= LEAST else "slow: cannot be judged"
    return [name, f"{fast} of {size}" if noisy else str(size), said, *(number(one, "{:.4g}") for one in rest)]


def _long_enough(demonstrations: Sequence[uc.Demonstration]) -> list[uc.Demonstration]:
    """Those that are, with the noise of their actions, :data:`ENOUGH` of which may be half a usual one."""
    if not (enough := [one for one in demonstrations if len(one) >= LEAST]):
        raise InvalidDataError(f"no demonstration has {LEAST} samples or more: nothing to score. Trim less of them.")
    half = 0.5 * (uc.stack(enough).actions ** 2).sum(axis=1).mean() ** 0.5
    return [one if one.noise is None else replace(one, noise=_judged(one.noise, half)) for one in enough]


def _judged(noise: Any, half: float) -> Any:
    """Noise, of which as many as turn a direction are half a usual action at most, but for what is more itself."""
    turned = uc.evaluation.metrics.TURNED
    return noise.clip(max=max(half / turned, float((noise**2).mean() ** 0.5) * ENOUGH / turned))


def _moved(moving: Any, demonstrations: list[uc.Demonstration]) -> tuple[list[uc.Demonstration], list[str]]:
    """Those that move, or all where none does; and the names of the others, which have no score."""
    poor = [one for one in demonstrations if explained(moving, [one]) < -1]
    few = uc.evaluation.verdicts.SMALL**2
    poor = [one for one in poor if support_of(innermost(moving), one.states).mean() > uc.models.SUPPORTED]
    rest = [one.name for one in poor if (one.actions**2).sum() < few * (moving(one.states) ** 2).sum()]
    if rest:
        click.echo(f"Note: {listed(rest, 4)} hardly moved, beside what the policy does there: no score.", err=True)
    moved = [one for one in demonstrations if one.name not in rest]
    return (moved, rest) if moved else (demonstrations, [])


def _scores(moving: Any, held: Any, of: Sequence[uc.Demonstration], name: str) -> dict[str, Any]:
    slow = [0.0 if one.noise is None else uc.evaluation.metrics.TURNED**2 * (one.noise**2).mean() for one in of]
    kept = [(one.actions**2).sum(axis=1) >= least for one, least in zip(of, slow, strict=True)]
    fast = [one[rows] for one, rows in zip(of, kept, strict=True) if rows.any()]
    count = sum(map(len, fast))
    found = {"demonstration": name, "samples": sum(map(len, of)), "fast": count}
    found |= {"explains": explained(moving, fast if count >= LEAST else of), "ninc": None}
    with suppress(InvalidDataError):  # constant actions have no variance to normalise by
        found["ninc"] = uc.ninconsistency(moving, of)
    return found if held is None else found | {"npoe": uc.npoe(held, of), "ncpe": uc.ncpe(moving, of, held)}


def _motion(demonstrations: Sequence[uc.Demonstration]) -> Any:
    """Sum of squared actions of each."""
    import numpy as np

    return np.array([(one.actions**2).sum() for one in demonstrations])


def _known(shares: Any) -> list[float | None]:
    """With None for those that there are none of."""
    return [None if share != share else share for share in shares.tolist()]


def support_of(policy: uc.Policy, states: Any) -> Any:
    """How near data is to states (N, n), (N,); of a policy without kernels 1 within six standard deviations, else 0."""
    with suppress(SettingError):
        return policy.support(states)
    return policy.closed_form().support(states)


def _times(policy: uc.Policy, states: Any) -> float:
    """How many times as large states (N, n) are as what a policy learnt from, in the middle; 1 where not known."""
    import numpy as np

    try:
        form = policy.closed_form()
    except SettingError:
        return 1.0
    own = form.embedding(np.array(states))
    extents = np.log(np.ptp(own, axis=0) / (2 * form.reach) + 1e-300)
    sizes = np.log(np.abs(own).max(axis=0) / (np.abs(form.origin) + form.reach) + 1e-300)
    return float(np.exp(np.median(np.where(np.abs(sizes) < np.abs(extents), sizes, extents))))
