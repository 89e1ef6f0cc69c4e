"""Shapes, checks at the door, other array libraries, and optional imports.

Letters used in shapes throughout: ``T`` samples of one demonstration, ``N`` samples in all, ``n`` state dimensions,
``d`` action dimensions, ``p`` features, ``P = d p`` weights, ``M`` models (receptive fields; 1 when global).

The mathematics is written in terms of the array API standard: ``xp`` is the library that an array belongs to, and is
NumPy for everything that is no array of another library. Such an array stays on its device.
"""

import importlib
import math
from collections.abc import Hashable, Iterator, Sequence
from contextlib import suppress
from numbers import Integral
from types import ModuleType
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidDataError, MissingExtraError, SettingError

Array = NDArray[np.float64]

Groups = Sequence[Hashable] | NDArray[np.generic]
"""Which demonstration each sample is from: a name or number for each."""

LARGEST = 1e30
"""Numbers beyond this are refused: fillers for missing values are, and products of several must stay finite."""

BLOCK_ROWS = 2**16
"""Rows of large tables that are read, checked and summed together."""

SMALLEST_VARIANCE = 1e-100
"""Variances down to this are refused, and states that spread less count as one: their squares lose digits."""


def is_foreign(values: Any) -> bool:
    """Whether this is an array of another library than NumPy that follows the array API standard."""
    if isinstance(values, np.ndarray | np.generic):
        return False
    kind = type(values)
    return hasattr(kind, "__array_namespace__") or kind.__module__.partition(".")[0] in _WRAPPED


_WRAPPED = ("torch", "cupy")
"""Libraries whose arrays need ``array_api_compat`` to follow the standard."""


def namespace(array: Any) -> Any:
    """The library of an array, with the functions of the array API standard: NumPy unless it is another's.

    Raises
    ------
    MissingExtraError
        If it is another's and ``array_api_compat`` is not installed.
    """
    return require_extra("array_api_compat", "arrays").array_namespace(array) if is_foreign(array) else np


def beside(values: NDArray[Any], like: Any) -> Any:
    """The same numbers in the library and on the device of another array; unchanged where that is NumPy."""
    if not is_foreign(like):
        return values
    return namespace(like).asarray(np.array(values), device=like.device)


def on_host(array: Any) -> NDArray[Any]:
    """The same numbers as a NumPy array; unchanged where it is one."""
    if not is_foreign(array):
        return np.asarray(array)
    for leave in ("cpu", "get"):  # of PyTorch, of CuPy
        if hasattr(array, leave):
            return np.asarray(getattr(array, leave)())
    return np.asarray(array)


def as_numbers(values: ArrayLike, what: str, convert: bool = True) -> Array:
    """Numbers of any shape as float64, NaN where masked; raises InvalidDataError if ragged, complex or none."""
    if is_foreign(values):
        return _foreign_as_numbers(values, what, convert)
    try:
        raw = np.ma.filled(values.astype(float), np.nan) if np.ma.isMaskedArray(values) else np.asarray(values)
    except ValueError as error:  # NumPy's word for rows of different lengths
        raise InvalidDataError(f"{what}: the rows have different lengths, expected a rectangular table.") from error
    if raw.dtype.kind == "c":
        raise InvalidDataError(f"{what}: complex data not supported, expected real numbers.")
    if not convert and raw.dtype.kind in "fiu":
        return raw
    try:
        return raw.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise InvalidDataError(f"{what}: got values that are not numbers ({error}).") from error


def as_seconds(values: Any, what: str) -> Array:
    """Time stamps (T,) as seconds; of dates, of NumPy, pandas or Python, those from the first on."""
    raw = np.asarray(values)
    if raw.dtype.kind == "O":
        with suppress(TypeError, AttributeError):  # numbers are no dates
            raw = np.array([(one - raw.flat[0]).total_seconds() for one in raw.flat])
    raw = raw - raw.flat[:1] if raw.dtype.kind == "M" else raw
    return as_numbers(raw / np.timedelta64(1, "s") if raw.dtype.kind == "m" else raw, what)


def as_matrix(values: ArrayLike, what: str, *, convert: bool = True) -> Array:
    """Check a table of finite numbers and return it as a float64 array.

    Parameters
    ----------
    values : array_like, shape (N, k)
        Any real numbers: lists, integers, float32, read-only, non-contiguous.
    what : str
        What the table is, for the error message, such as ``"states of 'demo_3'"``.
    convert : bool
        Without it, the numbers are checked and stay of their type: an array that is mapped from a file is not copied.

    Returns
    -------
    ndarray, shape (N, k)
        The same numbers; a view where no conversion was needed.

    Raises
    ------
    InvalidDataError
        If it is ragged, not two-dimensional, empty, or holds NaN, infinity or a
        number beyond :data:`LARGEST`; the message names the row and the column.
    """
    matrix = as_numbers(values, what, convert)
    if matrix.ndim != 2:
        raise InvalidDataError(
            f"{what}: got an array of shape {tuple(matrix.shape)}, expected two dimensions (samples, columns). "
            "Reshape your data: one row for each sample."
        )
    if 0 in matrix.shape:
        raise InvalidDataError(
            f"{what}: got an empty array of shape {tuple(matrix.shape)}, expected at least one row and one column."
        )
    return _finite(matrix, what)


def as_table(values: ArrayLike, what: str, *, convert: bool = True) -> tuple[Array, bool]:
    """Check a table, or a vector as a table of one column, and say whether it was a vector.

    Returns
    -------
    table : ndarray, shape (N, k)
    flat : bool

    Raises
    ------
    InvalidDataError
        As :func:`as_matrix` does.
    """
    array = as_numbers(values, what, convert)
    flat = array.ndim == 1
    return as_matrix(array[:, None] if flat else array, what, convert=convert), flat


def as_vector(values: ArrayLike, what: str, length: int | None = None) -> Array:
    """Check a vector of finite numbers, of a given length if one is given.

    Raises
    ------
    InvalidDataError
        If it is ragged, not one-dimensional, of the wrong length, or holds NaN or infinity.
    """
    vector = as_numbers(on_host(values) if is_foreign(values) else values, what)
    if vector.ndim != 1:
        raise InvalidDataError(f"{what}: got an array of shape {vector.shape}, expected one dimension.")
    if length is not None and len(vector) != length:
        raise InvalidDataError(f"{what}: got {len(vector)} values, expected {length}.")
    return _finite(vector, what)


def as_weights(values: ArrayLike | None, length: int) -> Array:
    """Sample weights: ones if None, otherwise finite and not negative, shape (N,).

    Raises
    ------
    InvalidDataError
        If the number is wrong or one of them is negative.
    """
    if values is None:
        return np.ones(length)
    weights = as_vector(values, "sample_weight", length)
    if (weights < 0).any():
        row = int(np.argmax(weights < 0))
        raise InvalidDataError(f"sample_weight: got {weights[row]} at row {row}, expected no negative weight.")
    return weights


def as_groups(values: Sequence[Hashable] | NDArray[np.generic], length: int) -> NDArray[np.generic]:
    """Check names or numbers of demonstrations, one for each sample, shape (N,).

    Raises
    ------
    InvalidDataError
        If the number is wrong, or one of them is missing or cannot be compared with the others.
    """
    try:
        names = on_host(values)
    except ValueError as error:  # NumPy's word for rows of different lengths
        raise InvalidDataError(f"groups: the values are of different lengths, expected {length} names.") from error
    if names.shape != (length,):
        raise InvalidDataError(f"groups: got an array of shape {names.shape}, expected {length}, one for each sample.")
    if names.dtype.kind == "f" and np.isnan(names).any():
        raise InvalidDataError(
            f"groups: found nan at row {int(np.isnan(names).argmax())}, expected a name or a number."
        )
    if names.dtype.kind not in "iufbUO":  # bytes, dates and complex numbers are names as they are written
        written = [one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one) for one in names.tolist()]
        return np.array(written, dtype=np.str_)
    if names.dtype.kind == "O":
        try:
            np.unique(names)
        except TypeError as error:
            raise InvalidDataError(
                f"groups: got values that cannot be compared ({error}), expected names or numbers, none missing."
            ) from error
    return names


def slices(table: Any, rows: int) -> Iterator[slice]:
    """Slices that go through a table by so many rows at a time, the last by what is left."""
    samples = table.shape[0]
    return (slice(start, min(start + rows, samples)) for start in range(0, samples, rows))


def power_of_two(size: float) -> float:
    """The largest power of two up to a size; 1 for zero. Dividing by it costs no digit."""
    return math.ldexp(1.0, math.frexp(size)[1] - 1) if size > 0.0 else 1.0


def check_at_least(name: str, value: Any, least: float, *, strict: bool = False, whole: bool = False) -> None:
    """Check that a numeric setting is finite, not below a bound and, on demand, a whole number.

    Raises
    ------
    SettingError
        If it is no number, not finite, below ``least`` (at it, when ``strict``) or not whole.
    """
    try:
        good = bool(np.isfinite(value)) and bool(value > least if strict else value >= least)
    except (TypeError, ValueError):
        good = False
    if whole and not isinstance(value, Integral):
        good = False
    if not good:
        kind, bound = "a whole number" if whole else "a number", "above" if strict else "of at least"
        raise SettingError(f"{name}: got {value!r}, expected {kind} {bound} {least}.")


def require_extra(module: str, extra: str) -> ModuleType:
    """Import an optional dependency, or say which extra brings it.

    Parameters
    ----------
    module : str
        Dotted name of the module to import.
    extra : str
        The extra of this package that installs it.

    Raises
    ------
    MissingExtraError
        If the module is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f"this needs {module.partition('.')[0]!r}, which is not installed. "
            f"Install it with: pip install 'unconstrain[{extra}]'"
        ) from error


def _foreign_as_numbers(values: Any, what: str, convert: bool) -> Any:
    xp = namespace(values)
    if not xp.isdtype(values.dtype, ("real floating", "integral")):
        raise InvalidDataError(f"{what}: got values of type {values.dtype}, expected real numbers.")
    return xp.asarray(values, dtype=xp.float64) if convert else values


def _finite(values: Array, what: str) -> Array:
    if all(_is_sensible(values[rows, ...]) for rows in slices(values, BLOCK_ROWS)):
        return values
    return _refuse(on_host(values).astype(np.float64, copy=False), what)


def _is_sensible(block: Array) -> bool:
    # A sum of squares that is small enough says it of each, at a fraction of the price; NaN and infinity are not.
    xp = namespace(block)
    doubles = xp.asarray(block, dtype=xp.float64)
    if xp is np and (doubles.flags.c_contiguous or doubles.flags.f_contiguous):
        flat = doubles.ravel(order="K")
        with np.errstate(over="ignore", invalid="ignore"):
            if np.einsum("i,i->", flat, flat) <= LARGEST**2:  # without waking BLAS' threads
                return True
    return bool(xp.all(xp.abs(doubles) <= LARGEST))


def check_learnt(learnt: ArrayLike) -> None:
    """Refuse what was learnt where it is not finite, before it is kept, saved or exported.

    Raises
    ------
    InvalidDataError
        If anything in it is NaN or infinity.
    """
    bad = np.count_nonzero(~np.isfinite(on_host(learnt)))
    if bad:
        raise InvalidDataError(
            f"what was learnt is not finite: NaN or infinity in {bad} of {np.size(learnt)} weights, so it is neither "
            "kept, saved nor exported. Take units in which states, actions and sample weights are nearer to 1."
        )


def _refuse(values: Array, what: str) -> NoReturn:
    bad = ~np.isfinite(values)
    if bad.any():
        where = np.argwhere(bad)
        raise InvalidDataError(
            f"{what}: found {values[tuple(where[0])]} at {_place(where[0])} (NaN or infinity in {len(where)} places), "
            "expected finite numbers. Remove or repair these rows first."
        )
    where = np.argwhere(np.abs(values) > LARGEST)
    raise InvalidDataError(
        f"{what}: found {values[tuple(where[0])]} at {_place(where[0])}, expected numbers up to {LARGEST}. "
        "Repair this row or take other units."
    )


def _place(index: NDArray[np.intp]) -> str:
    return ", ".join(f"{axis} {number}" for axis, number in zip(("row", "column"), index, strict=False))
