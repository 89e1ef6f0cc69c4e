"""Writes the files beside it: what the learners found, and policies as they were stored, at format version 1.

Run once, with the release whose results are to be kept: ``python tests/frozen/make.py`` from the repository's root.
"""

import sys
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import unconstrain as uc

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER.parent))

import samples  # noqa: E402

LEARNERS = {
    "direct": uc.Direct(),
    "inconsistency": uc.Inconsistency(),
    "inconsistency_validated": uc.Inconsistency(threshold=None),
    "hybrid": uc.Hybrid(),
    "hybrid_at_a_threshold": uc.Hybrid(threshold=1e-3),
    "hybrid_arithmetic": uc.Hybrid(alpha=1e-2, averaging="arithmetic"),
    "hybrid_soft": uc.Hybrid(softness=0.1, threshold=0.0),
    "hybrid_auto": uc.Hybrid(alpha="auto"),
    "likelihood": uc.Likelihood(),
    "noise_corrected": uc.NoiseCorrected(),
    "segments": uc.Segments(),
    "robust": uc.Robust(),
}

POLICIES = {
    "affine": lambda learner: uc.ParametricPolicy(uc.Affine(), learner),
    "grid": lambda learner: uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), learner),
    "kmeans": lambda learner: uc.ParametricPolicy(uc.KMeansRBF(7), learner),
    "local": lambda learner: uc.LocallyLinearPolicy(variance=0.5, learner=learner),
}

STORED = (
    ("affine", "direct"),
    ("grid", "hybrid"),
    ("kmeans", "inconsistency"),
    ("local", "hybrid_soft"),
    ("local", "robust"),
    ("kmeans", "robust"),
    ("affine", "likelihood"),
    ("local", "noise_corrected"),
    ("grid", "segments"),
)

PROBES = np.random.default_rng(7).uniform(-1.2, 1.2, (40, 2))


def learnt(kind, learner):
    """A policy of one kind, fitted by one learner to the samples that all tests know."""
    data = samples.draw(seed=3, samples=300, groups=10)
    return POLICIES[kind](LEARNERS[learner]).fit(data.states, data.actions, groups=data.groups)


if __name__ == "__main__":
    found = {}
    with threadpool_limits(1):
        for kind in POLICIES:
            for learner in LEARNERS:
                policy = learnt(kind, learner)
                found[f"{kind}-{learner}"] = policy.solution_.weights
                found[f"{kind}-{learner}-actions"] = policy(PROBES)
                if (kind, learner) in STORED:
                    uc.save(policy, FOLDER / f"{kind}-{learner}.npz", {"recipe": {"states": ["x", "y"]}})
    np.savez_compressed(FOLDER / "found.npz", **found)
