/** The plate: strokes, the rails that hold them, and three learners beside each other. */
(() => {
  "use strict";

  const SIDE = 5; // kernels along a side
  const WIDTH = 0.8; // of a kernel, in distances between them
  const FOLDS = 4; // strokes are held out in so many parts
  const MOST_SAMPLES = 200; // of a stroke
  const STEP = 0.02; // between samples, the plate being two wide
  const MOST_STROKES = 40;
  const GOLDEN = (Math.sqrt(5) - 1) / 2;
  const ARROWS = Array.from({ length: 121 }, (_, i) => [-0.95 + 0.19 * Math.floor(i / 11), -0.95 + 0.19 * (i % 11)]);
  const NAMES = ["direct", "hybrid", "robust"];
  const WORDS = { direct: "Ordinary regression", hybrid: "the hybrid", robust: "the default learner" };
  const WAYS = { direct: "regression", softened: "softened hybrid", segments: "rail by rail" };

  const features = learning.kernels(learning.grid(-1, 1, SIDE), ((2 * WIDTH) / (SIDE - 1)) ** 2);
  const strokes = []; // { states, wanted, chance, moments }
  const settings = { range: 120, noise: 3, split: null };
  const learnt = { weights: {}, path: null, split: 0, support: [] };
  const pen = { x: 0, y: 0, down: false, points: [], shown: false };
  const of = (id) => document.getElementById(id);

  // -------------------------------------------------------------------------------------------- what is recorded

  /** Direction of the rail of a stroke, spread evenly over the range. */
  const railOf = (index) => {
    const angle = ((35 + settings.range * (((index + 1) * GOLDEN) % 1 - 0.5)) * Math.PI) / 180;
    return [Math.cos(angle), Math.sin(angle)];
  };

  /** Two numbers of a normal distribution, the same for the same sample of the same stroke. */
  function normal(stroke, sample) {
    let seed = (stroke * 7919 + sample * 104729 + 12345) >>> 0;
    const uniform = () => {
      seed = (seed + 0x6d2b79f5) >>> 0;
      let t = Math.imul(seed ^ (seed >>> 15), seed | 1);
      t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
      return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
    };
    const length = Math.sqrt(-2 * Math.log(1 - uniform())), angle = 2 * Math.PI * uniform();
    return [length * Math.cos(angle), length * Math.sin(angle)];
  }

  /** What the rail lets through, and noise on it. */
  function record(stroke, index) {
    const rail = railOf(index);
    stroke.rail = rail;
    stroke.actions = stroke.wanted.map((v, i) => {
      const along = v[0] * rail[0] + v[1] * rail[1];
      return [0, 1].map((k) => along * rail[k] + (settings.noise / 100) * stroke.chance[i][k]);
    });
    stroke.moments = learning.gather(features, stroke.states, stroke.actions);
  }

  /** A drawn line as states at even distances, with the direction of the line at each; null where it is a dot. */
  function sampled(points) {
    const smooth = points.map((_, i) => {
      const reach = Math.min(3, i, points.length - 1 - i), near = points.slice(i - reach, i + reach + 1);
      return [0, 1].map((k) => near.reduce((sum, one) => sum + one[k], 0) / near.length);
    });
    const lengths = [0];
    for (let i = 1; i < smooth.length; i++)
      lengths.push(lengths[i - 1] + Math.hypot(smooth[i][0] - smooth[i - 1][0], smooth[i][1] - smooth[i - 1][1]));
    const whole = lengths[lengths.length - 1];
    if (!(whole > 4 * STEP)) return null;
    const count = Math.min(MOST_SAMPLES, Math.max(12, Math.round(whole / STEP)));
    let segment = 1;
    const at = (length) => {
      while (segment < lengths.length - 1 && lengths[segment] < length) segment++;
      const before = lengths[segment - 1], share = (length - before) / Math.max(lengths[segment] - before, 1e-12);
      return [0, 1].map((k) => smooth[segment - 1][k] + share * (smooth[segment][k] - smooth[segment - 1][k]));
    };
    const states = Array.from({ length: count }, (_, i) => at((whole * i) / (count - 1)));
    const wanted = states.map((_, i) => {
      const a = states[Math.max(i - 1, 0)], b = states[Math.min(i + 1, count - 1)];
      const dx = b[0] - a[0], dy = b[1] - a[1], length = Math.hypot(dx, dy) || 1;
      return [dx / length, dy / length];
    });
    return { states, wanted };
  }

  function add(points) {
    const found = points.length > 2 && strokes.length < MOST_STROKES ? sampled(points) : null;
    if (!found) return;
    const index = strokes.length;
    strokes.push({ ...found, chance: found.states.map((_, i) => normal(index, i)) });
    refit(index);
  }

  /** Circles of different sizes that all come nearer to one: what a hand does that polishes. */
  function example() {
    strokes.length = 0;
    for (let k = 0; k < 14; k++) {
      let radius = 0.2 + 0.74 * ((k * GOLDEN * 2) % 1), angle = k * 2.4;
      const points = [];
      for (let i = 0; i < 150; i++) {
        points.push([radius * Math.cos(angle), radius * Math.sin(angle)]);
        const inward = 0.6 * (0.6 - radius), norm = Math.hypot(inward, 1);
        radius += (0.022 * inward) / norm;
        angle += 0.022 / (norm * Math.max(radius, 0.1));
      }
      const found = sampled(points);
      strokes.push({ ...found, chance: found.states.map((_, i) => normal(k, i)) });
    }
    refit(0);
  }

  // -------------------------------------------------------------------------------------------------- learning

  /** Learn from all strokes; those from an index on are recorded anew. */
  function refit(from = strokes.length) {
    const begun = performance.now();
    for (let i = from; i < strokes.length; i++) record(strokes[i], i);
    learnt.weights = {};
    if (strokes.length) {
      const parts = Array.from({ length: FOLDS }, (_, f) => strokes.filter((_, i) => i % FOLDS === f));
      const filled = parts.filter((part) => part.length);
      const folds = filled.map((part) => learning.total(part.map((one) => one.moments)));
      const whole = learning.total(folds), hybrid = learning.hybrid(folds);
      Object.assign(learnt, { path: hybrid.path, chosen: hybrid.split });
      learnt.compared = learning.compared(strokes, filled);
      learnt.weights = { direct: learning.direct(whole), robust: learnt.compared.taken.weights };
      walk();
    }
    performance.measure("refit", { start: begun });
    learnt.support = ARROWS.map(nearness);
    show();
  }

  /** How near a state is to the strokes, from 1 to 0. */
  function nearness([x, y]) {
    let least = Infinity;
    for (const { states } of strokes)
      for (let i = 0; i < states.length; i += 3) least = Math.min(least, (states[i][0] - x) ** 2 + (states[i][1] - y) ** 2);
    return Math.exp(-least / (2 * 0.13 ** 2));
  }

  /** Take the hybrid at the split of the slider, or at the one chosen by held-out strokes. */
  function walk() {
    learnt.split = settings.split === null ? learnt.chosen : Math.max(settings.split, learnt.path.lowest);
    learnt.weights.hybrid = learnt.path.at(learnt.split);
  }

  /** nUPE: mean squared distance from what was wanted, as a share of its variance. */
  function missed(weights) {
    let distance = 0, count = 0;
    const sum = [0, 0];
    for (const { states, wanted } of strokes)
      states.forEach((state, i) => {
        const found = learning.predict(features, weights, state);
        distance += (found[0] - wanted[i][0]) ** 2 + (found[1] - wanted[i][1]) ** 2;
        sum[0] += wanted[i][0];
        sum[1] += wanted[i][1];
        count += 1;
      });
    const variance = 1 - (sum[0] ** 2 + sum[1] ** 2) / count ** 2;
    return distance / count / Math.max(variance, 1e-9);
  }

  // --------------------------------------------------------------------------------------------------- showing

  const percent = (share) => {
    const said = share >= 10 ? "over 999" : share < 0.095 ? (100 * share).toFixed(1) : Math.round(100 * share);
    return `${said}\u00a0%`;
  };

  function show() {
    const truth = of("truth").checked, fitted = strokes.length > 0;
    const errors = Object.fromEntries(NAMES.map((name) => [name, fitted ? missed(learnt.weights[name]) : null]));
    for (const name of NAMES) {
      of(`${name}-number`).textContent = !fitted ? "–" : truth ? `misses ${percent(errors[name])}` : "misses ?";
      of(name).setAttribute("aria-label", !fitted ? "Nothing learnt yet." :
        `Arrows of what ${WORDS[name]} takes to be wanted, and three movements that follow them` +
        (truth ? `; misses ${percent(errors[name])} of what was wanted.` : "."));
    }
    of("verdict").textContent = verdict(errors, truth);
    of("taken").textContent = fitted ? sayWays(learnt.compared) : "";
    of("range-says").value = settings.range ? `± ${settings.range / 2}°` : "one rail";
    of("noise-says").value = `${settings.noise} %`;
    of("split").max = learnt.path ? learnt.path.size : 50;
    of("split").min = learnt.path ? learnt.path.lowest : 0;
    of("split").value = fitted ? learnt.split : 0;
    const told = fitted ? learnt.path.size - learnt.split : 0;
    of("split-says").value = fitted ? `${told} of ${learnt.path.size} directions from arrows` : "";
    of("auto").setAttribute("aria-pressed", String(settings.split === null));
    of("strokes").textContent = `${strokes.length} stroke${strokes.length === 1 ? "" : "s"}, ` +
      `${strokes.reduce((sum, one) => sum + one.states.length, 0)} samples`;
    of("undo").disabled = of("clear").disabled = !fitted;
    of("hint").style.visibility = pen.shown ? "" : "hidden";
    of("says").style.visibility = pen.shown ? "hidden" : "";
    of("says").textContent = !fitted ? "Empty. Draw a few strokes across each other; circles, say." :
      strokes.length >= MOST_STROKES ? "The plate is full." : "Stripes show how the next rail runs.";
    draw();
  }

  function verdict(errors, truth) {
    if (!strokes.length) return "Nothing is drawn yet.";
    if (!truth) return "Which of the three would you trust? Show the truth to see.";
    const best = errors.hybrid < errors.robust ? "hybrid" : "robust";
    if (errors[best] > 0.7 * errors.direct)
      return `Nobody can tell yet: regression misses ${percent(errors.direct)}, ${WORDS[best]} ${percent(errors[best])}. ` +
        "Give the rails more range, or draw more strokes over each other.";
    return `Regression misses ${percent(errors.direct)} of what the hand wanted, the paper’s hybrid ` +
      `${percent(errors.hybrid)}, the default learner ${percent(errors.robust)}.`;
  }

  /** Which way to learn was taken, and the best of each other kind, with what each misses of held-out strokes. */
  function sayWays({ ways, taken }) {
    const kind = ({ name }) => name.match(/^\w+/)[0], others = ways.filter((one) => kind(one) !== kind(taken));
    const best = [...new Set(others.map(kind))].map((each) =>
      others.filter((one) => kind(one) === each).reduce((least, one) => (one.missed < least.missed ? one : least)));
    const [first, ...rest] = [taken, ...best].map((one) => `${WAYS[kind(one)]} (${percent(one.missed)})`);
    return `: ${first}, not ${rest.join(" or ")}`;
  }

  const draw = drawing.perFrame(() => {
    drawPlate();
    for (const name of NAMES) drawLearner(name);
  });

  /** Context, and functions from the plate to pixels. */
  function square(canvas) {
    const { context, width } = drawing.sharp(canvas), scale = width / 2.16;
    const to = ([x, y]) => [width / 2 + scale * x, width / 2 - scale * y];
    return { context, width, scale, to };
  }

  function drawPlate() {
    const { context, width, scale, to } = square(of("plate"));
    stripes(context, width, railOf(strokes.length));
    context.lineWidth = 1.4;
    for (const stroke of strokes) {
      context.globalAlpha = 0.4;
      context.strokeStyle = drawing.colour("soft");
      drawing.line(context, stroke.states.map(to));
      context.globalAlpha = 0.85;
      context.strokeStyle = drawing.colour("ink");
      for (let i = 9; i < stroke.states.length; i += 22) {
        const [x, y] = to(stroke.states[i]), [u, v] = stroke.actions[i];
        drawing.arrow(context, x, y, 0.18 * scale * u, -0.18 * scale * v, 5);
      }
    }
    context.globalAlpha = 1;
    context.strokeStyle = context.fillStyle = drawing.colour("robust");
    context.lineWidth = 2.5;
    if (pen.points.length > 1) drawing.line(context, pen.points.map(to));
    if (pen.shown) {
      context.beginPath();
      context.arc(...to([pen.x, pen.y]), pen.down ? 6 : 4, 0, 7);
      context.fill();
    }
  }

  /** Faint parallel lines over the plate: how the next rail runs. */
  function stripes(context, width, rail) {
    context.strokeStyle = drawing.colour("rule");
    context.lineWidth = 1;
    const reach = width, gap = width / 18;
    for (let k = -18; k <= 18; k++) {
      const x = width / 2 + k * gap * rail[1], y = width / 2 + k * gap * rail[0];
      drawing.line(context, [[x - reach * rail[0], y + reach * rail[1]], [x + reach * rail[0], y - reach * rail[1]]]);
    }
  }

  function drawLearner(name) {
    const { context, scale, to } = square(of(name)), weights = learnt.weights[name];
    if (!weights) return;
    if (of("truth").checked) {
      context.strokeStyle = drawing.colour("ink");
      context.globalAlpha = 0.22;
      context.lineWidth = 1.2;
      for (const stroke of strokes) drawing.line(context, stroke.states.map(to));
    }
    context.strokeStyle = context.fillStyle = drawing.colour(name);
    context.lineWidth = 1.5;
    ARROWS.forEach((state, i) => {
      const [u, v] = learning.predict(features, weights, state), [x, y] = to(state);
      const size = Math.min(1, 1.5 / Math.max(Math.hypot(u, v), 1e-9)) * 0.14 * scale;
      context.globalAlpha = 0.08 + 0.7 * learnt.support[i];
      drawing.arrow(context, x - (size * u) / 2, y + (size * v) / 2, size * u, -size * v, 4);
    });
    context.globalAlpha = 1;
    context.lineWidth = 2.6;
    for (const start of startsOf()) {
      const track = followed(weights, start).map(to);
      drawing.line(context, track);
      context.beginPath();
      context.arc(...track[0], 4, 0, 7);
      context.fill();
      const [a, b] = track.slice(-2);
      drawing.arrow(context, ...a, 4 * (b[0] - a[0]), 4 * (b[1] - a[1]), 7);
    }
  }

  /** Where three of the strokes began. */
  function startsOf() {
    return [0, 1, 2].map((k) => Math.floor((k * strokes.length) / 3)).filter((k, i, all) => all.indexOf(k) === i)
      .map((k) => strokes[k].states[0]);
  }

  /** A movement that follows the policy, while it is on the plate. */
  function followed(weights, start) {
    const track = [start], step = 0.02;
    for (let i = 0; i < 170; i++) {
      const [x, y] = track[track.length - 1], [u, v] = learning.predict(features, weights, [x, y]);
      const limit = Math.min(1, 2 / Math.max(Math.hypot(u, v), 1e-9));
      track.push([x + step * limit * u, y + step * limit * v]);
      if (Math.max(Math.abs(x), Math.abs(y)) > 1) break;
    }
    return track;
  }

  // -------------------------------------------------------------------------------------------------- drawing in

  const plate = of("plate");

  function place(event) {
    const box = plate.getBoundingClientRect(), scale = box.width / 2.16;
    const clip = (value) => Math.max(-1, Math.min(1, value));
    pen.x = clip((event.clientX - box.left - box.width / 2) / scale);
    pen.y = clip(-(event.clientY - box.top - box.height / 2) / scale);
  }

  function lower() {
    pen.down = true;
    pen.points = [[pen.x, pen.y]];
    draw();
  }

  function lift() {
    if (!pen.down) return;
    const points = pen.points;
    Object.assign(pen, { down: false, points: [] });
    add(points);
    draw();
  }

  function move() {
    const last = pen.points[pen.points.length - 1];
    if (pen.down && Math.hypot(pen.x - last[0], pen.y - last[1]) > 0.002) pen.points.push([pen.x, pen.y]);
    draw();
  }

  plate.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    plate.setPointerCapture(event.pointerId);
    pen.shown = false;
    place(event);
    lower();
  });
  plate.addEventListener("pointermove", (event) => {
    if (!pen.down) return;
    for (const one of event.getCoalescedEvents?.().length ? event.getCoalescedEvents() : [event]) {
      place(one);
      move();
    }
  });
  for (const name of ["pointerup", "pointercancel"]) plate.addEventListener(name, lift);

  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  plate.addEventListener("keydown", (event) => {
    const way = KEYS[event.key];
    if (way) {
      pen.shown = true;
      pen.x = Math.max(-1, Math.min(1, pen.x + 0.04 * way[0]));
      pen.y = Math.max(-1, Math.min(1, pen.y + 0.04 * way[1]));
      move();
    } else if (event.key === " " || event.key === "Enter") {
      pen.shown = true;
      if (pen.down) lift();
      else lower();
    } else if (event.key === "Delete" || event.key === "Backspace") {
      of("undo").click();
    } else return;
    event.preventDefault();
  });
  plate.addEventListener("focus", () => {
    pen.shown = plate.matches(":focus-visible");
    show();
  });
  plate.addEventListener("blur", () => {
    pen.shown = false;
    lift();
    show();
  });

  of("undo").addEventListener("click", () => {
    strokes.pop();
    refit();
  });
  of("clear").addEventListener("click", () => {
    strokes.length = 0;
    refit();
  });
  of("example").addEventListener("click", () => {
    settings.split = null;
    example();
  });
  for (const name of ["range", "noise"]) {
    of(name).value = settings[name];
    of(name).addEventListener("input", (event) => {
      settings[name] = Number(event.target.value);
      refit(0);
    });
  }
  of("split").addEventListener("input", (event) => {
    settings.split = Number(event.target.value);
    if (strokes.length) walk();
    show();
  });
  of("auto").addEventListener("click", () => {
    settings.split = null;
    if (strokes.length) walk();
    show();
  });
  of("truth").addEventListener("change", show);
  drawing.onChange(draw);
  window.plate = { strokes, learnt, settings }; // to look at
  example();
})();
