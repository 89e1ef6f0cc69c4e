/**
 * A policy from its formula: affine maps blended by normalised Gaussian kernels, or one map, affine or a
 * polynomial, whose kernels, if any, only measure support.
 *
 * With z = x - origin, in coordinates x of the state,
 *
 *     action = sum_m s_m(x) (A_m z + b_m),   s_m = exp(e_m) / sum_k exp(e_k),   e_m = slope_m . z + offset_m.
 *
 * Returns policy(state), an array of actions; support(state): 1 at the centre of a kernel, 0 far from all of them,
 * and of a policy without kernels 1 within the reach of its data, 0 outside; and under(state, projection), what is left of the action under a constraint
 * with this projection onto its null space, an array of rows. A correction lets the policy arrive, free and so.
 */
function policyOf({ origin, maps, exponents, monomials, precision, reach, frame, factors, correction }) {
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

  /** Share and values of each map. */
  function parts(state) {
    const z = relative(state), regressor = regressors(z);
    const logs = maps.length > 1 ? exponents.map((slopes) => dot(slopes, z)) : [0];
    const largest = Math.max(...logs), sizes = logs.map((log) => Math.exp(log - largest));
    const total = sizes.reduce((sum, size) => sum + size, 0);
    return maps.map((map, m) => [sizes[m] / total, sizes[m] === 0 ? [] : map.map((row) => dot(row, regressor))]);
  }

  function plain(state) {
    const action = new Array(actions).fill(0);
    for (const [share, values] of parts(state)) values.forEach((value, k) => { action[k] += share * value; });
    return action;
  }

  const clip = (value, low, high) => Math.max(low, Math.min(high, value));

  /** The velocity in the ball in which V falls, or for one outside that of its surface, or further in where it leads up V. */
  function descent(slope, z, twice, v, held) {
    const half = held(slope.map((each) => each / 2)), away = v.map((each, i) => each + half[i]);
    const distance = Math.sqrt(dot(away, away)), depth = Math.sqrt(dot(half, half));
    const allowed = Math.max(depth - correction.pace, depth / 2);
    if (distance <= allowed) return v;
    const steep = depth * Math.sqrt(dot(v, v) + correction.pace ** 2);
    const climb = steep > 0 ? Math.max(0, dot(v, half)) / steep : 0;
    const share = Math.max(0, (allowed - climb * climb * (distance - allowed)) / distance);
    return away.map((each, i) => share * each - half[i]);
  }

  /** The speed towards a surface within bounds, and the pace along it. */
  function orbit(slope, z, twice, v, held) {
    const { turn, level, middle, rate, slow, fast, least, most } = correction;
    const g = held(slope), w = held(turn.map((row) => dot(row, z)));
    const steep = Math.sqrt(dot(g, g)), width = middle * Math.sqrt(Math.max(twice, level));
    const off = (twice - level) / (2 * Math.max(steep, width));
    const outward = g.map((each) => (steep > 0 ? each / steep : 0)), speed = dot(outward, v);
    const radial = clip(speed, -(off > 0 ? fast : slow) * off, -(off > 0 ? slow : fast) * off);
    const across = dot(outward, w), round = w.map((each, i) => each - across * outward[i]);
    const pace = Math.sqrt(dot(round, round)), longest = Math.max(pace, rate * width), now = dot(round, v) / longest;
    const way = (clip(now, least * pace, most * pace) - now) / longest, share = Math.min(1, steep / width);
    return v.map((each, i) => share * (each + way * round[i] + (radial - speed) * outward[i]));
  }

  function corrected(state, held) {
    const v = held(plain(state));
    if (!correction) return v;
    const { kind, goal, directions, offsets, weights } = correction;
    const z = goal.map((each, i) => state[i] - each), slope = goal.map(() => 0);
    let twice = 0;
    directions.forEach((direction, k) => {
      const beyond = Math.max(0, dot(direction, z) - offsets[k]);
      twice += weights[k] * beyond * beyond;
      direction.forEach((each, i) => { slope[i] += weights[k] * beyond * each; });
    });
    return { descent, orbit }[kind](slope, z, twice, v, held);
  }

  const policy = (state) => corrected(state, (v) => v);
  const under = (state, projection) => corrected(state, (v) => projection.map((row) => dot(row, v)));

  function support(state) {
    const z = relative(state);
    if (!exponents || !precision) return Number(reach.every((each, i) => Math.abs(z[i]) <= each));
    const nearest = Math.max(...exponents.map((slopes) => dot(slopes, z)));
    return Math.exp(Math.min(0, nearest - 0.5 * precision.reduce((sum, each, i) => sum + each * z[i] * z[i], 0)));
  }

  return { policy, support, under, parts };
}
