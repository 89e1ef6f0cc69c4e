"""Learning on many machines with dask: chunks to moments, and a tree of sums.

Each chunk is looked at where it is; what is chosen from all first looks
(features, fields, folds) is sent back; each chunk becomes moments, which
add. No sample travels, and a chunk whose worker dies is summed again by
another. The result is that of :meth:`~unconstrain.ParametricPolicy.fit`, to
rounding. Needs the extra ``cluster``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import reduce
from operator import add
from typing import Any, TypeVar

from sklearn.base import clone

from .base.arrays import require_extra
from .base.errors import InvalidDataError, SettingError
from .learners import SampleLearner
from .policies import Policy
from .recordings import Batch, FirstLook
from .training import FoldedMoments

__all__ = ["FAN_IN", "check_learner", "connected", "fit", "fit_batches"]

FAN_IN = 8
"""So many results are added in one task."""

P = TypeVar("P", bound=Policy)


def fit(
    policy: P, X: Any, y: Any, sample_weight: Any | None = None, groups: Any | None = None, *, client: Any | None = None
) -> P:
    """Fit a policy to dask arrays, chunk by chunk, where the chunks are.

    Parameters
    ----------
    policy : Policy
    X : dask array, shape (N, n)
        Its chunks of rows are what is summed at a time; a hundred thousand rows or more are good.
    y : dask array, shape (N, d) or (N,)
    sample_weight, groups : dask array, shape (N,), optional
        As :meth:`~unconstrain.ParametricPolicy.fit` takes them.
    client : distributed.Client, optional
        Where to compute; by default where dask does, such as on the client that was made last.

    Returns
    -------
    Policy
        The same, fitted.

    Raises
    ------
    InvalidDataError
        As ``fit`` does, and if the chunks do not match.
    MissingExtraError
        If dask is not installed.
    """
    delayed = require_extra("dask", "cluster").delayed
    columns = [_by_rows(array) for array in (X, y, sample_weight, groups)]
    chunks = {len(column) for column in columns if column is not None}
    if len(chunks) != 1:
        raise InvalidDataError(f"got arrays of {sorted(chunks)} chunks of rows, expected the same chunks in all.")
    rows = zip(*([None] * max(chunks) if column is None else column for column in columns), strict=True)
    return fit_batches(policy, [delayed(_one_batch)(*row) for row in rows], client=client)


def check_learner(policy: Policy) -> None:
    """Refuse a learner that needs the samples.

    Raises
    ------
    SettingError
        If it does.
    """
    if isinstance(policy.learner, SampleLearner):
        name = type(policy.learner).__name__
        raise SettingError(f"learner: {name} needs the samples, and a cluster sends their sums alone. Take Hybrid().")


def fit_batches(policy: P, parts: Sequence[Any], *, client: Any | None = None) -> P:
    """Fit a policy to parts that workers read for themselves.

    Parameters
    ----------
    policy : Policy
    parts : sequence
        Each an iterable of batches as :meth:`~unconstrain.ParametricPolicy.fit_batches`
        takes them, or a dask ``Delayed`` of one. ``stream.parts()`` of a
        :class:`~unconstrain.Stream` is one for each file; the workers need
        to see the files under the same names.
    client : distributed.Client, optional
        See :func:`fit`.

    Returns
    -------
    Policy
        The same, fitted.

    Raises
    ------
    InvalidDataError
        As ``fit`` does, and if there is no part.
    SettingError
        If the learner needs the samples.
    MissingExtraError
        If dask is not installed.
    """
    check_learner(policy)
    delayed = require_extra("dask", "cluster").delayed
    if not parts:
        raise InvalidDataError("got no part to learn from, expected at least one.")
    plain = clone(policy)
    wrapped = [delayed(part, traverse=False) for part in parts]
    looks = [delayed(_look)(delayed(plain, traverse=False), part) for part in wrapped]
    look, checked = _computed(_tree(delayed(_looks_added), looks), client)
    policy._forget()
    policy.__dict__.update(checked)
    policy._begin(look, more=False)
    begun = copy(policy)
    del begun._folds  # zeros, which need not travel
    sums = [delayed(_sum)(delayed(begun, traverse=False), part) for part in wrapped]
    policy._folds = _computed(_tree(delayed(_added), sums), client)
    policy._conclude()
    return policy


def connected(address: str, timeout_s: float = 10.0) -> Any:
    """Return a client of the scheduler at an address, such as ``tcp://10.0.0.1:8786``; a context manager.

    Raises
    ------
    MissingExtraError
        If ``distributed`` is not installed.
    SettingError
        If nothing answers there.
    """
    distributed = require_extra("distributed", "cluster")
    try:
        return distributed.Client(address, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SettingError(
            f"scheduler: nothing answers at {address!r} ({error}). Expected an address such as tcp://10.0.0.1:8786."
        ) from error


_Checked = tuple[FirstLook | None, dict[str, Any]]


def _look(policy: Policy, part: Iterable[Sequence[Any]]) -> _Checked:
    """First look at a part, and what the policy noted when it checked it."""
    fresh = clone(policy)
    look = FirstLook.total(map(FirstLook.at, fresh._each_checked(part)))
    return look, {name: value for name, value in vars(fresh).items() if name not in vars(policy)}


def _looks_added(looks: Sequence[_Checked]) -> _Checked:
    whole = FirstLook.total(look for look, _ in looks)
    return whole, next((checked for look, checked in looks if look is not None), {})


def _sum(begun: Policy, part: Iterable[Sequence[Any]]) -> FoldedMoments:
    mine = copy(begun)
    return mine._summed(mine._checked(*batch, reset=False) for batch in part)


def _added(sums: Sequence[FoldedMoments]) -> FoldedMoments:
    return reduce(add, sums)


def _one_batch(*row: Any) -> list[Batch]:
    return [Batch(*row)]


def _by_rows(array: Any | None) -> list[Any] | None:
    """Chunks of rows, each with all its columns."""
    if array is None:
        return None
    if not hasattr(array, "to_delayed"):
        raise InvalidDataError(f"got {type(array).__name__}, expected dask arrays; others are for policy.fit.")
    whole = array if array.ndim == 1 else array.rechunk({1: -1})
    chunks: list[Any] = whole.to_delayed().ravel().tolist()
    return chunks


def _tree(combine: Callable[[list[Any]], Any], parts: list[Any]) -> Any:
    """Combine neighbours until one is left, in their order."""
    level = parts
    while True:
        level = [combine(level[start : start + FAN_IN]) for start in range(0, len(level), FAN_IN)]
        if len(level) == 1:
            return level[0]


def _computed(delayed: Any, client: Any | None) -> Any:
    return delayed.compute() if client is None else client.compute(delayed).result()
