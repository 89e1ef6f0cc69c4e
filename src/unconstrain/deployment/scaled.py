"""A policy and the scaler before it, such as those of a pipeline, as one formula."""

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ..base.errors import SettingError
from ..models import ClosedForm, Scale


class Scaler(Protocol):
    """What shifts and scales the states before a policy sees them, such as scikit-learn's ``StandardScaler``."""

    def transform(self, X: Any, /) -> Any:
        """From states (N, n) to what the policy sees (N, n)."""


def scaled(form: ClosedForm, scaler: Scaler) -> ClosedForm:
    """Closed form of ``policy(scaler.transform(states))``.

    Raises
    ------
    SettingError
        If the scaler does anything else than to shift and scale each column, states hold angles.
    """
    n = form.columns
    if form.embedding.frame is not None:
        raise SettingError("scaler: the policy's states hold angles or orientations, which no scaler may change.")
    at = np.concatenate([np.zeros((1, n)), np.eye(n), np.random.default_rng(0).uniform(-3.0, 3.0, (8, n))])
    found = np.asarray(scaler.transform(at))
    shift, slopes = found[0], np.diag(found[1 : n + 1] - found[0]) if found.shape == at.shape else np.zeros(n)
    if not (slopes != 0.0).all() or not np.allclose(found, at * slopes + shift):
        name = type(scaler).__name__
        raise SettingError(f"scaler: {name} does more than to shift and scale each of {n} states. Export without it.")
    outer = Scale(1.0 / slopes, np.ones(form.sizes[1])).form(form)
    return replace(outer, origin=outer.origin - shift / slopes, reach=np.abs(outer.reach))
