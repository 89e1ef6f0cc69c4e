/** Demonstrations in space and in time; the numbers are in `shown`, the policy, if any, in `learnt`. */
(() => {
  "use strict";

  const of = (id) => document.getElementById(id);
  const made = (tag, properties = {}) => Object.assign(document.createElement(tag), properties);
  const HUES = { light: ["#0072b2", "#c2570c", "#007d5f", "#a3508a", "#8a6d00", "#3a4cc0", "#b3261e", "#4d7a1e", "#7a4f33",
    "#0b8a9e", "#d6339a", "#4a4f57"],
    dark: ["#56b4e9", "#f0a35e", "#3ecf9f", "#e29bc9", "#e3cf57", "#8f9bff", "#ff8a7a", "#a3d36b", "#c49a78",
    "#4fd6e0", "#ff7ac6", "#c3c8cf"] };
  const RAMPS = { light: ["#b98900", "#6c9430", "#1a8f70", "#1c7a92", "#31559b", "#481f70"],
    dark: ["#4a51a8", "#3b80b8", "#2fa8a0", "#5ec66f", "#b4da45", "#fde725"] };
  const NEAR_DATA = 1e-3; // support below which the policy is far from all data
  const NEARBY = 0.6; // support below which no demonstration came by, as in the verdict of `unconstrain rollout`
  const STEPS = 1500; // of a roll-out, at most
  const BEYOND = 0.25; // how far it is followed beyond the data, as a share of the extent
  const isDark = () => window.matchMedia("(prefers-color-scheme: dark)").matches;
  const theme = () => (isDark() ? "dark" : "light");

  // ------------------------------------------------------------------------------------------------- the numbers

  /** Values that were stored as 65535ths of their range. */
  function values({ low, high, bits }) {
    const bytes = Uint8Array.from(atob(bits), (letter) => letter.charCodeAt(0));
    const found = new Float32Array(bytes.length / 2);
    const step = (high - low) / 65535;
    for (let i = 0; i < found.length; i++) found[i] = low + step * (bytes[2 * i] + 256 * bytes[2 * i + 1]);
    return found;
  }

  const demos = shown.demonstrations.map((one, index) => ({
    index,
    name: one.name || `demonstration ${index + 1}`,
    times: values(one.times),
    states: one.states.map(values),
    speed: values(one.speed),
    regions: values(one.regions),
    free: one.free && values(one.free),
    marks: shown.marks[index] || [],
    kept: true,
  }));
  const lengthOf = (demo) => demo.times[demo.times.length - 1] || 0;
  const several = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;
  const count = shown.columns.length;
  const named = shown.columns.map((name, i) => (shown.units[i] && !/[\])]$/.test(name) ? `${name}, ${shown.units[i]}` : name));
  const clock = shown.timed ? "s" : "samples";
  const longest = Math.max(...demos.map((one) => lengthOf(one)), 1e-9);

  /** Values of a column of a demonstration; the one after the last is the time. */
  const column = (demo, which) => (which < count ? demo.states[which] : demo.times);
  const labelOf = (which) => (which < count ? named[which] : `time, ${clock}`);
  const axes = count === 1 ? [count, 0] : count === 2 ? [0, 1] : [0, 1, 2];

  const number = (value) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    return (size >= 1e5 || size < 1e-3 ? value.toExponential(1) : String(+value.toPrecision(3))).replace("-", "−");
  };

  // ---------------------------------------------------------------------------------------------------- the box

  const box = { low: [], high: [], middle: [], size: [], step: [] };

  /** Round numbers around everything, the same step along all axes, which are equally long; time is fitted in. */
  function measure() {
    const ranges = axes.map((which) => {
      let low = Infinity, high = -Infinity;
      for (const demo of demos) for (const value of column(demo, which)) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
      return [low, high];
    });
    const largest = Math.max(...ranges.filter((_, i) => axes[i] < count).map(([low, high]) => high - low), 1e-9);
    ranges.forEach(([low, high], i) => {
      const isTime = axes[i] >= count, step = rounded((isTime ? high - low || 1 : largest) / 5);
      box.step[i] = step;
      box.low[i] = step * Math.floor(low / step - 0.05);
      box.high[i] = Math.max(step * Math.ceil(high / step + 0.05), box.low[i] + step);
      box.middle[i] = (box.low[i] + box.high[i]) / 2;
      box.size[i] = isTime ? 0.8 * (largest / (box.high[i] - box.low[i])) : 1;
    });
    for (const name of Object.keys(box)) box[name].length = axes.length;
    view.extent = 0.5 * Math.hypot(...axes.map((_, i) => box.size[i] * (box.high[i] - box.low[i])));
  }

  function rounded(step) {
    const power = 10 ** Math.floor(Math.log10(step)), share = step / power;
    return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
  }

  // --------------------------------------------------------------------------------------------------- the view

  const HOME = { yaw: -0.65, pitch: 0.45, zoom: 1 };
  const view = { ...HOME, extent: 1, width: 1, height: 1, scale: 1, centre: [0, 0] };
  const flat = () => axes.length < 3;
  const downwards = count === 2 && shown.units.every((unit) => /^(px|pixels?)$/i.test(unit)); // as on a screen

  /** Turn the axes of the screen, and let the box fill it as it is seen at first. */
  function aim(width, height) {
    Object.assign(view, { width, height, scale: 1, centre: [0, 0] });
    look(HOME);
    const corners = Array.from({ length: 2 ** axes.length }, (_, corner) =>
      project(axes.map((_, i) => (corner & (1 << i) ? box.high[i] : box.low[i]))));
    const bounds = [0, 1].map((k) => [Math.min(...corners.map((c) => c[k])), Math.max(...corners.map((c) => c[k]))]);
    const [w, h] = bounds.map(([low, high]) => high - low);
    view.scale = view.zoom * Math.min((width - 150) / w, (height - 160) / h);
    view.centre = [width / 2 + (flat() ? 14 : 0), height / 2 + 12];
    look(view);
  }

  function look({ yaw, pitch }) {
    const [a, b] = flat() ? [0, Math.PI / 2] : [yaw, pitch];
    view.right = [Math.cos(a), Math.sin(a), 0];
    view.up = downwards ? [0, -1, 0] : [-Math.sin(a) * Math.sin(b), Math.cos(a) * Math.sin(b), Math.cos(b)];
    view.back = [Math.sin(a) * Math.cos(b), -Math.cos(a) * Math.cos(b), Math.sin(b)];
  }

  /** Where a point along the axes is on the screen. */
  function project(point) {
    let x = 0, y = 0;
    for (let i = 0; i < axes.length; i++) {
      const away = box.size[i] * (point[i] - box.middle[i]);
      x += view.right[i] * away;
      y += view.up[i] * away;
    }
    return [view.centre[0] + view.scale * x, view.centre[1] - view.scale * y];
  }

  const at = (demo, row) => axes.map((which) => column(demo, which)[row]);

  // ------------------------------------------------------------------------------------------------- the colours

  const range = (name) => {
    let low = Infinity, high = -Infinity;
    for (const demo of demos) for (const value of demo[name]) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low, high];
  };
  /** What all but one in fifty stay below. */
  function usual(name) {
    const every = demos.flatMap((demo) => Array.from(demo[name]).filter((_, i) => i % 5 === 0)).sort((a, b) => a - b);
    return every[Math.floor(0.98 * (every.length - 1))] || 1;
  }
  const hue = (demo) => HUES[theme()][demo.index % HUES.light.length];
  const top = usual("speed");
  const speedSays = shown.units[0] && new Set(shown.units).size === 1 ? `speed, ${shown.units[0]}/s` : "speed";
  const COLOURS = {
    demonstration: { label: "Colour: demonstration" },
    speed: { label: "Colour: speed", says: speedSays, range: () => [0, top], more: "or more" },
    free: { label: "Colour: probability of being free", says: "probability of being free", range: () => [0, 1],
      note: shown.quick ? "A quick look; with a policy among the files, as that learnt it." : "" },
    regions: { label: "Colour: demonstrations per region", says: "demonstrations that come by",
      range: () => [1, Math.max(2, range("regions")[1])],
      note: "1: free, or always held in the same way; that cannot be told." },
  };
  const settings = { colour: "demonstration", now: 0 };

  /** A class of colour for each sample, 0 to 5, or null where a demonstration has one colour. */
  function classes(demo) {
    if (settings.colour === "demonstration") return null;
    const [low, high] = COLOURS[settings.colour].range(), width = (high - low || 1) / 6;
    return Array.from(demo[settings.colour], (value) => Math.max(0, Math.min(5, Math.floor((value - low) / width))));
  }

  function sayLegend() {
    const chosen = COLOURS[settings.colour], legend = of("legend");
    legend.textContent = "";
    const parts = [];
    if (settings.colour !== "demonstration") {
      const bar = made("span", { className: "bar" }), [low, high] = chosen.range();
      const stops = RAMPS[theme()].map((each, i) => `${each} ${(100 * i) / 6}% ${(100 * (i + 1)) / 6}%`);
      bar.style.background = `linear-gradient(90deg, ${stops.join(", ")})`;
      const most = [number(high), chosen.more].filter(Boolean).join(" ");
      parts.push(`${chosen.says}:`, number(low), bar, most, chosen.note || "");
    } else {
      parts.push(`${several(demos.length, "demonstration")}, each in its colour; a dot is where it is at the time below.`);
    }
    if (!flat()) parts.push("Light grey on the floor: their shadows.");
    if (downwards) parts.push(`${named[1]} points downwards, as on a screen, since its unit is the pixel.`);
    if (shown.patches.length) parts.push("Faint pieces: what the learnt constraint leaves free.");
    legend.append(...parts.map((part) => {
      if (typeof part !== "string") return part;
      return made("span", { textContent: part });
    }));
  }

  // -------------------------------------------------------------------------------------------------- the scene

  const lines = []; // of the last picture: { demo, points }

  function drawScene() {
    const { context, width, height } = drawing.sharp(of("scene"));
    aim(width, height);
    drawBox(context);
    drawPatches(context);
    lines.length = 0;
    for (const demo of demos.filter((one) => !one.kept)) drawDemo(context, demo, drawing.colour("rule"));
    for (const demo of demos.filter((one) => one.kept)) drawDemo(context, demo, hue(demo));
    drawRollout(context);
    drawNow(context);
  }

  /** The floor with its grid, the edges, numbers along them and names. */
  function drawBox(context) {
    const corner = (...ends) => axes.map((_, i) => (ends[i] ? box.high[i] : box.low[i]));
    context.lineWidth = 1;
    context.strokeStyle = drawing.colour("rule");
    const below = view.up[2] >= 0 || flat() ? 0 : 1;
    for (const [along, across] of [[0, 1], [1, 0]])
      for (let value = box.low[along]; value <= box.high[along] + 1e-9 * box.step[along]; value += box.step[along]) {
        const ends = [0, 1].map((end) => {
          const point = corner(0, 0, below);
          point[along] = value;
          point[across] = end ? box.high[across] : box.low[across];
          return project(point);
        });
        drawing.line(context, ends);
      }
    context.fillStyle = drawing.colour("soft");
    context.font = "12px system-ui, sans-serif";
    // Numbers stand at the edges of the floor that are in front, and at the upright edge that is at the left.
    const nearX = downwards || !(flat() || view.back[1] < 0) ? 1 : 0, nearY = flat() || view.back[0] < 0 ? 0 : 1;
    sayAxis(context, 0, (v) => [v, nearX ? box.high[1] : box.low[1], box.low[2]], [0, 16]);
    sayAxis(context, 1, (v) => [nearY ? box.high[0] : box.low[0], v, box.low[2]], flat() ? [-8, 0] : [0, 16]);
    if (flat()) return;
    const uprights = [[0, 0], [0, 1], [1, 0], [1, 1]].map((ends) => corner(...ends, 0).slice(0, 2));
    uprights.sort((a, b) => project([...a, box.low[2]])[0] - project([...b, box.low[2]])[0]);
    drawing.line(context, [project([...uprights[0], box.low[2]]), project([...uprights[0], box.high[2]])]);
    sayAxis(context, 2, (v) => [...uprights[0], v], [-8, 0]);
  }

  function sayAxis(context, axis, pointOf, [dx, dy]) {
    context.textAlign = dx ? "right" : "center";
    context.textBaseline = "middle";
    const first = project(pointOf(box.low[axis])), last = project(pointOf(box.high[axis]));
    const steps = Math.round((box.high[axis] - box.low[axis]) / box.step[axis]);
    const room = Math.hypot(last[0] - first[0], last[1] - first[1]) / steps;
    const every = Math.max(1, Math.ceil((dx ? 18 : 40) / Math.max(room, 1)));
    const centre = [view.width / 2, view.height / 2];
    for (let k = 0; k < steps; k += every) {
      const [x, y] = project(pointOf(box.low[axis] + k * box.step[axis]));
      const push = dx ? [dx, dy] : [14 * Math.sign(x - centre[0] || 1) * (flat() ? 0 : 1), dy];
      const said = number(+(box.low[axis] + k * box.step[axis]).toPrecision(12));
      if (k || axis === 0) context.fillText(said, x + push[0], y + push[1]);
    }
    context.save();
    context.fillStyle = drawing.colour("ink");
    context.font = "600 13px system-ui, sans-serif";
    context.textAlign = "center";
    const middle = [(first[0] + last[0]) / 2, (first[1] + last[1]) / 2];
    const out = flat() ? 0 : Math.sign(middle[0] - centre[0] || 1);
    const place = dx ? [last[0] - (flat() ? 6 : 0), Math.min(first[1], last[1]) - 16] : [middle[0] + 44 * out, middle[1] + 32];
    const half = context.measureText(labelOf(axes[axis])).width / 2 + 8;
    context.fillText(labelOf(axes[axis]), Math.max(half, Math.min(view.width - half, place[0])), place[1]);
    context.restore();
  }

  function drawDemo(context, demo, single) {
    const points = new Array(demo.times.length);
    for (let row = 0; row < points.length; row++) points[row] = project(at(demo, row));
    lines.push({ demo, points });
    if (!flat() && demo.kept) drawShadow(context, demo);
    context.lineWidth = demo.kept ? 1.8 : 1.2;
    const own = demo.kept ? classes(demo) : null, jumps = jumpsOf(demo);
    for (let which = 0; which < (own ? 6 : 1); which++) {
      context.strokeStyle = own ? RAMPS[theme()][which] : single;
      context.beginPath();
      for (let row = 1; row < points.length; row++) {
        if (jumps[row] || (own && own[row] !== which)) continue;
        if (row === 1 || jumps[row - 1] || (own && own[row - 1] !== which)) context.moveTo(...points[row - 1]);
        context.lineTo(...points[row]);
      }
      context.stroke();
    }
  }

  /** What is below a demonstration, on the floor. */
  function drawShadow(context, demo) {
    context.strokeStyle = drawing.colour("ink");
    context.globalAlpha = 0.1;
    context.lineWidth = 1.2;
    context.beginPath();
    const every = Math.max(1, Math.floor(demo.times.length / 300)), floor = view.up[2] >= 0 ? box.low[2] : box.high[2];
    for (let row = 0; row < demo.times.length; row += every) {
      const point = at(demo, row);
      point[2] = floor;
      context.lineTo(...project(point));
    }
    context.stroke();
    context.globalAlpha = 1;
  }

  /** Rows before which samples are missing. */
  function jumpsOf(demo) {
    if (!demo.jumps) {
      demo.jumps = new Uint8Array(demo.times.length);
      for (const mark of demo.marks)
        if (mark.length > 0) {
          const row = demo.times.findIndex((time) => time > mark.start + 0.5 * mark.length);
          if (row > 0) demo.jumps[row] = 1;
        }
    }
    return demo.jumps;
  }

  /** A point so far from a state along some ways, each with a sign, along the axes shown. */
  function along(state, reach, ways, signs) {
    return axes.map((which) => state[which] + reach * signs.reduce((sum, sign, k) => sum + sign * ways[k][which], 0));
  }

  function drawPatches(context) {
    if (axes.some((which) => which >= count)) return;
    const reach = 0.06 * view.extent;
    context.fillStyle = context.strokeStyle = drawing.colour("direct");
    for (const { at: middle, free } of shown.patches) {
      const corner = (signs) => project(along(middle, reach, free, signs));
      context.globalAlpha = 0.1;
      context.lineWidth = 1;
      context.beginPath();
      const ends = free.length >= 2 ? [[1, 1], [1, -1], [-1, -1], [-1, 1]] : free.length === 1 ? [[1], [-1]] : [];
      ends.map(corner).forEach((point, i) => (i ? context.lineTo(...point) : context.moveTo(...point)));
      if (free.length >= 2) {
        context.closePath();
        context.fill();
      }
      context.globalAlpha = 0.25;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  /** Where each demonstration is now. */
  function drawNow(context) {
    for (const { demo, points } of lines) {
      if (!demo.kept || settings.now > lengthOf(demo)) continue;
      let row = demo.times.findIndex((time) => time >= settings.now);
      if (row < 0) row = 0;
      context.fillStyle = settings.colour === "demonstration" ? hue(demo) : drawing.colour("ink");
      context.beginPath();
      context.arc(...points[row], 4, 0, 7);
      context.fill();
    }
  }

  // ------------------------------------------------------------------------------------------------- the policy

  const roll = { start: null, begun: 0, tilt: 0, turn: 0, plane: false, track: [], support: [], times: [], untold: [] };
  const canRoll = () => learnt && roll.start;

  /** Normal of the plane: the last axis, tilted, then turned about it. */
  function normal() {
    const tilt = (roll.tilt * Math.PI) / 180, turn = (roll.turn * Math.PI) / 180;
    if (count === 2) return [-Math.sin(tilt), Math.cos(tilt)];
    return [Math.sin(tilt) * Math.cos(turn), Math.sin(tilt) * Math.sin(turn), Math.cos(tilt)];
  }

  function follow() {
    roll.track = [];
    roll.support = [];
    roll.times = [];
    if (!canRoll()) return;
    const whole = shown.timed ? longest : 1, largest = 0.01 * view.extent;
    let state = roll.start.slice(), time = 0, beyond = 0;
    for (let i = 0; i < STEPS && time <= whole && beyond < BEYOND * view.extent && state.every(Number.isFinite); i++) {
      const near = learnt.support(state), first = allowed(state), speed = Math.hypot(...first);
      roll.track.push(state);
      roll.times.push(time);
      roll.support.push(near === null ? 1 : near);
      const step = Math.min(whole / 400, largest / Math.max(speed, 1e-12));
      const middle = allowed(state.map((each, k) => each + 0.5 * step * first[k]));
      state = state.map((each, k) => each + step * middle[k]);
      time += step;
      if (near !== null && near < NEAR_DATA) beyond += step * speed;
    }
    roll.untold = untoldAlong();
  }

  /** What no recording tells of each action, as a share of a typical one; null where that is not known. */
  function untoldAlong() {
    if (!untold) return null;
    const way = roll.plane ? normal() : null, weights = roll.times.map(lasting);
    const squares = roll.track.map((state) => learnt.policy(state).reduce((sum, each) => sum + each * each, 0));
    const mean = squares.reduce((sum, one, i) => sum + weights[i] * one, 0) / weights.reduce((sum, one) => sum + one, 0);
    return roll.track.map((state) => (mean > 0 ? untold.at(state, way, Math.sqrt(mean)) : 0));
  }

  /** How long a roll-out stays at a state, the last as long as the one before. */
  const lasting = (time, i, times) => {
    const last = Math.min(i + 1, times.length - 1);
    return last ? times[last] - times[last - 1] : 1;
  };

  /** What the plane, if there is one, leaves of the policy. */
  function allowed(state) {
    const way = roll.plane ? normal() : null;
    if (!way) return learnt.policy(state);
    return learnt.under(state, way.map((row, i) => way.map((each, k) => (i === k ? 1 : 0) - row * each)));
  }

  function drawRollout(context) {
    if (!canRoll()) return;
    follow();
    if (roll.plane && !axes.some((which) => which >= count)) drawPlane(context);
    const points = roll.track.map((state, i) =>
      project(axes.map((which) => (which < count ? state[which] : roll.times[i]))));
    const kinds = roll.track.map((_, i) => (isAway(i) ? 0 : isOpen(i) ? 1 : 2));
    for (const [kind, colour] of ["soft", "ink", "ink"].entries()) {
      context.strokeStyle = drawing.colour(colour);
      context.lineWidth = [2.8, 1.2, 2.8][kind];
      context.setLineDash(kind ? [] : [5, 6]);
      context.beginPath();
      for (let i = 1; i < points.length; i++) {
        if (kinds[i] !== kind) continue;
        if (i === 1 || kinds[i - 1] !== kind) context.moveTo(...points[i - 1]);
        context.lineTo(...points[i]);
      }
      context.stroke();
    }
    context.setLineDash([]);
    context.fillStyle = drawing.colour("card");
    context.strokeStyle = drawing.colour("ink");
    context.lineWidth = 3;
    context.beginPath();
    context.arc(...points[0], 8, 0, 7);
    context.fill();
    context.stroke();
    sayPolicy();
  }

  function drawPlane(context) {
    const way = normal(), reach = 0.45 * view.extent;
    const side = count === 2 ? [[way[1], -way[0]]] : perpendicular(way);
    const corners = count === 2 ? [[1], [-1]] : [[1, 1], [1, -1], [-1, -1], [-1, 1]];
    context.fillStyle = context.strokeStyle = drawing.colour("hybrid");
    context.lineWidth = 1.5;
    context.beginPath();
    corners.forEach((signs, i) => {
      const point = project(along(roll.start, reach, side, signs));
      if (i) context.lineTo(...point);
      else context.moveTo(...point);
    });
    context.closePath();
    context.globalAlpha = 0.13;
    context.fill();
    context.globalAlpha = 0.8;
    context.stroke();
    context.globalAlpha = 1;
  }

  function perpendicular([x, y, z]) {
    const first = Math.abs(z) < 0.9 ? [-y, x, 0] : [0, -z, y], length = Math.hypot(...first);
    const a = first.map((each) => each / length);
    return [a, [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]]];
  }

  const isAway = (i) => roll.support[i] < NEARBY;
  const isOpen = (i) => roll.untold !== null && roll.untold[i] > untold.small && !isAway(i);

  function sayPolicy() {
    of("policy-says").textContent = `The thick line: where it goes from the ring, which can be dragged. ${howKnown()}`;
  }

  /** The same as the verdict of `unconstrain rollout`. */
  function howKnown() {
    const lasts = roll.times.map(lasting), sum = (values) => values.reduce((total, one) => total + one, 0);
    const percent = (share) => `${share > 0 && share < 0.005 ? "<1" : share < 1 && share >= 0.995 ? ">99" : Math.round(100 * share)} %`;
    const part = (is) => {
      const first = roll.track.findIndex((_, i) => is(i)), share = sum(lasts.filter((_, i) => is(i))) / sum(lasts);
      return first < 0 ? "" : `${percent(share)} of the time, first at ${number(roll.times[first])} s`;
    };
    const away = part(isAway), open = part(isOpen);
    const said = away && `No demonstration passes near for ${away}, where it is grey and dashed: extrapolated.`;
    if (!untold) return said || `All of it is near the data; ${shown.policy.untold}.`;
    if (!open) return said || "All of it is near the data, and recordings tell the policy.";
    const every = roll.untold.filter((_, i) => isOpen(i)).sort((one, other) => one - other);
    const off = every[Math.floor(every.length / 2)];
    return `${said ? `${said} Near some, ` : "Near demonstrations, but "}${open}, where it is thin, fewer than 3 tell the ` +
      `policy in every direction: there it may be off by ${off < 1 ? `about ${percent(off)} of` : "as much as"} its typical action.`;
  }

  function begin(index) {
    const demo = demos[index % demos.length];
    roll.begun = index % demos.length;
    roll.start = demo.states.map((values) => values[0]);
  }

  // -------------------------------------------------------------------------------------------------- in time

  const ROW = 15;

  function drawTimes() {
    const canvas = of("times"), rows = demos.length, gap = Math.max(2, Math.min(ROW, Math.floor(420 / rows)));
    canvas.style.height = `${rows * gap + 34}px`;
    const { context, width, height } = drawing.sharp(canvas), left = 6, right = width - 10;
    const x = (time) => left + ((right - left) * time) / longest;
    demos.forEach((demo, i) => drawBar(context, demo, x, 4 + i * gap, gap));
    const step = rounded(longest / Math.max(3, Math.min(9, width / 90)));
    context.fillStyle = context.strokeStyle = drawing.colour("soft");
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "top";
    context.lineWidth = 1;
    for (let time = 0; time <= longest * 1.0001; time += step) {
      drawing.line(context, [[x(time), height - 26], [x(time), height - 21]]);
      context.textAlign = time ? (x(time) > right - 30 ? "right" : "center") : "left";
      context.fillText(`${number(+time.toPrecision(10))}${time ? "" : ` ${clock}`}`, x(time) + (time ? 0 : -2), height - 18);
    }
    context.strokeStyle = drawing.colour("ink");
    context.lineWidth = 1.5;
    drawing.line(context, [[x(settings.now), 0], [x(settings.now), height - 24]]);
  }

  function drawBar(context, demo, x, top, gap) {
    const thick = Math.max(0.7 * gap, gap - 5), whole = lengthOf(demo);
    context.fillStyle = demo.kept ? hue(demo) : drawing.colour("rule");
    context.fillRect(x(0), top, Math.max(2, x(whole) - x(0)), thick);
    for (const mark of demo.marks) {
      if (mark.start === null) continue;
      if (mark.length > 0) {
        context.fillStyle = drawing.colour("card");
        context.fillRect(x(mark.start), top, x(mark.start + mark.length) - x(mark.start), thick);
        context.strokeStyle = drawing.colour("soft");
        context.lineWidth = 1;
        context.setLineDash(mark.code === "gap" ? [2, 3] : []);
        drawing.line(context, [[x(mark.start), top + thick / 2], [x(mark.start + mark.length), top + thick / 2]]);
        context.setLineDash([]);
      } else {
        const at = x(mark.start), size = Math.min(6, thick);
        context.fillStyle = drawing.colour("warn");
        context.strokeStyle = drawing.colour("card");
        context.lineWidth = 2;
        context.beginPath();
        context.moveTo(at, top - 2);
        context.lineTo(at + size, top + thick + 1);
        context.lineTo(at - size, top + thick + 1);
        context.closePath();
        context.stroke();
        context.fill();
      }
    }
  }

  // ---------------------------------------------------------------------------------------------------- words

  function sayAll() {
    const warnings = demos.flatMap((demo) => demo.marks.map((mark) => ({ demo, mark })));
    const odd = warnings.filter(({ mark }) => mark.code !== "gap" && mark.code !== "pause");
    of("verdict").textContent = shown.verdict + (odd.length ? " What is marked is listed below." : "");
    of("rest").append(...shown.rest.flatMap((pair) =>
      pair.map((textContent, i) => made(i ? "dd" : "dt", { textContent }))));
    of("verdict").className = /^[!✖]/.test(shown.verdict) ? "verdict warn" : "verdict";
    const whole = number(demos.reduce((sum, demo) => sum + lengthOf(demo), 0));
    of("summary").textContent = `${several(demos.length, "demonstration")}, ${several(shown.samples, "sample")}, ` +
      `${shown.timed ? `${whole} s in all` : "without times"}; ` +
      `states ${named.join("; ")}.`;
    of("scene").setAttribute("aria-label", `Scene of ${demos.length} demonstrations along ${axes.map(labelOf).join(", ")}.`);
    const lengths = demos.map((demo) => `${demo.name}, ${number(lengthOf(demo))} ${clock}`);
    of("times").setAttribute("aria-label", `Time line: ${lengths.join("; ")}.`);
    of("notes-card").hidden = !warnings.length;
    const signs = { "▲ warning": warnings.some(({ mark }) => mark.start !== null && !mark.length),
      "dashes: gap": warnings.some(({ mark }) => mark.code === "gap"),
      "thin line: pause, left out": warnings.some(({ mark }) => mark.code === "pause" && mark.length > 0) };
    of("time-says").textContent = Object.keys(signs).filter((sign) => signs[sign]).join("; ");
    for (const { demo, mark } of warnings.filter((one) => one.mark.message)) {
      const item = made("li"), name = made("b", { textContent: `${mark.code}: ` });
      item.append(name, `${demo.name}${mark.start === null ? "" : ` at ${number(mark.start)} ${clock}`}: ${mark.message}`);
      of("notes").append(item);
    }
  }

  function makeList() {
    for (const demo of demos) {
      const item = made("li"), label = made("label");
      const tick = made("input", { type: "checkbox", checked: true, id: `demo-${demo.index}` });
      tick.addEventListener("change", () => leave(demo, !tick.checked));
      const name = made("span", { className: "name", textContent: demo.name, title: demo.name });
      const length = made("span", { className: "soft", textContent: `${number(lengthOf(demo))} ${clock}` });
      const swatch = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      swatch.setAttribute("width", 14);
      swatch.setAttribute("height", 8);
      swatch.setAttribute("aria-hidden", "true");
      swatch.innerHTML = '<rect width="14" height="4" y="2" rx="2"/>';
      label.append(tick, swatch, name, length);
      item.append(label);
      of("list").append(item);
      Object.assign(demo, { tick, label, swatch });
    }
  }

  function leave(demo, out) {
    demo.kept = !out;
    demo.tick.checked = !out;
    sayList();
    draw();
  }

  function sayList() {
    for (const demo of demos) {
      demo.label.className = demo.kept ? "" : "out";
      demo.swatch.style.fill = demo.kept ? hue(demo) : drawing.colour("rule");
    }
    const out = demos.filter((demo) => !demo.kept).map((demo) => demo.name).join(",");
    const quoted = /^[\w@%+=:,./-]+$/.test(out) ? out : `'${out.replace(/'/g, `'"'"'`)}'`;
    of("command").textContent = [shown.command[0], ...(out ? [`--leave-out ${quoted}`] : []), shown.command[1]].join(" ");
    of("copied").textContent = "";
  }

  async function copy() {
    const text = of("command").textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const picked = document.createRange();
      picked.selectNodeContents(of("command"));
      const selection = window.getSelection();
      selection.removeAllRanges();
      selection.addRange(picked);
      document.execCommand("copy");
    }
    of("copied").textContent = "Copied.";
  }

  // ----------------------------------------------------------------------------------------------------- hands

  const scene = of("scene"), pointers = new Map(), held = { start: false, moved: 0, spread: 0 };

  const placed = (event) => {
    const around = scene.getBoundingClientRect();
    return [event.clientX - around.left, event.clientY - around.top];
  };

  /** The sample nearest to a place on the screen, if it is near. */
  function nearest([x, y], reach = 12) {
    let best = null, least = reach * reach;
    for (const { demo, points } of lines)
      points.forEach((point, row) => {
        const distance = (point[0] - x) ** 2 + (point[1] - y) ** 2;
        if (distance < least) [best, least] = [{ demo, row }, distance];
      });
    return best;
  }

  function tell(place) {
    const found = nearest(place), tip = of("tip");
    tip.hidden = !found;
    if (!found) return;
    const { demo, row } = found;
    const state = shown.columns.map((name, i) => `${name} ${number(demo.states[i][row])}`).slice(0, 6).join(", ");
    const free = demo.free ? `, free with ${Math.round(100 * demo.free[row])} %` : "";
    tip.textContent = `${demo.name}, ${number(demo.times[row])} ${clock}\n${state}\nspeed ${number(demo.speed[row])}${free}, ` +
      `${several(Math.round(demo.regions[row]), "demonstration")} here`;
    tip.style.left = `${Math.min(place[0] + 12, view.width - 180)}px`;
    tip.style.top = `${Math.max(0, place[1] - 60)}px`;
  }

  scene.addEventListener("pointerdown", (event) => {
    scene.setPointerCapture(event.pointerId);
    const place = placed(event);
    pointers.set(event.pointerId, place);
    held.moved = 0;
    if (canRoll() && pointers.size === 1) {
      const ring = project(axes.map((which) => (which < count ? roll.start[which] : 0)));
      held.start = Math.hypot(ring[0] - place[0], ring[1] - place[1]) < 18;
    }
  });
  scene.addEventListener("pointermove", (event) => {
    const place = placed(event), before = pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType === "mouse") tell(place);
      return;
    }
    const [dx, dy] = [place[0] - before[0], place[1] - before[1]];
    held.moved += Math.hypot(dx, dy);
    pointers.set(event.pointerId, place);
    of("tip").hidden = true;
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()], spread = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (held.spread) zoom(spread / held.spread);
      held.spread = spread;
    } else if (held.start) dragStart(dx, dy);
    else turn(-0.008 * dx, 0.008 * dy);
    draw();
  });
  for (const name of ["pointerup", "pointercancel"])
    scene.addEventListener(name, (event) => {
      const place = pointers.get(event.pointerId);
      pointers.delete(event.pointerId);
      held.spread = 0;
      if (name === "pointerup" && place && held.moved < 5 && !held.start) {
        const found = nearest(place);
        if (found) leave(found.demo, found.demo.kept);
      }
      held.start = false;
    });
  scene.addEventListener("pointerleave", () => {
    of("tip").hidden = true;
  });
  scene.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== scene) return;
    event.preventDefault();
    zoom(Math.exp(-0.002 * event.deltaY));
    draw();
  }, { passive: false });
  scene.addEventListener("dblclick", () => of("all").click());

  const KEYS = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
  scene.addEventListener("keydown", (event) => {
    if (KEYS[event.key]) turn(...KEYS[event.key]);
    else if (event.key === "+" || event.key === "=") zoom(1.15);
    else if (event.key === "-") zoom(1 / 1.15);
    else if (event.key === "Home") Object.assign(view, HOME);
    else return;
    event.preventDefault();
    draw();
  });

  function turn(yaw, pitch) {
    view.yaw += yaw;
    view.pitch = Math.max(-0.2, Math.min(1.55, view.pitch + pitch));
  }

  function zoom(factor) {
    view.zoom = Math.max(0.4, Math.min(12, view.zoom * factor));
  }

  /** Move the start in the plane of the screen. */
  function dragStart(dx, dy) {
    axes.forEach((which, i) => {
      if (which < count) roll.start[which] += (view.right[i] * dx - view.up[i] * dy) / (view.scale * box.size[i]);
    });
  }

  // -------------------------------------------------------------------------------------------------- controls

  function press(id, action) {
    of(id).addEventListener("click", () => {
      action();
      draw();
    });
  }
  press("nearer", () => zoom(1.25));
  press("farther", () => zoom(0.8));
  press("all", () => Object.assign(view, HOME));
  press("start", () => begin(roll.begun + 1));
  of("copy").addEventListener("click", copy);

  for (const [name, { label }] of Object.entries(COLOURS)) {
    if (name === "free" && !demos.some((demo) => demo.free)) continue;
    of("colour").append(new Option(label, name));
  }
  of("colour").addEventListener("change", (event) => {
    settings.colour = event.target.value;
    sayLegend();
    draw();
  });
  if (count > 3)
    axes.forEach((which, i) => {
      const select = made("select");
      select.setAttribute("aria-label", `Axis ${i + 1}`);
      for (let k = 0; k <= count; k++) select.append(new Option(k < count ? shown.columns[k] : "time", k));
      select.value = which;
      select.addEventListener("change", () => {
        axes[i] = Number(select.value);
        measure();
        draw();
      });
      of("axes").append(select);
    });

  function sayRoll() {
    of("tilt-says").value = `${roll.tilt}°`;
    of("turn-says").value = `${roll.turn}°`;
    of("tilt").disabled = of("turn").disabled = !roll.plane;
  }
  for (const name of ["tilt", "turn"])
    of(name).addEventListener("input", (event) => {
      roll[name] = Number(event.target.value);
      sayRoll();
      draw();
    });
  of("plane").addEventListener("change", (event) => {
    roll.plane = event.target.checked;
    sayRoll();
    draw();
  });

  const playing = { since: null };
  of("now").addEventListener("input", (event) => {
    settings.now = (longest * Number(event.target.value)) / 1000;
    draw();
  });
  of("play").addEventListener("click", () => {
    const from = settings.now >= longest ? 0 : settings.now * pace();
    playing.since = playing.since === null ? performance.now() - 1000 * from : null;
    of("play").textContent = playing.since === null ? "Play" : "Pause";
    if (playing.since !== null) requestAnimationFrame(tick);
  });
  of("times").addEventListener("pointerdown", (event) => {
    const around = of("times").getBoundingClientRect();
    settings.now = longest * Math.max(0, Math.min(1, (event.clientX - around.left - 6) / (around.width - 16)));
    draw();
  });

  /** Seconds on the wall for a unit of time: all in at most twelve seconds. */
  const pace = () => (shown.timed && longest <= 12 ? 1 : 12 / longest);

  function tick(now) {
    if (playing.since === null) return;
    settings.now = Math.min(longest, (now - playing.since) / 1000 / pace());
    if (settings.now >= longest) {
      playing.since = null;
      of("play").textContent = "Play";
    } else requestAnimationFrame(tick);
    draw();
  }

  function drawAll() {
    drawScene();
    drawTimes();
    of("now").value = (1000 * settings.now) / longest;
    of("now-says").value = `${number(settings.now)} ${clock}`;
  }
  const draw = drawing.perFrame(drawAll);

  makeList();
  of("to-fit").hidden = !shown.command[0];
  sayAll();
  sayList();
  sayLegend();
  measure();
  if (shown.policy) {
    of("policy-card").hidden = false;
    of("policy-controls").hidden = Boolean(shown.policy.trouble);
    of("policy-says").textContent = shown.policy.trouble;
    const inPlane = count === 2 || count === 3;
    for (const id of ["plane", "tilt", "turn"]) of(id).closest("label")?.toggleAttribute("hidden", !inPlane);
    for (const id of ["tilt", "turn"]) {
      of(id).hidden = !inPlane || (id === "turn" && count === 2);
      document.querySelector(`label[for=${id}]`).hidden = of(id).hidden;
    }
    if (count === 2) of("plane-says").textContent = "On a line through the start";
    if (learnt) begin(0);
    for (const way of shown.planes) { // on which all were recorded
      const [x, y, z] = way.map((each) => each * (way[2] < 0 ? -1 : 1)), degree = Math.PI / 180;
      of("tilt").value = roll.tilt = Math.round(Math.acos(Math.min(z, 1)) / degree);
      of("turn").value = roll.turn = Math.round(Math.atan2(y, x) / degree + 360) % 360;
      roll.plane = of("plane").checked = true;
    }
    sayRoll();
  }
  drawing.onChange(() => {
    sayList();
    sayLegend();
    draw();
  });
  drawAll();
  performance.mark("drawn");
  window.look = { demos, view, roll, settings, axes, project }; // to look at
})();
