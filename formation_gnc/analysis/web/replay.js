// Replay of a run: the Earth with the orbit, the formation in the Hill frame, and the time that moves both.
// Views are orthographic and drawn as SVG, so that what is seen is what is saved and printed.
"use strict";
const LIGHT = { ink: "#1b1f24", soft: "#667788", grid: "#d5dae1", paper: "#ffffff", bright: "#eaf4ff", ocean: "#6ea6de",
  rim: "#2f6fae", night: "#0b1b33", land: "#ffffff" };
const DARK = { ink: "#e4e7eb", soft: "#9aa4b0", grid: "#2c343e", paper: "#0f1318", bright: "#6fa8dc", ocean: "#2b5f97",
  rim: "#4a8fd0", night: "#02060d", land: "#cfe3f7" };
const MARGIN = 0.85, TRAIL = 0.5, CIRCLE = 72, ZOOM = 1.4;
const darkScreen = matchMedia("(prefers-color-scheme: dark)");

const escapeText = (text) => text.replace(/[&<>"']/g, (each) => `&#${each.charCodeAt(0)};`);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((each) => each * factor);
const plus = (a, b) => a.map((each, k) => each + b[k]);
const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));
const isPoint = (a) => a.every((each) => Math.abs(each) < 1e15);
const nice = (value) => {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 5, 10].find((each) => each * power >= value * 0.999);
};
const quantity = (value, units) => {
  const [factor, name] = units.find(([size]) => Math.abs(value) >= size) || units[units.length - 1];
  return `${Number((value / factor).toPrecision(3))} ${name}`;
};
const LENGTHS = [[1e3, "km"], [1, "m"], [1e-2, "cm"], [1e-3, "mm"]];
const ACCELERATIONS = [[1, "m/s²"], [1e-3, "mm/s²"], [1e-6, "µm/s²"], [1e-9, "nm/s²"]];

const numbers = (text, Kind) => new Kind(Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer);

/** Recorded columns of a run, and their values between the frames. */
class Replay {
  constructor(scene) {
    Object.assign(this, scene);
    this.times = numbers(scene.times, Float64Array);
    this.chief = numbers(scene.chief, Float32Array);
    for (const deputy of this.deputies)
      for (const name of ["state", "target", "error", "covariance", "thrust"])
        deputy[name] = numbers(deputy[name], Float32Array);
    const last = this.times.length - 1;
    this.begin = this.times[0];
    this.end = this.times[last];
    this.usual = last > 0 ? (this.end - this.begin) / last : 1;
  }
  /** Frame at or before a time, and the share of the way to the next. */
  frame(time) {
    let low = 0, high = this.times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle; else high = middle;
    }
    const step = this.times[high] - this.times[low];
    return { low, high, step, share: step > 0 ? Math.min(1, Math.max(0, (time - this.times[low]) / step)) : 0 };
  }
  /** Row of a column, linear between frames. */
  linear(column, width, { low, high, share }) {
    return Array.from({ length: width }, (_, k) => {
      const [one, other] = [column[low * width + k], column[high * width + k]];
      return share === 0 ? one : share === 1 ? other : one + share * (other - one);
    });
  }
  /** Position from rows of position and velocity: cubic between frames, linear over a gap. */
  position(column, { low, high, share: s, step }) {
    const at = (row, k) => column[6 * row + k];
    return [0, 1, 2].map((k) => {
      const straight = at(low, k) + s * (at(high, k) - at(low, k));
      if (step > 3 * this.usual) return straight;
      const [a, b] = [step * at(low, k + 3), step * at(high, k + 3)], rise = at(high, k) - at(low, k);
      const cubic = at(low, k) + s * (a + s * (3 * rise - 2 * a - b + s * (a + b - 2 * rise)));
      return Number.isFinite(cubic) ? cubic : straight;
    });
  }
  /** Positions from a time to another, at the frames between and `fine` times as often. */
  path(column, from, to, fine = 1) {
    const first = this.frame(Math.max(from, this.begin)), last = this.frame(Math.min(to, this.end));
    const points = [];
    for (let row = first.low; row <= last.low; row += 1)
      for (let part = 0; part < fine; part += 1) {
        const next = Math.min(row + 1, this.times.length - 1), step = this.times[next] - this.times[row];
        const time = this.times[row] + (step * part) / fine;
        if (time >= from && time <= to)
          points.push(this.position(column, { low: row, high: next, step, share: part / fine }));
      }
    points.push(this.position(column, last));
    return points;
  }
}

/** An orthographic camera on an SVG element, with what turns and enlarges it; `reach` is to be seen across and up. */
class View {
  constructor(root, paint, camera) {
    this.root = root;
    this.svg = root.querySelector("svg");
    this.caption = root.querySelector("figcaption");
    this.paint = paint;
    this.home = camera;
    Object.assign(this, camera);
    this.zoom = 1;
    let held = null;
    this.svg.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY, this.azimuth, this.elevation];
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener("pointermove", (event) => {
      if (!held) return;
      this.azimuth = held[2] - 0.008 * (event.clientX - held[0]);
      this.elevation = Math.min(1.57, Math.max(-1.57, held[3] + 0.008 * (event.clientY - held[1])));
      this.draw();
    });
    for (const name of ["pointerup", "pointercancel"]) this.svg.addEventListener(name, () => (held = null));
    this.svg.addEventListener("dblclick", () => { Object.assign(this, this.home, { zoom: 1 }); this.draw(); });
    this.svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.enlarge(Math.exp(-0.01 * event.deltaY));
    }, { passive: false });
    root.querySelector(".in").addEventListener("click", () => this.enlarge(ZOOM));
    root.querySelector(".out").addEventListener("click", () => this.enlarge(1 / ZOOM));
    root.querySelector(".save").addEventListener("click", () => page.save(this.text(LIGHT), root.getAttribute("aria-label")));
    new ResizeObserver(() => this.draw()).observe(this.svg);
    darkScreen.addEventListener("change", () => this.draw());
    addEventListener("beforeprint", () => this.draw(LIGHT));
    addEventListener("afterprint", () => this.draw());
  }
  enlarge(factor) {
    this.zoom *= factor;
    this.draw();
  }
  /** Set the camera's axes: right, up, and towards the viewer. */
  aim() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const [a, b, c] = this.axes; // at azimuth 0: right, up, towards the viewer
    this.right = plus(scaled(a, ca), scaled(c, -sa));
    const level = plus(scaled(c, ca), scaled(a, sa));
    this.up = plus(scaled(b, ce), scaled(level, -se));
    this.near = plus(scaled(b, se), scaled(level, ce));
    this.width = this.svg.clientWidth || 600;
    this.height = this.svg.clientHeight || 400;
    this.scale = (MARGIN * this.zoom * Math.min(this.width / this.reach[0], this.height / this.reach[1])) / 2;
  }
  /** Right, down (px) and towards the viewer of a point. */
  place(point) {
    const d = point.map((each, k) => each - this.centre[k]);
    return [this.width / 2 + this.scale * dot(d, this.right), this.height / 2 - this.scale * dot(d, this.up), dot(d, this.near)];
  }
  draw(palette = darkScreen.matches ? DARK : LIGHT) {
    this.aim();
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    const [drawing, words] = this.paint(this, palette);
    this.svg.innerHTML = drawing;
    this.caption.textContent = words;
  }
  text(palette) {
    this.aim();
    const size = `viewBox="0 0 ${this.width} ${this.height}" width="${this.width}" height="${this.height}"`;
    const paper = `<rect width="100%" height="100%" fill="${palette.paper}"/>`;
    return `<svg xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" ${size}>${paper}${this.paint(this, palette)[0]}</svg>`;
  }
}

/** A line through points on the screen, with gaps where there is no point or `shown` says so. */
function line(points, attributes, shown = () => true) {
  let path = "", pen = "M";
  points.forEach((each, row) => {
    if (!isPoint(each) || !shown(row)) { pen = "M"; return; }
    path += `${pen}${each[0].toFixed(1)} ${each[1].toFixed(1)}`;
    pen = "L";
  });
  return path ? `<path d="${path}" fill="none" ${attributes}/>` : "";
}
const words = (x, y, text, colour, size = 12) =>
  `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" fill="${colour}" font-size="${size}">${escapeText(text)}</text>`;
const shade = (colour, palette) => {
  if (palette === LIGHT) return colour;
  const parts = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  return `rgb(${parts.map((each) => Math.round(0.65 * each + 0.35 * 255)).join(",")})`;
};
