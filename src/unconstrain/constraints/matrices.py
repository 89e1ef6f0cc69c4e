"""From a constraint to its matrices at given states, checked."""

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from ..base.arrays import Array
from ..base.errors import InvalidDataError, SettingError


class _UnknownTimes(NDArrayOperatorsMixin):
    """Stands where nobody recorded the times: it has a length, and whoever reads a value is refused."""

    def __init__(self, length: int, name: str) -> None:
        self.shape, self.size, self.ndim, self._name = (length,), length, 1, name

    def __len__(self) -> int:
        return self.shape[0]

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        of = repr(self._name) if self._name else "a demonstration"
        raise InvalidDataError(
            f"{of} has no times, and the constraint depends on them: expected one time for each sample, in seconds."
        )

    __array__ = __array_ufunc__ = __array_function__ = __getitem__ = __iter__ = __float__ = _refuse

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("_"):
            raise AttributeError(name)
        self._refuse()


def constraint_matrices(
    constraint: Callable[[Array, Array], Array], states: Array, times: Array | None, dimensions: int, name: str = ""
) -> Array:
    """A(x, t) at each state.

    Parameters
    ----------
    constraint : callable
        States (T, n) and times (T,) to matrices (T, k, d).
    states : ndarray, shape (T, n)
    times : ndarray, shape (T,), or None
        Seconds. None where nobody recorded them: constraints that do not read them work all the same.
    dimensions : int
        d, that of the actions.
    name : str
        Of the demonstration, for the error message.

    Returns
    -------
    ndarray, shape (T, k, d)

    Raises
    ------
    InvalidDataError
        If the constraint reads times that are unknown.
    SettingError
        If it does not return one matrix for each state, with d columns.
    """
    # The type of a constraint promises it an array; what stands for one says in words what is missing.
    clock: Any = _UnknownTimes(len(states), name) if times is None else times
    matrices = np.asarray(constraint(states, clock))
    if matrices.ndim != 3 or matrices.shape[::2] != (len(states), dimensions):
        raise SettingError(
            f"constraint: got A of shape {matrices.shape} for {len(states)} states, "
            f"expected ({len(states)}, k, {dimensions})."
        )
    return matrices
