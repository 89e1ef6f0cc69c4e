"""What scikit-learn checks of states, in our words."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import validate_data

from .arrays import Array, as_matrix, is_foreign
from .errors import InvalidDataError


def checked_states(estimator: Any, X: ArrayLike, *, reset: bool = False, convert: bool = True) -> Array:
    """States (N, n), finite, with the names and the number of columns that the estimator was fitted to.

    Raises
    ------
    InvalidDataError
        If they are anything else.
    """
    if not reset and _is_plain(estimator, X):
        return as_matrix(X, "states", convert=convert)
    if isinstance(X, list | tuple | np.ma.MaskedArray):
        X = as_matrix(X, "states")  # our words for ragged rows, and for what is masked
    try:
        # scikit-learn checks names, sparse input and the number of columns; the numbers are ours to check.
        kind = np.float64 if convert else "numeric"
        if is_foreign(X):
            table = as_matrix(X, "states", convert=convert)
            validate_data(estimator, table, reset=reset, skip_check_array=True)
            return table
        table = validate_data(estimator, X, reset=reset, dtype=kind, ensure_all_finite=False)
    except ValueError as error:
        raise InvalidDataError(str(error)) from error
    return as_matrix(table, "states", convert=convert)


def _is_plain(estimator: Any, X: Any) -> bool:
    """Whether there is nothing that scikit-learn would say, in half a millisecond, of a table."""
    if type(X) is not np.ndarray or X.dtype != np.float64 or X.ndim != 2 or not len(X):
        return False
    return X.shape[1] == getattr(estimator, "n_features_in_", None) and not hasattr(estimator, "feature_names_in_")
