"""The steps of ``unconstrain fit``: which policy and learner, where to compute."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal

import click

import unconstrain as uc

from ..base.errors import SettingError
from ..base.files import stem
from .printing import doubt_degrees, of_option
from .reading import check_enough, numbers, of_words, recordings_of, with_options

CENTRES = 25

MODELS: dict[str, Callable[..., uc.Policy]] = {
    "local": lambda **chosen: uc.LocallyLinearPolicy(**chosen),
    "rbf": lambda centres=CENTRES, **chosen: uc.ParametricPolicy(uc.KMeansRBF(centres), **chosen),
    "auto": lambda **chosen: uc.ParametricPolicy("auto", **chosen),
    "affine": lambda **chosen: uc.ParametricPolicy(uc.Affine(), **chosen),
    "quadratic": lambda **chosen: uc.ParametricPolicy(uc.Polynomial(2), **chosen),
    "cubic": lambda **chosen: uc.ParametricPolicy(uc.Polynomial(3), **chosen),
    "linear": lambda **chosen: uc.ParametricPolicy(uc.Affine(), **chosen),  # the former name of "affine"
}
"""Policies by name, of settings of their own and of what every policy has: learner and validation."""


def scale_of(text: str) -> str | tuple[float, ...] | None:
    """Numbers, auto, or None."""
    with suppress(click.BadParameter):
        return {"auto": "auto", "none": None}[text] if text in ("auto", "none") else numbers(text)
    raise click.BadParameter(f"got {text!r}, expected auto, none, or numbers separated by commas, such as 1000,1.")


def _levelled(_: click.Context, __: click.Parameter, scale: Any) -> Any:
    """Warn of no mixed units where a scale is given, which is what cures them."""
    if scale is not None:
        warnings.filterwarnings("ignore", "mixed-units", UserWarning)
    return scale


LEVELS: dict[str, Any] = {"type": scale_of, "default": "none", "metavar": "AUTO|NONE|A,B,...", "callback": _levelled}

options_for_model = with_options(
    of_words("--model", " ".join(MODELS), "Model of the policy; auto takes that of least estimated error.", "local"),
    click.option(
        "--variance",
        type=float,
        help="Local: σ² of the fields, squared unit of the states; inf for one model; by default chosen.",
    ),
    click.option("--centres", type=click.IntRange(1), help=f"RBF: number of kernels; {CENTRES} by default."),
    click.option(
        "--scale", **LEVELS, help="What counts as one of each state, such as 1000,1 for mm beside rad; auto finds it."
    ),
)
"""Options that choose the model of the policy."""


def alpha_of(text: str) -> float | Literal["auto"]:
    """A number, or auto."""
    try:
        return "auto" if text == "auto" else float(text)
    except ValueError:
        raise click.BadParameter(f"got {text!r}, expected a number or auto.") from None


def default_learner(
    scheduler: str | None, alpha: float | Literal["auto"] | None, softness: float | None, speed_power: float
) -> str:
    """The learner where none is named."""
    of_sums = scheduler is not None or alpha is not None or softness is not None or speed_power
    return "hybrid" if of_sums else "robust"


def learner_of(
    name: str, alpha: float | Literal["auto"] | None, softness: float | None, speed_power: float, jacobian: Any = None
) -> Any:
    """Make the learner of the options."""
    if jacobian is not None and name != "robust":
        raise SettingError(f"--jacobian: belongs to the robust learner, got --learner {name}.")
    if name == "robust" and speed_power:
        raise SettingError("--speed-power: the robust learner weights by speed itself; give another --learner with it.")
    given = {key: value for key, value in (("alpha", alpha), ("softness", softness)) if value is not None}
    if name != "hybrid":
        if given:
            raise SettingError(f"--{next(iter(given))}: belongs to the hybrid learner, got --learner {name}.")
        if name == "robust":
            return uc.Robust(jacobian=jacobian)
        return uc.Direct() if name == "direct" else uc.Inconsistency()
    if alpha is not None and softness:
        raise SettingError(
            "--alpha: got --softness too, expected one of them; a softened split has no threshold to choose."
        )
    # A softened split needs no threshold on top.
    return uc.Hybrid(**given, threshold=0.0 if softness else None)  # type: ignore[arg-type]


def policy_of(model: str, variance: float | None, centres: int | None, scale: Any, **chosen: Any) -> uc.Policy:
    """Make the policy of the options."""
    for option, value, needed in (("variance", variance, "local"), ("centres", centres, "rbf")):
        if value is not None and model != needed:
            raise SettingError(f"--{option}: belongs to --model {needed}, got --model {model}.")
        if value is not None:
            chosen[option] = value
    return MODELS[model](scale=scale, **chosen)


def guide_of(text: str) -> str | tuple[float, ...]:
    """To what a policy is guided: auto, cycle, or a goal."""
    return text if text in ("auto", "cycle") else numbers(text)


def guided(policy: uc.Policy, to: str | tuple[float, ...] | None, stream: uc.Stream) -> Any:
    """Keep a policy to a goal or a cycle; or leave it as it is."""
    if to is None:
        return policy
    with of_option("--guided"):
        return uc.Guided(policy, *_aim(to), demonstrations=stream.beginning())


def _aim(to: str | tuple[float, ...]) -> tuple[Any, Literal["shown"] | None]:
    return None if isinstance(to, str) else to, "shown" if to == "cycle" else None


def learn(policy: uc.Policy, stream: uc.Stream, scheduler: str | None, to: Any) -> uc.Policy:
    """Fit here or on a cluster, if there is a goal; of "auto" and the default take what explains more held out."""
    if to is not None:
        with of_option("--guided"):
            uc.Guided.goes_round(stream.beginning(), *_aim(to))
        doubt_degrees("--guided", () if isinstance(to, str) else to, stream.recipe)
    if scheduler is None:
        policy.fit_batches(stream)
        check_enough(stream.beginning())
    else:
        uc.cluster.check_learner(policy.learner)  # before anybody is waited for
        if stream.leave_out - {stem(path) for path in stream.paths}:  # workers know their own files only
            came = [one.name for one in recordings_of(stream, stream.recipe)]
            uc.readers.check_left_out(sorted(stream.leave_out), came)
        with uc.cluster.connected(scheduler) as client:
            uc.cluster.fit_batches(policy, stream.parts(), client=client)
    if getattr(policy, "features", None) != "auto":
        return policy
    same = {name: getattr(policy, name) for name in ("learner", "validation", "scale")}
    usual = learn(uc.LocallyLinearPolicy(**same), stream, scheduler, None)
    return usual if usual.held_out_score() > policy.held_out_score() + 1e-6 else policy  # more than by rounding
