"""What demonstrates: simulated demonstrators with a known policy.

Examples
--------
>>> from unconstrain.paper.systems.limit_cycle import LimitCycle
>>> LimitCycle()(np.array([[0.5, 0.0]])).shape
(1, 2)
"""
