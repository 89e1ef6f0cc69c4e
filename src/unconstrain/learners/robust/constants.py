"""Constants of the robust learners, each with its source.

Where none is named, a value was set by hand while the learners were developed on the benchmark of regimes
(``unconstrain reproduce regimes``), on other seeds than the reported one; no record of a systematic search is kept.
Shares of "the actions" are shares of their root-mean-square length.
"""

# Noise

DIFFERENCE_ORDER = 4
"""Order of the differences in time that estimate the noise: fourth differences of a cubic are zero."""

MOST_LAGS = 20
"""Lags at which the integrated autocorrelation time is cut off, if its terms have not died out before."""

LEAST_AUTOCORRELATION = 0.05
"""The sum of the integrated autocorrelation time ends at the first autocorrelation up to this."""

EIGENVALUE_STANDARD_ERRORS = 2.0
"""Noise-corrected eigenvalues below so many standard errors of the noise subtracted from them count as zero.

The standard error of a variance from n Gaussian samples is the share ``√(2/n)`` of it.
"""

# Consistency

NOISE_ROUNDS = 3
"""Rounds of noise variance and policy, each from the other."""

BALANCE_STEPS = 6
"""Steps of softness and weights, each from the other."""

FIRST_SOFTNESS = 1e-2
SOFTNESS_RANGE = (1e-8, 1.0)
"""Where that iteration starts and stays. With a softness of 1 the standard risk weighs as much as the inconsistency."""

LEAST_PRIOR_PRECISION = 1e-2
"""Floor of the prior precision for the uncertainty, as a share of its mean over all directions of the weights."""

SOFTNESS_STANDARD_ERRORS = 3.0
"""The prior's softness is kept while its held-out loss is within so many standard errors of the least.

Over four constraints of the arm at 2, 5 and 10 % noise, eight data sets each, nUPE over that of the softness which the
truth would choose was 1.21 within one standard error, 1.18 within two, 1.17 within three, and 1.18 for the prior alone.
"""

ROUGHNESS_RANK_TOLERANCE = 1e-10
"""Eigenvalues of the roughness matrix below this share of the largest are rounding."""

SEGMENT_SIGNAL_TO_NOISE = 3.0
"""A singular vector of a segment's actions is kept where their rms along it exceeds so many times the noise."""

LEAST_SEGMENT = 4
"""Samples of a segment found automatically, at least."""

# Likelihood

ANGULAR_SPREADS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Standard deviations s_k of the mixture: angles between action and policy, rad, about doubling. Zero is a free sample.

From about 0.4 on, the uniform component takes over.
"""

LEAST_MISFIT = 0.015
"""Floor of the residuals' standard deviation, as a share of the actions: no model is trusted to be more exact."""

EM_TOLERANCE = 1e-4
"""Expectation maximisation has converged when a sample's mean log-likelihood rises by less, per action coordinate."""

EM_LEAST_STEPS = 6
"""Steps of expectation maximisation before convergence is looked at; and those for the mixtures of demonstrations."""

POOLED_PSEUDO_COUNT = 10.0
"""Pseudo-count of the pooled mixture in the Dirichlet prior of each demonstration's own mixture."""

# The choice between them

NOISE_TO_CORRECT = 0.015
"""Noise above this share of the actions calls for noise-corrected moments."""

NEARLY_EXACT = 0.05
"""So does a policy that leaves less than this share of the held-out motion unexplained: the rest may well be noise."""

LEAST_INFORMATIVE = 0.1
"""The likelihood is not used where fewer than this share of the samples are in other than the uniform component."""

INCONSISTENCY_RATIO = 1.9
"""Cut-off of the ratio of held-out inconsistencies above which the likelihood's policy is refuted.

For Gaussian residuals of unknown variance the logarithm of that ratio, times n/2, is the log-likelihood ratio. With a
share q of the samples in other than the uniform component the cut-off is ``1.9^min(1, 2q)``: the likelihood also fits
their positions along the sphere, at the expense of consistency. It was 1.35, then 2.1, as the learners changed.
"""

NEGLIGIBLE_RESIDUAL = 0.05
"""Residuals below this share of the actions do not count when inconsistencies are compared."""

SPHERE_HIDDEN_BY_NOISE = 0.35
"""Noise above this share of the actions hides the sphere: free and constrained samples look the same."""
