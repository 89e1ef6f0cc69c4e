/**
 * Learning in the page: the closed forms of the method, from sums over the samples.
 *
 * A policy is W phi(x) with weights W (d, p). All matrices are flat Float64Arrays, by rows. Weights are one vector w with
 * w[j d + k] = W[k][j]. A quadratic is { hessian, linear, constant }: f(w) = constant - 2 linear.w + w.hessian.w.
 *
 * What is here and what it is called in Python: direct is Direct(), hybrid is Hybrid(), segments is
 * Segments(labels="groups"), for demonstrations that had one constraint each, and compared does in short what the default
 * learner does, Robust(). The tests hold weights and held-out losses against those of Python.
 */
const learning = (() => {
  "use strict";

  const NOISE = 1e-10; // eigenvalues of the first objective below this share of the largest are rounding
  const SECONDARY_NOISE = 1e-12; // the same for the second
  const DEPENDENT = 1e-14; // combinations of features with less than this share of the largest are dependent
  const UNDETERMINED = 1e-6; // shares of the second objective's curvature below this are rounding
  const UNDERFLOW = 1e-290;
  const LEAST_DIFFERENCES = 12; // samples from which on a demonstration tells its own noise
  const MEDIANS = [0, 0.454936423119572, 1.3862943611198906, 2.365973884375338]; // of chi squared
  const FIRST_SOFTNESS = 1e-2, LEAST_SOFTNESS = 1e-8, BALANCE_STEPS = 6, MOST_OF_LEAST = 1.02;
  const SOFTNESSES = [1, 0.1, 0.01, 1e-3]; // of the softened hybrids that are compared

  // ------------------------------------------------------------------------------------------------- features

  /** Centres of a regular grid over a square, the last axis varying fastest. */
  function grid(low, high, perAxis) {
    const tick = (i) => low + ((high - low) * i) / (perAxis - 1);
    return Array.from({ length: perAxis * perAxis }, (_, i) => [tick(Math.floor(i / perAxis)), tick(i % perAxis)]);
  }

  /** Gaussian kernels about some centres, normalised to sum to one at each state. */
  function kernels(centres, variance) {
    const count = centres.length;
    const features = (state) => {
      const shares = new Float64Array(count);
      let nearest = Infinity, sum = 0;
      for (let j = 0; j < count; j++) {
        const centre = centres[j];
        for (let i = 0; i < centre.length; i++) shares[j] += (state[i] - centre[i]) ** 2;
        nearest = Math.min(nearest, shares[j]);
      }
      for (let j = 0; j < count; j++) sum += shares[j] = Math.exp((nearest - shares[j]) / (2 * variance));
      for (let j = 0; j < count; j++) shares[j] /= sum;
      return shares;
    };
    return Object.assign(features, { size: count });
  }

  // -------------------------------------------------------------------------------------------------- moments

  /** The five sums of no sample: weight, energy, sum of u phi', phi phi' and phi phi' x uu'/|u|^2. */
  function moments(p, d) {
    const size = p * d;
    return {
      p, d, weight: 0, energy: 0,
      cross: new Float64Array(size), gram: new Float64Array(p * p), consistent: new Float64Array(size * size),
    };
  }

  /** Moments of samples of states and actions; an action of zero has no direction. */
  function gather(features, states, actions) {
    const p = features.size, d = actions[0].length, size = p * d, sums = moments(p, d);
    const row = new Float64Array(size);
    states.forEach((state, sample) => {
      const phi = features(state), u = actions[sample];
      const energy = u.reduce((sum, each) => sum + each * each, 0);
      sums.weight += 1;
      sums.energy += energy;
      const length = Math.sqrt(energy) || 1;
      for (let j = 0; j < p; j++) {
        for (let k = 0; k < d; k++) {
          sums.cross[j * d + k] += u[k] * phi[j];
          row[j * d + k] = (phi[j] * u[k]) / length;
        }
        for (let i = 0; i <= j; i++) sums.gram[j * p + i] += phi[j] * phi[i];
      }
      for (let j = 0; j < size; j++) {
        const own = row[j], at = j * size;
        if (own) for (let i = 0; i <= j; i++) sums.consistent[at + i] += own * row[i];
      }
    });
    mirror(sums.gram, p);
    mirror(sums.consistent, size);
    return sums;
  }

  /** Moments of several sets of samples together. */
  function total(parts) {
    const sums = moments(parts[0].p, parts[0].d);
    for (const part of parts) {
      sums.weight += part.weight;
      sums.energy += part.energy;
      for (const name of ["cross", "gram", "consistent"]) {
        const into = sums[name], from = part[name];
        for (let i = 0; i < into.length; i++) into[i] += from[i];
      }
    }
    return sums;
  }

  /** Each fold that holds something, beside all others together. */
  function rounds(folds) {
    const filled = folds.filter((fold) => fold.weight > 0);
    if (filled.length < 2) return [];
    return filled.map((held) => ({ held, rest: total(filled.filter((one) => one !== held)) }));
  }

  // ----------------------------------------------------------------------------------------------- objectives

  /** Squared distance of each action from the policy projected onto it (eqs 4 and 14), plus softness times the risk. */
  function consistency(sums, softness = 0) {
    const { p, d } = sums, size = p * d, hessian = sums.consistent.slice();
    if (softness) {
      for (let j = 0; j < p; j++)
        for (let i = 0; i < p; i++)
          for (let k = 0; k < d; k++) hessian[(j * d + k) * size + i * d + k] += softness * sums.gram[j * p + i];
    }
    return {
      hessian, size,
      linear: sums.cross.map((each) => (1 + softness) * each),
      constant: (1 + softness) * sums.energy,
    };
  }

  function value({ hessian, linear, constant, size }, w) {
    let sum = constant;
    for (let i = 0; i < size; i++) sum += w[i] * (dot(hessian, i * size, w, 0, size) - 2 * linear[i]);
    return Number.isFinite(sum) ? Math.max(sum, 0) : Infinity;
  }

  // ------------------------------------------------------------------------------------------- linear algebra

  function dot(a, from, b, at, count) {
    let sum = 0;
    for (let i = 0; i < count; i++) sum += a[from + i] * b[at + i];
    return sum;
  }

  function mirror(a, n) {
    for (let j = 0; j < n; j++) for (let i = 0; i < j; i++) a[i * n + j] = a[j * n + i];
  }

  function transposed(a, rows, columns) {
    const b = new Float64Array(a.length);
    for (let i = 0; i < rows; i++) for (let j = 0; j < columns; j++) b[j * rows + i] = a[i * columns + j];
    return b;
  }

  /** a (n, m) times the transpose of b (k, m). */
  function timesTransposed(a, b, n, m, k) {
    const c = new Float64Array(n * k);
    for (let i = 0; i < n; i++) for (let j = 0; j < k; j++) c[i * k + j] = dot(a, i * m, b, j * m, m);
    return c;
  }

  /** a (n, m) times a vector. */
  function times(a, v, n, m) {
    return Float64Array.from({ length: n }, (_, i) => dot(a, i * m, v, 0, m));
  }

  /**
   * Eigenvalues of a symmetric matrix, ascending, and its eigenvectors as rows.
   *
   * Householder reflections make it tridiagonal, implicit QL steps with Wilkinson's shifts make that diagonal (Golub and
   * Van Loan, Matrix Computations, section 8.3).
   */
  function eigensystem(matrix, n) {
    const a = matrix.slice(), vectors = new Float64Array(n * n);
    const largest = a.reduce((most, each) => Math.max(most, Math.abs(each)), 0);
    const unit = largest > UNDERFLOW ? largest : 1;
    for (let i = 0; i < n * n; i++) a[i] = Math.abs(a[i] / unit) > 1e-60 ? a[i] / unit : 0;
    const reflections = tridiagonal(a, n);
    for (let i = 0; i < n; i++) vectors[i * n + i] = 1;
    for (let k = reflections.length - 1; k >= 0; k--) if (reflections[k]) reflect(vectors, reflections[k], k + 1, n);
    const diagonal = Float64Array.from({ length: n }, (_, i) => a[i * n + i]);
    const beside = Float64Array.from({ length: n }, (_, i) => (i + 1 < n ? a[(i + 1) * n + i] : 0));
    diagonalise(diagonal, beside, vectors, n);
    const order = Array.from(diagonal.keys()).sort((i, j) => diagonal[i] - diagonal[j]);
    const sorted = new Float64Array(n * n);
    order.forEach((from, to) => sorted.set(vectors.subarray(from * n, from * n + n), to * n));
    return { values: Float64Array.from(order, (i) => diagonal[i] * unit), vectors: sorted };
  }

  /** Make a symmetric matrix tridiagonal, in place; returns the unit vectors of the reflections. */
  function tridiagonal(a, n) {
    const found = [];
    for (let k = 0; k < n - 2; k++) {
      const m = n - k - 1, v = new Float64Array(m);
      for (let i = 0; i < m; i++) v[i] = a[(k + 1 + i) * n + k];
      const length = Math.sqrt(dot(v, 0, v, 0, m));
      let below = 0;
      for (let i = 1; i < m; i++) below = Math.max(below, Math.abs(v[i]));
      if (below === 0) {
        found.push(null);
        continue;
      }
      const kept = v[0] > 0 ? -length : length;
      v[0] -= kept;
      const norm = Math.sqrt(dot(v, 0, v, 0, m));
      for (let i = 0; i < m; i++) v[i] /= norm;
      const w = new Float64Array(m);
      for (let i = 0; i < m; i++) w[i] = 2 * dot(a, (k + 1 + i) * n + k + 1, v, 0, m);
      const along = dot(v, 0, w, 0, m);
      for (let i = 0; i < m; i++) w[i] -= along * v[i];
      for (let i = 0; i < m; i++) {
        const at = (k + 1 + i) * n + k + 1, vi = v[i], wi = w[i];
        for (let j = 0; j < m; j++) a[at + j] -= vi * w[j] + wi * v[j];
      }
      a[(k + 1) * n + k] = kept;
      found.push(v);
    }
    return found;
  }

  /** Multiply the rows from a place on by a reflection, on the right. */
  function reflect(rows, v, from, n) {
    for (let i = from; i < n; i++) {
      const at = i * n + from, twice = 2 * dot(rows, at, v, 0, v.length);
      for (let j = 0; j < v.length; j++) rows[at + j] -= twice * v[j];
    }
  }

  /** Eigenvalues of a tridiagonal matrix, in place of its diagonal; the rotations are applied to the rows of vectors. */
  function diagonalise(diagonal, beside, vectors, n) {
    for (let l = 0; l < n; l++) {
      for (let step = 0; step < 60; step++) {
        let m = l;
        while (m < n - 1) {
          const near = Math.abs(diagonal[m]) + Math.abs(diagonal[m + 1]);
          if (Math.abs(beside[m]) <= Number.EPSILON * near || Math.abs(beside[m]) < 1e-300) break;
          m++;
        }
        if (m === l) break;
        let g = (diagonal[l + 1] - diagonal[l]) / (2 * beside[l]);
        let r = Math.hypot(g, 1);
        g = diagonal[m] - diagonal[l] + beside[l] / (g + (g < 0 ? -r : r));
        let sine = 1, cosine = 1, shift = 0, i = m - 1;
        for (; i >= l; i--) {
          let f = sine * beside[i];
          const b = cosine * beside[i];
          r = Math.hypot(f, g);
          beside[i + 1] = r;
          if (r === 0) {
            diagonal[i + 1] -= shift;
            beside[m] = 0;
            break;
          }
          sine = f / r;
          cosine = g / r;
          g = diagonal[i + 1] - shift;
          r = (diagonal[i] - g) * sine + 2 * cosine * b;
          shift = sine * r;
          diagonal[i + 1] = g + shift;
          g = cosine * r - b;
          const low = i * n, high = low + n;
          for (let k = 0; k < n; k++) {
            f = vectors[high + k];
            vectors[high + k] = sine * vectors[low + k] + cosine * f;
            vectors[low + k] = cosine * vectors[low + k] - sine * f;
          }
        }
        if (r === 0 && i >= l) continue;
        diagonal[l] -= shift;
        beside[l] = g;
        beside[m] = 0;
      }
    }
  }

  /** Cholesky factor L of a symmetric matrix, or null where a pivot is not positive or too small. */
  function cholesky(a, n, least = 0) {
    const lower = new Float64Array(n * n);
    let smallest = Infinity, largest = 0;
    for (let i = 0; i < n; i++) {
      for (let j = 0; j < i; j++)
        lower[i * n + j] = (a[i * n + j] - dot(lower, i * n, lower, j * n, j)) / lower[j * n + j];
      const pivot = a[i * n + i] - dot(lower, i * n, lower, i * n, i);
      if (!(pivot > 0)) return null;
      smallest = Math.min(smallest, pivot);
      largest = Math.max(largest, pivot);
      lower[i * n + i] = Math.sqrt(pivot);
    }
    return smallest > least * largest ? lower : null;
  }

  /** Solve L y = r for the rows r of a matrix (k, n). */
  function solveLower(lower, rows, n, k) {
    const solved = rows.slice();
    for (let r = 0; r < k; r++) {
      const at = r * n;
      for (let i = 0; i < n; i++)
        solved[at + i] = (solved[at + i] - dot(lower, i * n, solved, at, i)) / lower[i * n + i];
    }
    return solved;
  }

  /** A matrix with eigenvalues that are rounding replaced by the largest. */
  function raised(matrix, n) {
    const { values, vectors } = eigensystem(matrix, n), largest = values[n - 1];
    const kept = values.map((each) => (largest <= UNDERFLOW ? 1 : each > SECONDARY_NOISE * largest ? each : largest));
    const roots = vectors.map((each, i) => each * Math.sqrt(kept[Math.floor(i / n)]));
    const columns = transposed(roots, n, n);
    return timesTransposed(columns, columns, n, n, n);
  }

  /** A matrix as it is where no eigenvalue is rounding, else with those raised. */
  function regular(matrix, n) {
    return cholesky(matrix, n, SECONDARY_NOISE) ? matrix : raised(matrix, n);
  }

  /** Minimum of w.H w - 2 g.w; directions in which H is zero stay zero. */
  function minimum(hessian, linear, n) {
    const lower = cholesky(hessian, n, SECONDARY_NOISE) || cholesky(raised(hessian, n), n);
    const w = solveLower(lower, linear, n, 1);
    for (let i = n - 1; i >= 0; i--) {
      const at = i * n, wi = (w[i] /= lower[at + i]);
      for (let j = 0; j < i; j++) w[j] -= lower[at + j] * wi;
    }
    return w;
  }

  /** a plus a share of b. */
  function combined(a, b, share = 1) {
    const sum = a.slice();
    for (let i = 0; i < sum.length; i++) sum[i] += share * b[i];
    return sum;
  }

  /** Rows (k, p) of features as rows (k d, p d) of weights: each for every action. */
  function forEveryAction(rows, k, p, d) {
    const wide = new Float64Array(k * d * p * d);
    for (let i = 0; i < k; i++)
      for (let j = 0; j < p; j++)
        for (let a = 0; a < d; a++) wide[(i * d + a) * p * d + j * d + a] = rows[i * p + j];
    return wide;
  }

  /** rows H rows' for the symmetric H (n, n) and k rows, exactly symmetric. */
  function within(hessian, rows, n, k) {
    const half = timesTransposed(rows, hessian, k, n, n), whole = new Float64Array(k * k);
    for (let i = 0; i < k; i++) for (let j = 0; j <= i; j++) whole[i * k + j] = dot(half, i * n, rows, j * n, n);
    mirror(whole, k);
    return whole;
  }

  // -------------------------------------------------------------------------------------------------- learners

  /** Minimum of the standard risk (eq. 5): ordinary regression. */
  function direct({ p, d, gram, cross }) {
    const each = Array.from({ length: d }, (_, k) => minimum(gram, cross.filter((_, i) => i % d === k), p));
    return Float64Array.from({ length: p * d }, (_, i) => each[i % d][Math.floor(i / d)]);
  }

  /**
   * The inconsistency first, then the standard risk in the directions that it leaves undetermined (eqs 6 to 13).
   *
   * Exact for every split of the eigenvectors: with H = V D V', V' M V = L L' and A = V L^-T, the solution where the k
   * smallest eigenvalues are undetermined is A (beta[:k], gamma[k:]), beta = A' m, gamma = L' D^-1 V' g. With a softness
   * s the first objective is the inconsistency plus s times the standard risk.
   */
  function path(sums, softness = 0) {
    const first = consistency(sums, softness), { p, d } = sums, { size } = first;
    const { values, vectors } = eigensystem(first.hessian, size);
    const largest = values[size - 1];
    const isNoise = (each) => each <= NOISE * largest || largest <= UNDERFLOW;
    const lowest = values.filter(isNoise).length;
    const along = times(vectors, first.linear, size, size).map((each, i) => (isNoise(values[i]) ? 0 : each / values[i]));
    const gram = forEveryAction(regular(sums.gram, p), p, p, d);
    const lower = cholesky(within(gram, vectors, size, size), size);
    const basis = transposed(solveLower(lower, transposed(vectors, size, size), size, size), size, size); // rows of A'
    const undetermined = times(basis, sums.cross, size, size);
    const determined = times(transposed(lower, size, size), along, size, size);
    const at = (split) => {
      const w = new Float64Array(size);
      for (let s = 0; s < size; s++) {
        const share = s < split ? undetermined[s] : determined[s];
        if (share) for (let i = 0; i < size; i++) w[i] += share * basis[s * size + i];
      }
      return w;
    };
    const finest = lowest ? finestOf(sums, first, size - lowest) || at(lowest) : at(0);
    return {
      values, lowest, size,
      at: (split) => (split <= lowest ? finest : at(split)),
      /** How many eigenvalues do not exceed a share of the largest. */
      split: (threshold) => Math.max(lowest, values.filter((each) => each <= threshold * largest).length),
      /** Largest undetermined eigenvalue as a share of the largest. */
      threshold: (split) => (split > 0 && largest > 0 ? values[split - 1] / largest : 0),
      /** Calls back with the weights at every split from the lowest on. */
      walk(visit) {
        const w = finest.slice();
        visit(lowest, w, true);
        w.set(at(lowest));
        for (let s = lowest; s < size; s++) {
          const change = undetermined[s] - determined[s];
          for (let i = 0; i < size; i++) w[i] += change * basis[s * size + i];
          visit(s + 1, w, false);
        }
      },
    };
  }

  /** The solution of the finest split in features made orthonormal, where more directions are determined so; or null. */
  function finestOf(sums, first, count) {
    const { p, d } = sums, size = p * d, { values, vectors } = eigensystem(sums.gram, p), rows = [];
    for (let e = 0; e < p; e++)
      if (values[e] > DEPENDENT * values[p - 1] && values[p - 1] > UNDERFLOW)
        for (let i = 0; i < p; i++) rows.push(vectors[e * p + i] / Math.sqrt(values[e]));
    const kept = rows.length / p, whitening = forEveryAction(Float64Array.from(rows), kept, p, d), k = kept * d;
    const found = eigensystem(within(first.hessian, whitening, size, k), k);
    const isDetermined = found.values.map((each) => (each > UNDETERMINED ? 1 : 0));
    if (isDetermined.reduce((sum, each) => sum + each, 0) <= count) return null;
    const basis = timesTransposed(found.vectors, transposed(whitening, k, size), k, k, size);
    const wanted = times(basis, first.linear, k, size).map((each, i) => each / found.values[i]);
    const along = times(basis, sums.cross, k, size).map((each, i) => (isDetermined[i] ? wanted[i] : each));
    return times(transposed(basis, k, size), along, size, k);
  }

  /**
   * The paper's hybrid: the path, and the split of least E_i + alpha E_2 on held-out folds (geometric mean, section III-C).
   */
  function hybrid(folds, alpha = 0.1) {
    const whole = total(folds), walked = path(whole), every = rounds(folds);
    const judged = (every.length ? every : [{ rest: whole, held: whole }]).map(({ rest, held }) => {
      const score = consistency(held, alpha), values = new Float64Array(walked.size + 1);
      path(rest).walk((split, w, first) => values.fill(value(score, w), first ? 0 : split));
      return { values, weight: held.weight, energy: held.energy };
    });
    const floor = (1e-9 * judged.reduce((sum, one) => sum + one.energy, 0)) /
      judged.reduce((sum, one) => sum + one.weight, 0);
    const scores = Float64Array.from({ length: walked.size + 1 }, (_, split) =>
      judged.reduce((sum, one) => sum + one.weight * Math.log(one.values[split] / one.weight + floor), 0));
    const best = Math.min(...scores);
    const chosen = Math.max(scores.lastIndexOf(best), walked.lowest);
    return { path: walked, split: chosen, weights: walked.at(chosen) };
  }

  /**
   * Least constrained error where every demonstration has one constraint of its own: Segments(labels="groups").
   *
   * The projection N of a demonstration is onto the directions in which its actions exceed the noise; minimised is the
   * sum of |N (u - policy)|^2, plus s times the standard risk. The softness s is the error missed over the risk missed
   * beside it, times 1 / n, by iteration; times P / n where the error on held-out folds is then clearly less.
   */
  function segments(demonstrations, folds = demonstrations.map((one) => [one])) {
    const most = mostNoise(demonstrations), parts = folds.map((fold) => constrained(fold, most));
    const every = parts.reduce(plus), { size } = every.error;
    const tried = [1, size].map((worth) => {
      const { w, softness } = balanced(every, worth);
      const refits = parts.map((held) => {
        const rest = parts.filter((one) => one !== held);
        return rest.length ? softened(rest.reduce(plus), softness) : w;
      });
      const missed = parts.reduce((sum, held, f) => sum + Math.max(value(held.error, refits[f]), 0), 0);
      return { weights: w, refits, missed };
    });
    const least = Math.min(...tried.map((one) => one.missed));
    return tried.find((one) => one.missed <= MOST_OF_LEAST * least) || tried[1];
  }

  /**
   * The default learner in short: of several ways to learn, the one that misses least of held-out motion.
   *
   * Ways are regression, the minimum of E_i + s E_2 for some softnesses s, and segments. Missed is what held-out motion
   * shows, as a share of its squares. Robust() has more ways, and adds what that does not show: variance and bias.
   */
  function compared(demonstrations, folds = demonstrations.map((one) => [one])) {
    const parts = folds.map((fold) => total(fold.map((one) => one.moments))), whole = total(parts);
    const rests = parts.map((held) => (parts.length > 1 ? total(parts.filter((one) => one !== held)) : held));
    const way = (name, learnt) => ({ name, weights: learnt(whole), refits: rests.map(learnt) });
    const ways = SOFTNESSES.map((s) => way(`softened hybrid, ${s}`, (sums) => {
      const { hessian, linear, size } = consistency(sums, s);
      return minimum(hessian, linear, size);
    }));
    ways.unshift(way("direct", direct));
    ways.push({ name: "segments", ...segments(demonstrations, folds) });
    const most = mostNoise(demonstrations), told = folds.map((fold) => fold.map((one) => shownBy(one, most)).reduce(added));
    for (const one of ways)
      one.missed = told.reduce((sum, error, f) => sum + value(error, one.refits[f]), 0) / whole.energy;
    return { ways, taken: ways.reduce((best, one) => (one.missed < best.missed ? one : best)) };
  }

  /** Variance of the noise on the actions of any demonstration, at most. */
  function mostNoise(demonstrations) {
    const { d, energy, weight } = total(demonstrations.map((one) => one.moments));
    return Math.min(noise(demonstrations.map((one) => one.actions), d), energy / weight);
  }

  /** Directions in which a demonstration moved; a short one has the noise of all. */
  function movedAlong({ actions, moments: { d } }, most) {
    return projection(actions, actions.length < LEAST_DIFFERENCES ? most : noise([actions], d));
  }

  /** What a demonstration shows to be missed: where it moved, if in some directions alone; else along each action. */
  function shownBy(one, most) {
    const { p, d } = one.moments, size = p * d, found = movedAlong(one, most);
    const rank = found.filter((_, i) => i % (d + 1) === 0).reduce((sum, each) => sum + each, 0);
    if (rank < 0.5 || rank > d - 0.5) return consistency(one.moments);
    const error = { hessian: new Float64Array(size * size), linear: new Float64Array(size), constant: 0, size };
    addConstrained(error, one.moments, one.actions, found);
    return error;
  }

  /** Constrained error and standard risk of some demonstrations. */
  function constrained(some, most) {
    const { p, d, gram, cross, energy, weight } = total(some.map((one) => one.moments)), size = p * d;
    const error = { hessian: new Float64Array(size * size), linear: new Float64Array(size), constant: 0, size };
    for (const one of some) addConstrained(error, one.moments, one.actions, movedAlong(one, most));
    const risk = { hessian: forEveryAction(gram, p, p, d), linear: cross, constant: energy, size };
    return { error, risk, weight };
  }

  /** The sum of two quadratics. */
  function added(a, b) {
    const hessian = combined(a.hessian, b.hessian), linear = combined(a.linear, b.linear);
    return { hessian, linear, constant: a.constant + b.constant, size: a.size };
  }

  function plus(one, other) {
    return { error: added(one.error, other.error), risk: added(one.risk, other.risk), weight: one.weight + other.weight };
  }

  /** The least of the error plus the softness times the risk. */
  function softened({ error, risk }, softness) {
    return minimum(combined(error.hessian, risk.hessian, softness), combined(error.linear, risk.linear, softness),
      error.size);
  }

  /** Softness, and the least with it, of a prior that has the information of so many samples. */
  function balanced(every, worth) {
    let softness = FIRST_SOFTNESS;
    for (let step = 0; step < BALANCE_STEPS; step++) {
      const w = softened(every, softness), loss = value(every.error, w), taken = value(every.risk, w);
      const next = ((worth / every.weight) * loss) / Math.max(taken - loss, 1e-3 * taken + 1e-300);
      softness = Math.min(Math.max(next, LEAST_SOFTNESS), 1);
    }
    return { softness, w: softened(every, softness) };
  }

  /** Variance of the noise on each action, from the median of squared fourth differences within demonstrations. */
  function noise(demonstrations, d) {
    const squares = [];
    for (const u of demonstrations)
      for (let i = 0; i + 4 < u.length; i++) {
        let square = 0;
        for (let k = 0; k < d; k++)
          square += (u[i][k] - 4 * u[i + 1][k] + 6 * u[i + 2][k] - 4 * u[i + 3][k] + u[i + 4][k]) ** 2;
        squares.push(square);
      }
    if (!squares.length) return Infinity;
    const sorted = Float64Array.from(squares).sort(), middle = sorted.length >> 1;
    const median = (sorted[middle] + sorted[(sorted.length - 1) >> 1]) / 2;
    return median / MEDIANS[d] / 70; // the squares of 1, 4, 6, 4 and 1 sum to 70
  }

  /** Projection (d, d) onto the directions in which some actions exceed noise of a variance. */
  function projection(actions, variance) {
    const d = actions[0].length, second = new Float64Array(d * d), found = new Float64Array(d * d);
    for (const u of actions)
      for (let i = 0; i < d; i++) for (let j = 0; j < d; j++) second[i * d + j] += (u[i] * u[j]) / actions.length;
    const { values, vectors } = eigensystem(second, d), largest = values[d - 1];
    for (let e = 0; e < d; e++)
      if (values[e] > Math.max(9 * variance, 1e-18 * largest))
        for (let i = 0; i < d; i++) for (let j = 0; j < d; j++) found[i * d + j] += vectors[e * d + i] * vectors[e * d + j];
    return found;
  }

  /** Add the sum of |N (u - policy)|^2 over samples of some moments. */
  function addConstrained(error, { p, d, gram, cross }, actions, projected) {
    const size = p * d;
    for (const u of actions) for (let a = 0; a < d; a++) error.constant += u[a] * dot(projected, a * d, u, 0, d);
    for (let j = 0; j < p; j++)
      for (let a = 0; a < d; a++) {
        const at = (j * d + a) * size;
        for (let i = 0; i < p; i++)
          for (let b = 0; b < d; b++) error.hessian[at + i * d + b] += gram[j * p + i] * projected[a * d + b];
        error.linear[j * d + a] += dot(projected, a * d, cross, j * d, d);
      }
  }

  /** Action of the policy of some weights at a state. */
  function predict(features, weights, state) {
    const phi = features(state), d = weights.length / phi.length, action = new Array(d).fill(0);
    for (let j = 0; j < phi.length; j++) for (let k = 0; k < d; k++) action[k] += phi[j] * weights[j * d + k];
    return action;
  }

  return { grid, kernels, gather, total, direct, hybrid, segments, compared, predict };
})();
