/**
 * A policy from its formula: affine maps blended by normalised Gaussian kernels, or a polynomial.
 *
 * With z = x - origin, in coordinates x of the state,
 *
 *     action = sum_m s_m(x) (A_m z + b_m),   s_m = exp(e_m) / sum_k exp(e_k),   e_m = slope_m . z + offset_m.
 *
 * Returns policy(state), an array of actions, and support(state): 1 at the centre of a kernel, 0 far from all of them,
 * and null where the policy has no kernels.
 */
function policyOf({ origin, maps, exponents, monomials, precision, frame, factors }) {
  const size = origin.length, actions = maps[0].length, terms = maps[0][0].length;

  /** Entries of the rotation matrix of a quaternion, by rows, over the square root of two. */
  function rotation(w, x, y, z) {
    const scale = Math.SQRT1_2 / (w * w + x * x + y * y + z * z);
    return [
      w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
    ].map((entry) => scale * entry);
  }

  /** Coordinates of a state: of an angle its point on a circle, of an orientation its rotation matrix. */
  function coordinates(state) {
    if (!frame) return state;
    const own = [];
    let column = 0;
    for (const { columns, radius, places } of factors) {
      const values = Array.prototype.slice.call(state, column, column + columns);
      if (radius) own.push(radius * Math.cos(values[0] / radius), radius * Math.sin(values[0] / radius));
      else if (places) own.push(...rotation(...places.map((place) => values[place])));
      else own.push(...values);
      column += columns;
    }
    return frame.map((row) => row.reduce((sum, entry, i) => sum + entry * own[i], 0));
  }

  /** The state relative to the origin, and a one. */
  function relative(state) {
    const x = coordinates(state), z = new Float64Array(size + 1);
    for (let i = 0; i < size; i++) z[i] = x[i] - origin[i];
    z[size] = 1;
    return z;
  }

  function dot(row, z) {
    let sum = 0;
    for (let i = 0; i < row.length; i++) sum += row[i] * z[i];
    return sum;
  }

  /** What each map is multiplied with: (z, 1), a one, or monomials of (z, 1). */
  function regressors(z) {
    if (monomials) return monomials.map((factorsOf) => factorsOf.reduce((product, i) => product * z[i], 1));
    return terms > 1 ? z : [1];
  }

  function policy(state) {
    const z = relative(state), regressor = regressors(z), action = new Array(actions).fill(0);
    const logs = exponents ? exponents.map((slopes) => dot(slopes, z)) : [0];
    const largest = Math.max(...logs);
    let total = 0;
    for (let m = 0; m < logs.length; m++) {
      const share = Math.exp(logs[m] - largest);
      total += share;
      if (share === 0) continue;
      for (let k = 0; k < actions; k++) action[k] += share * dot(maps[m][k], regressor);
    }
    return action.map((sum) => sum / total);
  }

  function support(state) {
    if (!exponents || !precision) return null;
    const z = relative(state);
    const nearest = Math.max(...exponents.map((slopes) => dot(slopes, z)));
    return Math.exp(Math.min(0, nearest - 0.5 * precision.reduce((sum, each, i) => sum + each * z[i] * z[i], 0)));
  }

  return { policy, support };
}
