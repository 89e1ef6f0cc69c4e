"""The equations of the paper, one sample after the other. Slow, and plainly right."""

import numpy as np


def inconsistency(actions, predicted, weights=None):
    """Eq. 4 and, with weights, eq. 14: Σ w (r − ûᵀ π̃)²; a zero action has no direction."""
    weights = np.ones(len(actions)) if weights is None else weights
    error = 0.0
    for u, pi, w in zip(actions, predicted, weights, strict=True):
        r = np.sqrt(u @ u)
        if r > 0:
            error += w * (r - (u / r) @ pi) ** 2
    return error


def standard_risk(actions, predicted, weights=None):
    """Eq. 5: Σ w ‖u − π̃‖²."""
    weights = np.ones(len(actions)) if weights is None else weights
    return sum(w * (u - pi) @ (u - pi) for u, pi, w in zip(actions, predicted, weights, strict=True))


def inconsistency_terms(features, actions, weights=None):
    """E₀, g and H of section III-C (III-D with weights)."""
    weights = np.ones(len(actions)) if weights is None else weights
    P = features.shape[1] * actions.shape[1]
    E0, g, H = 0.0, np.zeros(P), np.zeros((P, P))
    for b, u, w in zip(features, actions, weights, strict=True):
        r = np.sqrt(u @ u)
        if r > 0:
            v = np.kron(b, u / r)
            E0 += w * r**2
            g += w * r * v
            H += w * np.outer(v, v)
    return E0, g, H


def risk_terms(features, actions, weights=None):
    """E₀,₂, m and M of eq. 11."""
    weights = np.ones(len(actions)) if weights is None else weights
    d = actions.shape[1]
    P = features.shape[1] * d
    E0, m, M = 0.0, np.zeros(P), np.zeros((P, P))
    for b, u, w in zip(features, actions, weights, strict=True):
        E0 += w * u @ u
        m += w * np.kron(b, u)
        M += w * np.kron(np.outer(b, b), np.eye(d))
    return E0, m, M


def hybrid(H, g, M, m, undetermined):
    """Eqs 7, 12 and 13 with the given number of smallest eigenvalues left to the second objective."""
    eigenvalues, V = np.linalg.eigh(H)
    V2, V1 = V[:, :undetermined], V[:, undetermined:]
    w1 = V1 @ np.diag(1.0 / eigenvalues[undetermined:]) @ V1.T @ g
    z = np.linalg.pinv(V2.T @ M @ V2, hermitian=True, rcond=1e-12) @ V2.T @ (m - M @ w1)
    return w1 + V2 @ z


def truncated(H, g, undetermined):
    """Eq. 7 alone."""
    eigenvalues, V = np.linalg.eigh(H)
    V1 = V[:, undetermined:]
    return V1 @ np.diag(1.0 / eigenvalues[undetermined:]) @ V1.T @ g


def as_matrix(w, actions):
    """vec undone: W (d, p) from its columns on top of one another."""
    return w.reshape((actions, -1), order="F")


def gaussian(x, c, variance):
    """exp(−‖x − c‖² / 2σ²)."""
    return np.exp(-0.5 / variance * (x - c) @ (x - c))


def normalised_rbf(states, centres, variance):
    """b_i(x) = K(x − c_i) / Σ_j K(x − c_j)."""
    rows = [[gaussian(x, c, variance) for c in centres] for x in states]
    return np.array([np.array(row) / sum(row) for row in rows])


def locally_linear(states, centres, variance, matrices):
    """The last formula of section III-D, with each B_m over ((x − c_m)/σ, 1)."""
    predicted = []
    for x in states:
        shares = [gaussian(x, c, variance) for c in centres]
        local = [B @ np.append((x - c) / np.sqrt(variance), 1.0) for B, c in zip(matrices, centres, strict=True)]
        predicted.append(sum(s * u for s, u in zip(shares, local, strict=True)) / sum(shares))
    return np.array(predicted)


def roughness(centres, values):
    """Mean square, over kernels, of a weight less what a line through its neighbours' weights says there."""
    count, n = centres.shape
    squared = ((centres[:, None] - centres[None]) ** 2).sum(axis=2)
    near = np.mean([distance for i in range(count) for distance in sorted(np.delete(squared[i], i))[: 2 * n]])
    missed = 0.0
    for i in range(count):
        others = [j for j in range(count) if j != i]
        root = np.exp(-0.25 * squared[i, others] / near)
        line = np.column_stack([np.ones(count - 1), centres[others] - centres[i]])
        fitted = np.linalg.lstsq(root[:, None] * line, root * values[others], rcond=None)[0]
        missed += (values[i] - fitted[0]) ** 2
    return missed / count
