"""The steps of ``unconstrain fit``: where to write, which policy, where to compute."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SettingError

if TYPE_CHECKING:  # everything heavy is imported by the function that needs it
    from ..policies import Policy
    from ..streams import Stream

__all__ = ["MODELS", "check_writable", "learn", "policy_of"]

MODELS = ("local", "rbf", "linear")


def check_writable(outputs: Sequence[str | None], paths: Sequence[str]) -> None:
    """Refuse to write over what is read, or where there is no folder."""
    for written in filter(None, outputs):
        if Path(written).resolve() in {Path(path).resolve() for path in paths}:
            raise SettingError(f"{written}: is one of the files to learn from; give another name to write to.")
        if not Path(written).absolute().parent.is_dir():
            raise SettingError(f"{written}: cannot be written, its folder does not exist.")


def policy_of(model: str, variance: float | None, centres: int | None, **chosen: Any) -> Policy:
    """Make the policy that the options say."""
    from .. import features, policies

    for option, value, needed in (("--variance", variance, "local"), ("--centres", centres, "rbf")):
        if value is not None and model != needed:
            raise SettingError(f"{option}: belongs to --model {needed}, got --model {model}.")
    if model == "local":
        return policies.LocallyLinearPolicy(variance, **chosen)
    shape = features.KMeansRBF(centres or 25) if model == "rbf" else features.Affine()
    return policies.ParametricPolicy(shape, **chosen)


def learn(policy: Policy, stream: Stream, scheduler: str | None) -> None:
    """Fit here, or on the cluster of a scheduler."""
    if scheduler is None:
        policy.fit_batches(stream)
        return
    from .. import cluster

    with cluster.connected(scheduler) as client:
        cluster.fit_batches(policy, stream.parts(), client=client)
