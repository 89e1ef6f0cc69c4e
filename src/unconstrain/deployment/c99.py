"""One C99 file for a policy, with fixed sizes, no allocation and no state."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from ..base import files
from ..base.arrays import Array
from ..base.errors import SettingError
from ..models import ClosedForm

TOLERANCE = 1e-9
"""The self-test allows this share of the largest action: mathematics libraries differ in the last digit of ``exp``."""


SELF_TESTS = 16
"""States inside the data, and as many far outside, that the self-test of an exported file looks at."""

FAR = 100.0
"""How far outside, as a multiple of the policy's reach."""


def export_c(form: ClosedForm, policy: Callable[[Array], Array], path: str | os.PathLike[str], name: str) -> None:
    """Write :func:`c_source` to a file, with a self-test that compares it with the policy."""
    states = _probes(form)
    files.write(path, c_source(form, name, states, policy(states)))


def c_source(form: ClosedForm, name: str, states: Array, actions: Array) -> str:
    """C99 source of ``void NAME_step(const double state[n], double action[d])``.

    Constants are hexadecimal, so that no digit is lost. The file needs
    nothing but ``exp`` from the standard library. With ``NAME_SELF_TEST``
    defined, in capitals, it has a ``main`` that compares itself with the
    given actions.

    Parameters
    ----------
    form : ClosedForm
    name : str
        A C identifier.
    states, actions : ndarray, shape (K, n) and (K, d)
        What the self-test looks at, and what it expects there.

    Raises
    ------
    SettingError
        If the name is none in C.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise SettingError(f"name: got {name!r}, expected a name in C: a letter, then letters, digits, underscores.")
    n, d, models = form.sizes
    fill = {
        "name": name,
        "NAME": name.upper(),
        "macro": f"{name.upper()}_SELF_TEST",
        "version": _version(),
        "what": f"{n} states to {d} actions, {models} model{'s' * (models > 1)}",
        "n": str(n),
        "d": str(d),
        "models": str(models),
        "tests": str(len(states)),
        "origin": _braced(form.origin),
        "maps": _braced(form.maps if form.is_affine else form.maps[:, :, 0]),
        "slopes": "" if form.exponents is None else _braced(form.exponents),
        "test_states": _braced(states),
        "test_actions": _braced(actions),
        "tolerance": float(TOLERANCE * np.abs(actions).max()).hex(),
    }
    body = _AFFINE if form.exponents is None else _BLENDED_MAPS if form.is_affine else _BLENDED_CONSTANTS
    return re.sub(r"@([a-z_]+|NAME)@", lambda found: fill[found[1]], _HEAD + body + _SELF_TEST)


def _probes(form: ClosedForm) -> Array:
    """States for a self-test, inside and far outside, the same for the same policy."""
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * SELF_TESTS, len(form.origin)))
    drawn[SELF_TESTS:] *= FAR
    return form.origin + form.reach * drawn


def _braced(values: Array) -> str:
    """An initialiser, by rows."""
    if np.ndim(values) > 1:
        return "{\n" + ",\n".join(_braced(row) for row in values) + "}"
    # Adding zero makes a minus zero plain.
    return "{" + ", ".join((float(value) + 0.0).hex() for value in values) + "}"


def _version() -> str:
    try:
        return version("unconstrain")
    except PackageNotFoundError:
        return "from its sources"


_HEAD = """\
/*
 * @what@; written by unconstrain @version@.
 *
 *     void @name@_step(const double state[@n@], double action[@d@]);
 *
 * C99, needs only exp() of the standard library. No allocation, no state: safe in any number of threads.
 * The action may be written over the state. Finite for every finite state of sensible size; NaN gives NaN.
 *
 * Test: cc -std=c99 -O2 -D@macro@ FILE.c -lm -o test && ./test
 */
#include <math.h>

enum { @NAME@_STATES = @n@, @NAME@_ACTIONS = @d@, @NAME@_MODELS = @models@ };

#ifdef __cplusplus
extern "C"
#endif
void @name@_step(const double state[@n@], double action[@d@]);

static const double @NAME@_ORIGIN[@NAME@_STATES] = @origin@;

"""

_AFFINE = """\
/* The map, its constant in the last column. */
static const double @NAME@_MAP[@NAME@_MODELS][@NAME@_ACTIONS][@NAME@_STATES + 1] = @maps@;

void @name@_step(const double state[@n@], double action[@d@])
{
    double z[@NAME@_STATES];
    int i, k;

    for (i = 0; i < @NAME@_STATES; i++)
        z[i] = state[i] - @NAME@_ORIGIN[i];
    for (k = 0; k < @NAME@_ACTIONS; k++) {
        double sum = @NAME@_MAP[0][k][@NAME@_STATES];
        for (i = 0; i < @NAME@_STATES; i++)
            sum += @NAME@_MAP[0][k][i] * z[i];
        action[k] = sum;
    }
}
"""

_SHARES = """\
/* Exponents of the kernels are affine in the state; the constant is in the last column. */
static const double @NAME@_SLOPES[@NAME@_MODELS][@NAME@_STATES + 1] = @slopes@;

/* Shares of the models, not yet divided by their sum, which is returned. Relative to the largest: none overflows. */
static double @name@_shares(const double z[@NAME@_STATES], double share[@NAME@_MODELS])
{
    double largest, sum = 0.0;
    int i, m;

    for (m = 0; m < @NAME@_MODELS; m++) {
        double exponent = @NAME@_SLOPES[m][@NAME@_STATES];
        for (i = 0; i < @NAME@_STATES; i++)
            exponent += @NAME@_SLOPES[m][i] * z[i];
        share[m] = exponent;
    }
    largest = share[0];
    for (m = 1; m < @NAME@_MODELS; m++)
        if (share[m] > largest)
            largest = share[m];
    for (m = 0; m < @NAME@_MODELS; m++) {
        share[m] = exp(share[m] - largest);
        sum += share[m];
    }
    return sum;
}

"""

_BLENDED_CONSTANTS = (
    _SHARES
    + """\
/* What each model says. */
static const double @NAME@_CONSTANTS[@NAME@_MODELS][@NAME@_ACTIONS] = @maps@;

void @name@_step(const double state[@n@], double action[@d@])
{
    double z[@NAME@_STATES], share[@NAME@_MODELS], sum;
    int i, k, m;

    for (i = 0; i < @NAME@_STATES; i++)
        z[i] = state[i] - @NAME@_ORIGIN[i];
    sum = @name@_shares(z, share);
    for (k = 0; k < @NAME@_ACTIONS; k++)
        action[k] = 0.0;
    for (m = 0; m < @NAME@_MODELS; m++)
        for (k = 0; k < @NAME@_ACTIONS; k++)
            action[k] += share[m] * @NAME@_CONSTANTS[m][k];
    for (k = 0; k < @NAME@_ACTIONS; k++)
        action[k] /= sum;
}
"""
)

_BLENDED_MAPS = (
    _SHARES
    + """\
/* The map of each model, its constant in the last column. */
static const double @NAME@_MAPS[@NAME@_MODELS][@NAME@_ACTIONS][@NAME@_STATES + 1] = @maps@;

void @name@_step(const double state[@n@], double action[@d@])
{
    double z[@NAME@_STATES], share[@NAME@_MODELS], blend[@NAME@_ACTIONS][@NAME@_STATES + 1], sum;
    int i, k, m;

    for (i = 0; i < @NAME@_STATES; i++)
        z[i] = state[i] - @NAME@_ORIGIN[i];
    sum = @name@_shares(z, share);
    for (k = 0; k < @NAME@_ACTIONS; k++)
        for (i = 0; i <= @NAME@_STATES; i++)
            blend[k][i] = share[0] * @NAME@_MAPS[0][k][i];
    for (m = 1; m < @NAME@_MODELS; m++)
        for (k = 0; k < @NAME@_ACTIONS; k++)
            for (i = 0; i <= @NAME@_STATES; i++)
                blend[k][i] += share[m] * @NAME@_MAPS[m][k][i];
    for (k = 0; k < @NAME@_ACTIONS; k++) {
        double whole = blend[k][@NAME@_STATES];
        for (i = 0; i < @NAME@_STATES; i++)
            whole += blend[k][i] * z[i];
        action[k] = whole / sum;
    }
}
"""
)

_SELF_TEST = """\

#ifdef @macro@
#include <stdio.h>

enum { @NAME@_TESTS = @tests@ };

static const double @NAME@_TEST_STATES[@NAME@_TESTS][@NAME@_STATES] = @test_states@;
static const double @NAME@_TEST_ACTIONS[@NAME@_TESTS][@NAME@_ACTIONS] = @test_actions@;

int main(void)
{
    const double tolerance = @tolerance@;
    double action[@NAME@_ACTIONS], worst = 0.0;
    int k, t;

    for (t = 0; t < @NAME@_TESTS; t++) {
        @name@_step(@NAME@_TEST_STATES[t], action);
        for (k = 0; k < @NAME@_ACTIONS; k++) {
            const double error = fabs(action[k] - @NAME@_TEST_ACTIONS[t][k]);
            if (!(error <= worst)) /* NaN, too, is worse */
                worst = error;
        }
    }
    printf("largest error %.3g, tolerance %.3g\\n", worst, tolerance);
    return worst <= tolerance ? 0 : 1;
}
#endif
"""
