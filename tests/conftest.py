"""What all tests share: every learner, every policy, data for them, and what takes long to make."""

import os
import pickle
from itertools import product

import pytest
from coverage import Coverage
from filelock import FileLock
from hypothesis import HealthCheck, Phase, settings

# Before NumPy comes in: the tests themselves run side by side, and at their sizes threads mostly wait for each other.
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

import recorded
import samples
import seen
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
    "cubic": lambda learner: uc.ParametricPolicy(uc.Polynomial(3), learner),
    "grid": lambda learner: uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), learner),
    "kmeans": lambda learner: uc.ParametricPolicy(uc.KMeansRBF(7), learner),
    "local": lambda learner: uc.LocallyLinearPolicy(variance=0.5, learner=learner),
}


def pytest_collection_modifyitems(items):
    """Long tests, and those that share what takes long to make, come first, so that no worker begins one at the end.

    Coverage is taken by the quick tests: it costs the slow ones a third of their time.
    """
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker("no_cover")
    items.sort(key=lambda item: item.get_closest_marker("slow") is None and "once" not in item.fixturenames)


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


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """``once(name, make)`` is ``make()``, called by the first process of the run that asks and kept for the others."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    loaded = {}

    def of(name, make):
        path = folder / f"{name}.pickle"
        with FileLock(f"{path}.lock"):
            if not path.exists():
                content = pickle.dumps(make())
                path.write_bytes(content)
        if name not in loaded:
            loaded[name] = pickle.loads(path.read_bytes())
        return loaded[name]

    return of


def washing_unwatched(settings):
    """The washing experiment, without measuring coverage: its loops of many thousand short steps take twice as long.

    What it runs counts as covered only where shorter tests run it, too.
    """
    from unconstrain.paper.experiments import washing

    measuring = Coverage.current()
    if measuring is None:
        return washing.run(washing.Settings(**settings))
    measuring.stop()
    try:
        return washing.run(washing.Settings(**settings))
    finally:
        measuring.start()


BRIEFLY = {"trials": 1, "steps": 60}
"""The movements that are drawn are a fifth as long as the demo's; nothing else depends on them."""


@pytest.fixture(scope="session")
def washed(once):
    """What ``unconstrain demo`` finds with a seed; with others than its own the arm goes round five times."""

    def of(seed=0):
        settings = BRIEFLY | {"seed": seed} | ({"cycles": 5} if seed else {})
        return once(f"washing {seed}", lambda: washing_unwatched(settings))

    return of


@pytest.fixture(scope="session")
def tabled(once):
    """Table II, of fewer and shorter demonstrations."""
    from unconstrain.paper.experiments import table2

    settings = table2.Settings(trials=1, demonstrations=10, steps=30, test_demonstrations=3, jacobian_trials=1)
    return lambda: once("table 2", lambda: table2.run(settings))


@pytest.fixture(scope="session")
def washed_rim(once):
    """What ``unconstrain demo --real`` finds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UNCONSTRAIN_DATA", str(recorded.DATA))
        return once("washing of the rim", lambda: washing_unwatched(BRIEFLY | {"real": True}))


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Chromium without a window."""
    if os.environ.get("UNCONSTRAIN_NO_BROWSER") == "1":
        pytest.skip("UNCONSTRAIN_NO_BROWSER is set")
    if seen.missing_for_pages():
        pytest.fail(
            "These tests open reports in Chromium, and it or its driver is missing. Install them with "
            "'apt-get install chromium chromium-driver' (or scripts/install-system browser), or set "
            "UNCONSTRAIN_NO_BROWSER=1 to leave these tests out."
        )
    with seen.chromium(tmp_path_factory.mktemp("chromium")) as started:
        yield started
