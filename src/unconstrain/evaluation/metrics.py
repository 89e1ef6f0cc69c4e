"""How far a policy is from the truth, or from what was observed.

Each error is the quadratic of :mod:`unconstrain.risks.moments` at the difference
π − π̃, with another metric: ``P = I`` (UPE), ``P = N`` (CPE) and ``P = ûûᵀ``
(inconsistency), so that always inconsistency ≤ CPE ≤ UPE. Normalised errors
are divided by the number of samples and the variance of the policy, summed
over its coordinates (section IV-A).

Where the truth is not known, the observed action takes the place of Nπ, and
its variance that of the policy's.

Examples
--------
>>> demonstration = uc.Demonstration([[0.0], [1.0]], [[1.0], [3.0]])
>>> uc.metrics.inconsistency(lambda x: np.ones_like(x), demonstration)
4.0
"""

from collections.abc import Callable, Sequence

import numpy as np

from ..base.arrays import Array
from ..base.errors import InvalidDataError, SettingError
from ..constraints import Constraint, constraint_matrices
from ..learners import robust
from ..models import spaces
from ..recordings import Demonstration, stack
from ..risks import TURNED as TURNED
from ..risks import action_projection, null_space_projection, project, unit_actions
from ..risks import along_motion as along

PolicyLike = Callable[[Array], Array]
Demonstrations = Demonstration | Sequence[Demonstration]


def upe(policy: PolicyLike, demonstrations: Demonstrations) -> float:
    """Unconstrained policy error, ``Σ ‖π − π̃‖²``.

    Parameters
    ----------
    policy : callable
        States (N, n) to actions (N, d); a fitted policy is one.
    demonstrations : Demonstration or sequence of Demonstration
        With their truth.

    Raises
    ------
    InvalidDataError
        If a demonstration has no truth.
    SettingError
        If the policy does not return one action for each state.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.upe(lambda x: np.zeros_like(x), demonstration)
    15.0
    """
    demos = _listed(demonstrations)
    predicted = _predicted(policy, demos)
    return _squares(_true_policy(demos) - predicted)


def cpe(policy: PolicyLike, demonstrations: Demonstrations, constraint: Constraint | None = None) -> float:
    """Constrained policy error, ``Σ ‖N (π − π̃)‖² = Σ ‖u − N π̃‖²``.

    Parameters
    ----------
    policy, demonstrations
        As in :func:`upe`.
    constraint : callable, optional
        A(x, t) where no truth tells N, such as the plane that was wiped.

    Raises
    ------
    InvalidDataError
        If neither a truth nor a constraint tells the projection, or the constraint reads times that a demonstration
        does not have.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.cpe(lambda x: np.zeros_like(x), demonstration)
    10.0
    """
    demos = _listed(demonstrations)
    predicted = _predicted(policy, demos)
    projections = np.concatenate([_projections(demo, constraint) for demo in demos])
    return _squares(_constrained(demos, constraint) - project(projections, predicted))


def inconsistency(policy: PolicyLike, demonstrations: Demonstrations) -> float:
    """Inconsistency, ``Σ ‖u − ûûᵀ π̃‖²`` (eq. 4). Needs no truth.

    Examples
    --------
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 3.0]])
    >>> uc.inconsistency(lambda x: np.ones_like(x), demonstration)  # (1 − 1)² + (3 − 1)²
    4.0
    """
    demos = _listed(demonstrations)
    actions = stack(demos).actions
    return _squares(actions - project(action_projection(actions), _predicted(policy, demos)))


def nupe(policy: PolicyLike, demonstrations: Demonstrations) -> float:
    """Normalised unconstrained policy error; see :func:`upe`.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.nupe(lambda x: np.array([[1.0, 2.0], [3.0, 1.0]]), demonstration)  # the policy itself
    0.0
    """
    return upe(policy, demonstrations) / _norm(demonstrations)


def ncpe(policy: PolicyLike, demonstrations: Demonstrations, constraint: Constraint | None = None) -> float:
    """Normalised constrained policy error; see :func:`cpe`.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.ncpe(lambda x: np.array([[1.0, 9.0], [3.0, 9.0]]), demonstration)  # wrong only where it was held
    0.0
    """
    return cpe(policy, demonstrations, constraint) / _norm(demonstrations)


def ninconsistency(policy: PolicyLike, demonstrations: Demonstrations) -> float:
    """Normalised inconsistency; see :func:`inconsistency`.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.ninconsistency(lambda x: np.array([[1.0, 9.0], [3.0, 9.0]]), demonstration)
    0.0
    """
    return inconsistency(policy, demonstrations) / _norm(demonstrations)


def along_motion(policy: PolicyLike, demonstrations: Demonstrations, usual: float | None = None) -> tuple[float, float]:
    """``Σ w (‖u‖ − ûᵀ π̃)²`` and ``Σ w ‖u‖²``: the first over the second is the share of the motion left unexplained.

    As the inconsistency (eq. 4), but w falls from one to zero below half a usual length of actions, by default their
    root mean square, and below ten standard deviations of their noise: it gives the direction of what is slow.

    Examples
    --------
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 3.0]])
    >>> uc.evaluation.metrics.along_motion(lambda x: np.ones_like(x), demonstration)
    (4.0, 9.8)
    """
    demos = _listed(demonstrations)
    noise = np.repeat([_noise(demo) for demo in demos], [len(demo) for demo in demos])
    return along(stack(demos).actions, _predicted(policy, demos), usual=usual, noise=noise)


def missed_for_noise(policy: PolicyLike, demonstrations: Demonstrations) -> float:
    """What noise alone lets the best policy, about ``policy``, miss along the motion; a share of a typical action."""
    demos = _listed(demonstrations)
    noise = np.repeat([_noise(demo) for demo in demos], [len(demo) for demo in demos])
    actions, predicted = stack(demos).actions, _predicted(policy, demos)
    directions, lengths = unit_actions(actions)
    turned = ((predicted - project(action_projection(actions), predicted)) ** 2).sum(axis=1) / lengths.clip(1e-150) ** 2
    missed, motion = along(actions, actions - directions * np.sqrt(noise * (1.0 + turned))[:, None], noise=noise)
    return float(np.sqrt(missed / motion)) if motion > 0 else 0.0


def explained_in_planes(policy: PolicyLike, demonstrations: Demonstrations) -> Array:
    """Share of the motion ``1 − Σ ‖N̂ (u − π̃)‖² / Σ ‖u‖²`` that is explained in all directions of its plane.

    Of a demonstration that moved much along at least two directions, and along none of the others, in which the policy
    or other demonstrations move; N̂ projects onto the former. Among angles there are no planes. If nothing but that
    plane held it, this is all of the policy's error that it can show, 1 − nCPE, where :func:`along_motion` sees what is
    along the path alone.

    Returns
    -------
    ndarray, shape (G,)
        Of each demonstration; NaN of one that kept to no plane.

    Examples
    --------
    >>> angle = np.linspace(0.0, 6.0, 60)
    >>> circle = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    >>> demonstration = uc.Demonstration(circle, circle)
    >>> uc.evaluation.metrics.explained_in_planes(lambda x: 0.5 * x + [0.0, 0.0, 5.0], demonstration).round(3)
    array([0.75])
    """
    demos = _listed(demonstrations)
    (_, actions, groups), predicted = stack(demos), _predicted(policy, demos)
    least = robust.LEAST_MISFIT**2 * float((actions**2).mean())  # smoothing hides noise of positions
    noise = np.maximum([_noise(demo) for demo in demos], least)[groups]
    # What the policy does freely is one movement more: a direction in which it would move is one that was held.
    moved, labels = np.concatenate([actions, predicted]), np.append(groups, np.full(len(actions), len(demos)))
    held, onto = robust.held_throughout(moved, labels, np.append(noise, np.full(len(actions), noise.max())))
    plane = held[: len(groups)] & (np.einsum("naa->n", onto[: len(groups)]) > 1.5)
    missed = (project(onto[: len(groups)], actions - predicted) ** 2).sum(axis=1)
    missed, motion = (np.bincount(groups, each) for each in (missed, (actions**2).sum(axis=1)))
    kept = (np.bincount(groups, plane) > 0) & isinstance(demos[0].space, spaces.Euclidean)
    return np.where(kept, 1.0 - missed / np.where(kept, motion, 1.0), np.nan)


def nppe(constraint: Constraint, demonstrations: Demonstrations) -> float:
    """Normalised projected policy error of a constraint, ``Σ ‖N π − N̂ π‖² / Σ ‖π − mean π‖²``.

    How far the projection N̂ that it says is from the true one, as the policy sees it. The variance is the policy's.

    Parameters
    ----------
    constraint : callable
        A(x, t), such as a :class:`~unconstrain.LearntConstraint`.
    demonstrations : Demonstration or sequence of Demonstration
        With their truth.

    Raises
    ------
    InvalidDataError
        If a demonstration has no truth, or the constraint reads times that one does not have.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.nppe(lambda x, t: np.tile([[[0.0, 1.0]]], (len(x), 1, 1)), demonstration)  # what really held it
    0.0
    """
    demos = _listed(demonstrations)
    policy = _true_policy(demos)
    wrong = np.concatenate([_projections(demo, None) - _projections(demo, constraint) for demo in demos])
    return _squares(project(wrong, policy)) / _spread(policy)


def npoe(constraint: Constraint, demonstrations: Demonstrations) -> float:
    """Normalised projected observation error of a constraint, ``Σ ‖u − N̂ u‖² / Σ ‖u − mean u‖²``.

    How much of the observed actions it would have taken away; zero for one that holds nothing. The variance is that of
    the actions. As :func:`nppe`, but needs no truth.

    Examples
    --------
    >>> free = uc.Truth(policy=np.array([[1.0, 2.0], [3.0, 1.0]]), projections=np.tile(np.diag([1.0, 0.0]), (2, 1, 1)))
    >>> demonstration = uc.Demonstration([[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [3.0, 0.0]], truth=free)
    >>> uc.npoe(lambda x, t: np.tile([[[1.0, 0.0]]], (len(x), 1, 1)), demonstration)  # would have taken all away
    5.0
    """
    demos = _listed(demonstrations)
    actions = stack(demos).actions
    projections = np.concatenate([_projections(demo, constraint) for demo in demos])
    return _squares(actions - project(projections, actions)) / _spread(actions)


def forbidden(constraint: Constraint, demonstrations: Demonstrations) -> float:
    """Share of the squared motion that a constraint would have taken away, less what noise by differences explains."""
    demos = _listed(demonstrations)
    _, actions, groups = stack(demos)
    projections = np.concatenate([_projections(demo, constraint) for demo in demos])
    held = actions.size - float(np.trace(projections, axis1=1, axis2=2).sum())
    noise = robust.noise_by_differences(actions, groups)  # infinite where demonstrations are too short
    explained = held * noise if np.isfinite(noise) else 0.0
    return max(_squares(actions - project(projections, actions)) - explained, 0.0) / (_squares(actions) or 1.0)


def nnpe(component: PolicyLike, demonstrations: Demonstrations) -> float:
    """Normalised null-space projection error of a component v(x), ``Σ ‖v − v̂v̂ᵀ u‖² / Σ ‖u − mean u‖²``.

    How far it is from the action's part along it, such as of :func:`~unconstrain.constraints.null_space_component`. The
    variance is that of the actions. Needs no truth.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> round(uc.metrics.nnpe(lambda states: -states, uc.Demonstration(states, -states)), 6)
    0.0
    """
    demos = _listed(demonstrations)
    actions, found = stack(demos).actions, _predicted(component, demos)
    return _squares(found - project(action_projection(found), actions)) / _spread(actions)


def _norm(demonstrations: Demonstrations) -> float:
    demos = _listed(demonstrations)
    return _spread(stack(demos).actions if any(demo.truth is None for demo in demos) else _true_policy(demos))


def _spread(vectors: Array) -> float:
    variance = _squares(vectors - vectors.mean(axis=0))
    if variance <= vectors.size * (1e-12 * np.abs(vectors).max()) ** 2:  # rounding of the mean is no variance
        raise InvalidDataError(
            "the policy is the same at every sample, so errors cannot be normalised by its variance."
        )
    return variance


def _listed(demonstrations: Demonstrations) -> list[Demonstration]:
    return [demonstrations] if isinstance(demonstrations, Demonstration) else list(demonstrations)


def _predicted(policy: PolicyLike, demos: list[Demonstration]) -> Array:
    states, actions, _ = stack(demos)
    predicted = np.asarray(policy(states))
    if predicted.shape != actions.shape and (actions.shape[1] > 1 or predicted.shape != (len(states),)):
        raise SettingError(
            f"policy: got actions of shape {predicted.shape} for {len(states)} states, expected {actions.shape}."
        )
    return predicted.reshape(actions.shape)


def _true_policy(demos: list[Demonstration]) -> Array:
    for index, demo in enumerate(demos):
        if demo.truth is None:
            raise InvalidDataError(
                f"demonstration {index} ('{demo.name}') has no truth, and this error needs the true policy. "
                "On recordings use ncpe with a constraint, or ninconsistency."
            )
    return np.concatenate([demo.truth.policy for demo in demos if demo.truth is not None])


def _projections(demo: Demonstration, constraint: Constraint | None) -> Array:
    if constraint is not None:
        return null_space_projection(
            constraint_matrices(constraint, demo.states, demo.times, demo.actions.shape[1], demo.name)
        )
    if demo.truth is None:
        raise InvalidDataError(
            f"'{demo.name}' has no truth that tells how it was constrained: expected a constraint A(x, t)."
        )
    return demo.truth.projections


def _constrained(demos: list[Demonstration], constraint: Constraint | None) -> Array:
    if constraint is None and all(demo.truth is not None for demo in demos):
        # N π rather than the observed u: noise on the actions is no error of the policy.
        return np.concatenate([project(d.truth.projections, d.truth.policy) for d in demos if d.truth is not None])
    return stack(demos).actions


def _noise(demo: Demonstration) -> float:
    """Variance of the noise on each action coordinate: as known, or by differences; zero where these are too few."""
    if demo.noise is not None:
        return float(np.mean(demo.noise**2))
    found = robust.noise_by_differences(demo.actions, np.zeros(len(demo), dtype=np.intp))
    return found if np.isfinite(found) else 0.0


def _squares(vectors: Array) -> float:
    return float((vectors**2).sum())
