"""How good a policy is, and what the data leaves unknown.

Examples
--------
>>> states = np.random.default_rng(0).normal(size=(40, 2))
>>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
>>> policy = uc.ParametricPolicy(uc.Affine()).fit(states, actions)
>>> uc.evaluation.ninconsistency(policy, uc.Demonstration(states, actions)) < 1e-6
True
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
