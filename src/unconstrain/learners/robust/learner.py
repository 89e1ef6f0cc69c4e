"""Learners that use the samples themselves: they estimate the noise and need no α."""

import warnings
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array, check_at_least
from ...base.display import counted, percent
from ...base.errors import SettingError
from ...models import Scale
from ...risks import along_motion, inconsistency, vec
from ...training import Batch, Samples, Training
from ..direct import Direct
from ..hybrid import Hybrid
from ..learner import Learner
from ..secondary import Objective, Secondary, on
from ..solution import Belief, Solution
from ..thresholds import judged
from .belief import solution, weak_prior
from .candidate import Candidate
from .choice import Comparison
from .consistent import by_segments, noise_corrected
from .constants import AGREED, AS_DIRECT, LEAST_EXPLAINED, LEAST_MISFIT, LONG, MOST_OF_NOISE
from .held_out import held_out_otherwise, held_out_together
from .kinematics import KNOWING, Jacobian, with_jacobian
from .likelihood import free_probability, maximise
from .noise import beyond_misfit, hides_sphere, most_noise, noise_of_each
from .posterior import Posterior
from .segments import curved_projections, found_segments, held_throughout, projections_of
from .softened import softened

SUMS_ALONE = (
    "Learnt from sums alone, as the softened hybrid, since samples were not kept: they came over a cluster or from a "
    "file. Likelihood and noise correction were not tried."
)
THINNED = (
    "Learnt from one in {0} samples of each demonstration, {1:,} in all, evenly: more of them say the same. These are "
    "what solution_.free is about; those that look wrong are left out, but not listed."
)

EXPLAINS_LITTLE = "The policy explains next to nothing of held-out motion ({:.2g}){}."
LITTLE_IN_COMMON = ", but {} of what it learnt from: demonstrations have too little in common. Demonstrate between them"
LOOK_AT = ": look at columns, units, and what tells demonstrations apart (groups= in Python, --group typed)"
FITTED_WELL = 0.9  # where more of what was learnt from is explained, columns and units are not to blame
NOTHING_MOVED = "No action is other than zero: nothing can be learnt of them. Look at the columns."
BY_AGREEMENT = (
    "One model fits all demonstrations but for noise, and each is needed: where those that were held alike are left "
    "out together, the others tell too little of them, and {} of their motion is missed. So what it explains is not "
    "taken from held-out motion, but from how well all agree (generalised cross-validation), which is right if the "
    "policy has the form of this model. Recordings at other places would test it."
)
UNUSED = "The Jacobian that was given is not used: {}."
OUTDONE = "no policy that uses it is of less estimated error"
INCONSISTENT = "policies that use it miss at least {:.2g}% of held-out motion, this one {:.2g}%"


@dataclass(frozen=True)
class SampleLearner(Learner):
    """Learns from the samples, not only from their moments; its solution has a ``belief``.

    Parameters
    ----------
    secondary : callable or Secondary, optional
        What is minimised in the directions that ``solution_.determined`` does not count, in place of what the learner
        itself supposes there; see :class:`~unconstrain.Hybrid`.
    """

    secondary: Objective | Secondary | None = field(default=None, kw_only=True)
    needs_samples: ClassVar[bool] = True

    def learn(self, training: Training) -> Solution:
        """Learn from the samples; as :class:`~unconstrain.Hybrid` with one action, no motion or a single fold."""
        training, suspects = _trusted(training)
        found = self._learnt(training, training.samples)
        thinned = _thinned(training)
        listed = suspects[:0] if thinned else suspects  # which they are among all is not known
        found = replace(found, belief=replace(found.believed, suspects=listed))
        return replace(found, notes=(*found.notes, *thinned, *_warned(found.believed, found.weights, training.samples)))

    def _learnt(self, training: Training, everything: Samples) -> Solution:
        samples = held_out_together(everything.counted)
        agreed: tuple[str, ...] = ()
        if _trivial(samples):
            found = self._plain(training, samples, everything)
        else:
            chosen, more = self.candidate(samples, training)
            more["left_out"] = chosen.alone if chosen.alone > AGREED else 0.0
            by = BY_AGREEMENT.format(percent(chosen.alone) if chosen.alone < 1.0 else "more than all")
            agreed = *more.pop("notes", ()), *([by] if more["left_out"] else [])
            if more["left_out"] > 1.0 - LEAST_EXPLAINED:
                warnings.warn(by, UserWarning, stacklevel=9)
            more["held_out_score"] = _explained(samples, chosen)
            second = None if self.secondary is None else on(self.secondary, training)(training.folds.whole)
            found = solution(chosen, samples, everything, training.model, second, **more)
        return replace(found, notes=(*everything.notes, *agreed))

    def _plain(self, training: Training, samples: Samples, everything: Samples) -> Solution:
        """The hybrid's solution, with a belief from its residuals."""
        found, whole = Hybrid(secondary=self.secondary).learn(training), training.filled.whole
        size, d = found.directions, samples.actions.shape[1]
        residual = judged(inconsistency(whole), vec(found.weights)) / np.maximum(samples.sizes - size, 1.0)
        evidence = (1.0 / np.maximum(residual, LEAST_MISFIT**2 * samples.energy + 1e-300)) * inconsistency(whole)
        from_noise, undetermined = Posterior(evidence, weak_prior(samples)).covariances()
        return replace(
            found,
            belief=Belief(
                noise=float(np.sqrt(residual.mean())),
                misfit=LEAST_MISFIT * float(np.sqrt(samples.energy / d)),
                free_share=1.0,
                free=np.ones(len(everything.places)),
                from_noise=from_noise,
                undetermined=undetermined,
            ),
        )

    @abstractmethod
    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """Learn from the samples of positive weight; returns a policy and further fields of the belief."""


@dataclass(frozen=True)
class _Maximising(SampleLearner):
    """Settings of the learners that use expectation maximisation."""

    steps: int = 60
    most: int = 2000

    def __post_init__(self) -> None:
        check_at_least("steps", self.steps, 1, whole=True)
        check_at_least("most", self.most, 1, whole=True)

    def _maximised(self, samples: Samples, training: Training, corrected: Candidate) -> tuple[Candidate, Array]:
        """The most probable policy, from two starts: noise-corrected moments and direct regression."""
        starts = [corrected.weights, Direct().learn(training).weights]
        return maximise(samples, starts, corrected.smoothness, self.steps, self.most)


@dataclass(frozen=True)
class Likelihood(_Maximising):
    """Maximum a posteriori policy under a mixture of free, nearly free and uniformly constrained samples.

    The model is that of :mod:`unconstrain.learners.robust.sphere`. It supposes
    constraints that vary at random. Where they are a function of the state,
    their effect is taken for part of the policy. Needs the samples, not only
    their moments.

    Parameters
    ----------
    steps : int
        Most steps of expectation maximisation from each of two starts.
    most : int
        All steps but the last use at most so many samples, evenly thinned in time.
    secondary : callable or Secondary, optional
        Followed in directions that are not determined; see :class:`~unconstrain.Hybrid`.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Likelihood()).fit(states, actions)
    >>> policy.predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The most probable policy."""
        return self._maximised(samples, training, noise_corrected(samples))[0], {}


@dataclass(frozen=True)
class NoiseCorrected(SampleLearner):
    """Minimise the inconsistency on noise-corrected moments; see :mod:`unconstrain.learners.robust.noise`.

    Samples are weighted by ‖u‖², and the standard risk is a unit-information
    prior. Valid under noise and constraints of any kind; does not use that
    samples were free. Needs the samples, not only their moments.

    Parameters
    ----------
    noise : float, optional
        Standard deviation of the noise on each action coordinate; estimated by default.
    secondary : callable or Secondary, optional
        Followed in directions that are not determined; see :class:`~unconstrain.Hybrid`.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.NoiseCorrected()).fit(states, actions)
    >>> policy.predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    noise: float | None = None

    def __post_init__(self) -> None:
        if self.noise is not None:
            check_at_least("noise", self.noise, 0.0)

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The consistent policy."""
        return noise_corrected(samples, self.noise), {}


@dataclass(frozen=True)
class Segments(SampleLearner):
    """Learn from segments of constant constraint; see :mod:`unconstrain.learners.robust.segments`.

    Needs the samples, not only their moments.

    Parameters
    ----------
    labels : {"found", "groups"}
        "groups": each demonstration is one segment. "found": change points within demonstrations are found from the
        actions, which must then be in the order of time.
    noise : float, optional
        Standard deviation of the noise on each action coordinate; by default from differences in time.
    secondary : callable or Secondary, optional
        Followed in directions that are not determined; see :class:`~unconstrain.Hybrid`.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(80, 2))
    >>> normals = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8], [0.8, -0.6]]).repeat(20, axis=0)
    >>> actions = uc.project(uc.null_space_projection(normals[:, None]), -states)
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Segments()).fit(states, actions, groups=np.repeat(range(4), 20))
    >>> policy.predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    labels: Literal["found", "groups"] = "found"
    noise: float | None = None

    def __post_init__(self) -> None:
        if self.labels not in ("found", "groups"):
            raise SettingError(f"labels: got {self.labels!r}, expected 'found' or 'groups'.")
        if self.noise is not None:
            check_at_least("noise", self.noise, 0.0)

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The policy of least constrained error."""
        if self.labels == "groups" and samples.groups.max() == 0:
            raise SettingError("labels: 'groups' needs groups=, one name for each demonstration, at least two.")
        most = most_noise(samples)
        known = float(np.sqrt(most)) if self.noise is None else self.noise
        found = self.labels == "found"
        labels = found_segments(samples.actions, samples.groups, known) if found else samples.groups
        if self.noise is None:
            noise = beyond_misfit(noise_of_each(samples.actions, labels, most, samples.noise), samples)
        else:
            noise = np.full(len(samples), self.noise**2)
        return by_segments(samples, projections_of(samples.actions, labels, noise)), {}


@dataclass(frozen=True)
class Robust(_Maximising):
    """Learn under noise and any kind of constraints, without a setting to tune.

    Learns several policies and takes the one of least estimated error; see
    :mod:`unconstrain.learners.robust.choice`. Candidates are direct
    regression, softened hybrids (eqs 4 to 6), :class:`NoiseCorrected`,
    :class:`Segments` by demonstration, also such as are curved, and
    :class:`Likelihood` unless noise hides the sphere.

    Keeps the samples, up to 50,000 of them, and uses them; of more it keeps
    every second, fourth, ... of each demonstration, and ``solution_.free`` is
    about those. On a cluster, and in a stored policy that learns on, the
    moments have to do: it then is :class:`~unconstrain.Hybrid` with ``alpha="auto"``, and
    ``solution_.notes`` says so.

    Parameters
    ----------
    steps, most : int
        See :class:`Likelihood`.
    jacobian : callable, optional
        Jacobian J of a task, states (N, n) to (N, r, d), such as that of a robot's hand, in the units of the data
        whatever the policy's scale. A candidate then is the policy
        of least constrained error under ``A = Λ J``, with Λ and its rank from the demonstrations; see
        :mod:`unconstrain.learners.robust.held_rows`. It is not stored with a policy.
    secondary : callable or Secondary, optional
        Followed in directions that are not determined; see :class:`~unconstrain.Hybrid`.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, actions)
    >>> policy.predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    >>> policy.solution_.free.shape  # how likely it is of each sample that it was free
    (40,)
    """

    jacobian: Jacobian | None = field(default=None, metadata={"stored": False})
    needs_samples: ClassVar[bool] = False
    uses_samples: ClassVar[bool] = True

    def within(self, scale: Scale) -> Self:
        """With the Jacobian, which is in the units of the data, in those of the policy."""
        given = self.jacobian
        if given is None:
            return self
        return replace(self, jacobian=lambda states: given(states * scale.states) * scale.actions)

    def learn(self, training: Training) -> Solution:
        """Learn from the samples where they were kept, and from the moments elsewhere."""
        if training.kept is None:
            return replace(Hybrid(alpha="auto", secondary=self.secondary).learn(training), notes=(SUMS_ALONE,))
        return super().learn(training)

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The candidate of least estimated error."""
        compared = self.compared(samples, training)
        used = self.jacobian is None or compared.best.softness == KNOWING
        notes = () if used else (UNUSED.format(compared.unused or OUTDONE),)
        return compared.best, {"candidates": compared.judged(), "notes": notes}

    def compared(self, samples: Samples, training: Training) -> Comparison:
        """All candidates; those that use the Jacobian if they are as consistent as the best that does not, or more."""
        _say_if_long(samples)
        found, other = self._as_held_out(samples, training), held_out_otherwise(samples)
        return found if other is None else found.beside(self._as_held_out(other, training))

    def _as_held_out(self, samples: Samples, training: Training) -> Comparison:
        """All candidates, as these folds hold samples out."""
        corrected, most = noise_corrected(samples), most_noise(samples)
        noise = noise_of_each(samples.actions, samples.groups, most, samples.noise)
        learnt = [*softened(samples), corrected, noise_corrected(samples, worth=1.0)]
        each = samples.actions, samples.groups, beyond_misfit(noise, samples)
        projections = projections_of(*each)
        if samples.groups.max() > 0:
            curved = curved_projections(samples.states, *each[:2], projections, each[2])
            if not np.allclose(projections, np.eye(samples.actions.shape[1])):
                learnt.append(by_segments(samples, projections))
            if not np.allclose(curved, projections):
                learnt.append(by_segments(samples, curved, "curved segments"))
        likely, mixture = self._maximised(samples, training, corrected)
        if not hides_sphere(likely.variance, samples):
            free = samples.counts * free_probability(samples, samples.predict(likely.weights), likely.variance, mixture)
            unshown = 2.0 * float(free @ held_throughout(*each)[0]) > free.sum()
            learnt.append(replace(likely, softness=np.inf) if unshown else likely)
        least = min(most, corrected.variance)
        found = Comparison(learnt, np.minimum(noise, least), samples)
        if self.jacobian is None:
            return found
        held = list(with_jacobian(samples, self.jacobian, least))
        both = Comparison([found.best, *held], found.noise, samples)
        if beside := both.as_consistent if held else []:
            return Comparison([*learnt, *beside], found.noise, samples)
        own, *its = (100.0 * max(one.loss, 0.0) for one in both.judged().values())
        found.unused = INCONSISTENT.format(min(its), own) if held else "no demonstration shows rows of it held"
        return found

    def suited(self, begun: Mapping[str, Training], seen: Iterable[Batch], usual: str | None = None) -> str:
        """The name of the model in which the policy of least estimated error is learnt.

        Candidates are the best of each model, by the rule of :mod:`.choice`, which takes them for equally biased
        before held-out data refutes any. They do not know the Jacobian, and who does takes none that is finer than
        usual: there noise hides what was held.

        Parameters
        ----------
        begun : mapping
            Training in each model, by name, with nothing seen.
        seen : iterable of Batch
            What to learn from; about the first 50,000 samples of it are looked at.
        usual : str, optional
            Given where each model is finer than the one before: those after two that are worse are not tried. It is
            taken where nothing can be held out, and before coarser ones that do not refute it: what they miss may be
            the same for all, which no variance shows.
        """
        names = list(begun)
        if usual is not None and self.jacobian is not None:
            names = names[: names.index(usual) + 1]
        chosen, first = usual or names[0], list(Training.opening(seen))
        best, coarser, views = dict[str, Candidate](), dict[str, Candidate](), dict[str, Samples]()
        for name in names:
            training, _ = _trusted(begun[name].keeping(Training.MOST_KEPT).with_batches(first))
            views[name] = held_out_together(training.samples.counted)
            if _trivial(views[name]):
                break
            one = Robust().compared(views[name], training).best
            soft = np.inf if one.softness >= AS_DIRECT else 0.0
            best[name] = replace(one, name=name, softness=soft, by_segments=False)
            if name == usual:
                coarser = {one: best[one] for one in _better(_compared(best, views), best)}
                best = {name: best[name]}
            found = chosen = _compared(best, views).best.name
            if coarser:  # by itself: what a third is sure of decides between no two
                chosen = _compared({**coarser, found: best[found]}, views).best.name
            if usual in best and found not in list(best)[-2:]:
                break
        return chosen


def _better(found: Comparison, best: Mapping[str, Candidate]) -> list[str]:
    """Of models that refute the last, or show its bias, the one of least estimated error, if any.

    Where demonstrations agree on a model, which then misses no more than noise, it refutes those that miss far more.
    """
    risks, (*names, last) = found.judged(), best

    def agreed(one: str) -> bool:
        return best[one].agreed and best[last].variance > MOST_OF_NOISE * best[one].variance

    better = [one for one in names if agreed(one) or found.refutes(one, last) or found.shows(one, last)]
    return sorted(better, key=lambda one: risks[one].risk)[:1]


def _trusted(training: Training) -> tuple[Training, NDArray[np.intp]]:
    """The training without samples that look wrong, and which these are."""
    suspects = training.samples.suspects
    if len(suspects) and (rest := training.without(suspects)).gathered.filled:
        return rest, suspects
    return training, suspects[:0]  # where no field sees any of the rest, nothing says that the suspects are wrong


def _compared(best: Mapping[str, Candidate], views: Mapping[str, Samples]) -> Comparison:
    """Candidates by name, each learnt from its own view of the samples."""
    each, any_ = [views[name] for name in best], next(iter(views.values()))
    noise = noise_of_each(any_.actions, any_.groups, most_noise(any_), any_.noise)
    return Comparison(list(best.values()), np.minimum(noise, min(one.variance for one in best.values())), each)


def _warned(belief: Belief, weights: Array, samples: Samples) -> tuple[str, ...]:
    """Warn of what makes a policy next to worthless; the warning, for its notes."""
    if samples.energy > 0.0 and not belief.held_out_score < LEAST_EXPLAINED:
        return ()
    missed, motion = along_motion(samples.actions, samples.predict(weights), samples.counts, noise=belief.noise**2)
    learnt = 1.0 - missed / (motion or 1.0)
    why = LITTLE_IN_COMMON.format(percent(learnt)) if learnt > FITTED_WELL else LOOK_AT
    said = EXPLAINS_LITTLE.format(belief.held_out_score, why) if samples.energy > 0.0 else NOTHING_MOVED
    warnings.warn(said, UserWarning, stacklevel=9)
    return (said,)


def _thinned(training: Training) -> tuple[str, ...]:
    kept = training.kept
    return () if kept is None or kept.stride == 1 else (THINNED.format(kept.stride, kept.size),)


def _say_if_long(samples: Samples) -> None:
    """Warn before solves that take minutes, of what takes seconds."""
    models, size = len(samples.sizes), samples.features.shape[1] * samples.actions.shape[1]
    if models * float(size) ** 3 > LONG:
        warnings.warn(
            f"to compare learners of {counted(models, 'model')} with {size} weights takes minutes. An affine policy "
            "(ParametricPolicy(Affine())) or the hybrid alone (learner=Hybrid()) take a fraction of it.",
            UserWarning,
            stacklevel=2,
        )


def _explained(samples: Samples, policy: Candidate) -> float:
    """Share of the squared motion explained along it where held out; slow samples count less."""
    noise = noise_of_each(samples.actions, samples.groups, most_noise(samples), samples.noise)
    noise = np.minimum(noise, policy.variance)  # constraints that change at every sample look like noise
    missed, motion = along_motion(samples.actions, policy.held_out, samples.counts, noise=noise)
    return 1.0 - missed / motion


def _trivial(samples: Samples) -> bool:
    """Whether there is one action column only, no motion, or nothing to hold out."""
    return samples.actions.shape[1] == 1 or samples.energy == 0.0 or samples.folds.max() == 0
