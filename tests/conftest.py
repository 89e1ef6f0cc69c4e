"""What all tests share: every learner, every policy, and data for them."""

from itertools import product

import pytest
from hypothesis import HealthCheck, Phase, settings

import samples
import unconstrain as uc

settings.register_profile(
    "unconstrain",
    deadline=None,
    derandomize=True,
    max_examples=30,
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("unconstrain")

LEARNERS = {
    "direct": uc.Direct(),
    "inconsistency": uc.Inconsistency(),
    "inconsistency_validated": uc.Inconsistency(threshold=None),
    "hybrid": uc.Hybrid(),
    "hybrid_at_a_threshold": uc.Hybrid(threshold=1e-3),
    "hybrid_arithmetic": uc.Hybrid(alpha=1e-2, averaging="arithmetic"),
    "hybrid_soft": uc.Hybrid(softness=0.1, threshold=0.0),
}

ROBUST = {
    "robust": uc.Robust(),
    "likelihood": uc.Likelihood(),
    "noise_corrected": uc.NoiseCorrected(),
    "segments": uc.Segments(),
}
"""Learners that look at the samples, the default first."""

POLICIES = {
    "affine": lambda learner: uc.ParametricPolicy(uc.Affine(), learner),
    "grid": lambda learner: uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), learner),
    "kmeans": lambda learner: uc.ParametricPolicy(uc.KMeansRBF(7), learner),
    "local": lambda learner: uc.LocallyLinearPolicy(variance=0.5, learner=learner),
}


@pytest.fixture(params=LEARNERS.values(), ids=LEARNERS)
def learner(request):
    """Each learner in turn."""
    return request.param


@pytest.fixture(params=product(POLICIES, LEARNERS), ids="-".join)
def policy(request):
    """Each policy with each learner, not fitted."""
    kind, learner = request.param
    return POLICIES[kind](LEARNERS[learner])


@pytest.fixture(params=POLICIES.values(), ids=POLICIES)
def policy_of(request):
    """Each policy in turn, as a function of its learner."""
    return request.param


@pytest.fixture
def data():
    """Noisy actions, each behind a random constraint, in six groups."""
    return samples.draw()
