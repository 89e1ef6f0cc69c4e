/** What no recording tells of the actions of a policy, as `Belief` and `untold_at` say it in Python; null: not known; true: nothing. */
const untold = told && (() => {
  "use strict";
  if (told === true) return { at: () => 0, small: 1 };

  const singles = (text) => new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const { actions, models, features, misfit, small } = told, each = Array.from({ length: actions }, (_, a) => a);
  const undetermined = singles(told.undetermined), noise = singles(told.noise);

  /** Share and features of each model; of one model, features that are blended of several. */
  function owned(state) {
    const parts = features.parts(state);
    if (parts.length === models) return parts;
    const sum = [];
    for (const [share, values] of parts) values.forEach((value, i) => { sum[i] = (sum[i] || 0) + share * value; });
    return [[1, sum]];
  }

  /** The quadratic form of features in entries of a matrix: the first, and steps to the next row and column. */
  function form(matrix, first, down, along, own) {
    let sum = 0;
    for (let i = 0; i < own.length; i++)
      for (let j = 0; j < own.length; j++) sum += own[i] * own[j] * matrix[first + i * down + j * along];
    return sum;
  }

  /** The covariance of the actions that recordings leave open, in rows, and the length of the noise. */
  function spread(state) {
    const deviation = new Array(actions).fill(0), rough = deviation.slice(), mixed = each.map(() => deviation.slice());
    owned(state).forEach(([share, own], m) => {
      const p = own.length, size = p * actions;
      const of = (a, b) => form(undetermined, (m * size + a) * size + b, actions * size, actions, own);
      const sizes = each.map((a) => Math.sqrt(Math.max(of(a, a), 0)));
      for (const a of each) {
        deviation[a] += share * sizes[a];
        rough[a] += share * Math.sqrt(Math.max(form(noise, (m * actions + a) * p * p, p, 1, own), 0));
        for (const b of each) if (a !== b && sizes[a] * sizes[b] > 0) mixed[a][b] += (share * of(a, b)) / sizes[a] / sizes[b];
      }
    });
    const open = each.map((a) => each.map((b) => deviation[a] * deviation[b] * (a === b ? 1 : mixed[a][b])));
    return { open, noise: Math.hypot(...rough.map((one) => Math.hypot(one, misfit))) };
  }

  /** A standard deviation in all directions but one, as a share of a typical action; zero where noise is more, but less than that. */
  function at(state, normal, typical) {
    const found = spread(state);
    let variance = each.reduce((sum, a) => sum + found.open[a][a], 0);
    if (normal) for (const a of each) for (const b of each) variance -= normal[a] * found.open[a][b] * normal[b];
    const open = Math.sqrt(Math.max(variance, 0));
    return open < found.noise && found.noise < typical ? 0 : open / typical;
  }

  return { at, small };
})();
