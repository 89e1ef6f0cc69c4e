/** What both pages draw with: a canvas as sharp as the screen, in the colours of the page. */
const drawing = (() => {
  "use strict";

  /** Make a canvas as fine as the screen; returns its context and size, in CSS pixels. */
  function sharp(canvas) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2.5);
    const width = canvas.clientWidth || 300, height = canvas.clientHeight || width;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.lineCap = context.lineJoin = "round";
    return { context, width, height };
  }

  /** A colour of the page, by the name of its variable. */
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  /** An arrow from one point along a vector, in pixels. */
  function arrow(context, x, y, dx, dy, head = 4) {
    const length = Math.hypot(dx, dy);
    if (!(length > 0.5)) return;
    const ux = dx / length, uy = dy / length, size = Math.min(head, 0.7 * length);
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    context.moveTo(x + dx - size * (ux + 0.6 * uy), y + dy - size * (uy - 0.6 * ux));
    context.lineTo(x + dx, y + dy);
    context.lineTo(x + dx - size * (ux - 0.6 * uy), y + dy - size * (uy + 0.6 * ux));
    context.stroke();
  }

  /** A line through points, in pixels. */
  function line(context, points) {
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  }

  /** Call at most once a frame. */
  function perFrame(draw) {
    let asked = false;
    return () => {
      if (asked) return;
      asked = true;
      requestAnimationFrame(() => {
        asked = false;
        draw();
      });
    };
  }

  /** Call when size or colours of the page change. */
  function onChange(draw) {
    window.addEventListener("resize", draw);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  }

  return { sharp, colour, arrow, line, perFrame, onChange };
})();
