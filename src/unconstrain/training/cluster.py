"""Learning on many machines with dask: chunks to sums, and a tree of sums.

Each chunk is looked at where it is; what is chosen from all first looks (features, fields, folds) is sent back; each
chunk becomes moments, which add. No sample travels, and a chunk whose worker dies is summed again by another. The
result is that of :meth:`~unconstrain.ParametricPolicy.fit`, to rounding. Needs the extra ``cluster``.

Examples
--------
>>> uc.cluster.check_learner(uc.Hybrid())  # sums are enough for it
>>> try:
...     uc.cluster.check_learner(uc.Likelihood())
... except uc.errors.SettingError as error:
...     print(error)
learner: Likelihood needs the samples, and a cluster sends their sums alone. Take Hybrid().
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial, reduce
from operator import add
from typing import Any, Protocol, Self, TypeVar

from ..base.arrays import require_extra
from ..base.errors import InvalidDataError, SettingError
from ..base.parameters import others_by_name
from .batches import Batch

FAN_IN = 8
"""So many results are added in one task."""


class Distributed(Protocol):
    """What can be fitted to parts wherever they are: a policy."""

    def fit_parts(self, parts: Sequence[Any], summed: Callable[..., Any]) -> Self:
        """Learn from parts; ``summed(function, parts)`` is the sum of the function at each."""
        ...


P = TypeVar("P", bound=Distributed)


@others_by_name
def fit(
    policy: P, X: Any, y: Any, *, sample_weight: Any | None = None, groups: Any | None = None, client: Any | None = None
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

    Examples
    --------
    >>> from dask.array import from_array
    >>> states = from_array(np.linspace(-1, 1, 9)[:, None], chunks=(3, 1))
    >>> uc.cluster.fit(uc.ParametricPolicy(uc.Affine(), "direct"), states, -2.0 * states).predict([[0.5]]).round(6)
    array([[-1.]])
    """
    delayed = require_extra("dask", "cluster").delayed
    columns = [_by_rows(array) for array in (X, y, sample_weight, groups)]
    chunks = {len(column) for column in columns if column is not None}
    if len(chunks) != 1:
        raise InvalidDataError(f"got arrays of {sorted(chunks)} chunks of rows, expected the same chunks in all.")
    rows = zip(*([None] * max(chunks) if column is None else column for column in columns), strict=True)
    return fit_batches(policy, [delayed(_one_batch)(*row) for row in rows], client=client)


def fit_batches(policy: P, parts: Sequence[Any], *, client: Any | None = None) -> P:
    """Fit a policy to parts that workers read for themselves.

    Parameters
    ----------
    policy : Policy
    parts : sequence
        Each an iterable of batches as :meth:`~unconstrain.ParametricPolicy.fit_batches` takes them, or a dask
        ``Delayed`` of one. ``stream.parts()`` of a :class:`~unconstrain.Stream` is one for each file; the workers need
        to see the files under the same names.
    client : distributed.Client, optional
        See :func:`fit`.

    Returns
    -------
    Policy
        The same, fitted; as it was, if anything fails.

    Raises
    ------
    InvalidDataError
        As ``fit`` does, and if there is no part.
    SettingError
        If the learner needs the samples, or the cluster gives up.
    MissingExtraError
        If dask is not installed.

    Examples
    --------
    >>> parts = [[([[x]], [[-2.0 * x]])] for x in (0.0, 0.5, 1.0)]  # one batch in each of three files
    >>> uc.cluster.fit_batches(uc.ParametricPolicy(uc.Affine(), "direct"), parts).predict([[0.5]]).round(6)
    array([[-1.]])
    """
    delayed = require_extra("dask", "cluster").delayed
    return policy.fit_parts([delayed(part, traverse=False) for part in parts], partial(_summed, client))


def openings(
    opened: Callable[[Any], list[Batch]], parts: Sequence[Any], summed: Callable[..., list[Batch]]
) -> Iterator[Batch]:
    """The first batches of each part in their order, fetched when needed, of twice as many parts each time."""
    start, count = 0, 1
    while start < len(parts):
        yield from summed(opened, parts[start : start + count])
        start, count = start + count, 2 * count


def check_learner(learner: Any) -> None:
    """Refuse a learner that needs the samples, by a SettingError."""
    if getattr(learner, "needs_samples", False):
        name = type(learner).__name__
        raise SettingError(f"learner: {name} needs the samples, and a cluster sends their sums alone. Take Hybrid().")


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


_CLUSTERS = ("dask", "distributed", "tornado")


def _summed(client: Any | None, function: Callable[[Any], Any], parts: Sequence[Any]) -> Any:
    """Sum of a function at each part, in a tree of neighbours; both go to the workers."""
    delayed = require_extra("dask", "cluster").delayed
    carried = delayed(function, traverse=False, pure=False)
    level = [carried(part) for part in parts]
    while True:
        level = [delayed(_added)(level[start : start + FAN_IN]) for start in range(0, len(level), FAN_IN)]
        if len(level) == 1:
            with _of_cluster():
                return level[0].compute() if client is None else client.compute(level[0]).result()


@contextmanager
def _of_cluster() -> Iterator[None]:
    """What the cluster itself raises becomes one sentence; errors of what it computes pass."""
    try:
        yield
    except Exception as error:
        kind = type(error)
        if kind.__module__.partition(".")[0] not in _CLUSTERS and not isinstance(error, CancelledError | TimeoutError):
            raise
        said = (str(error).splitlines() or [""])[0][:200]
        raise SettingError(
            f"scheduler: the cluster gave up ({kind.__name__}: {said}). Where workers died, give them more memory or "
            "smaller parts; where they were lost, start them again."
        ) from error


def _added(sums: Sequence[Any]) -> Any:
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
