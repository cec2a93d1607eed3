// The disk: own Clarke coordinates of every segment, with a handle each.

import { shortened } from "./kinematics.js";
import { add, handle, set } from "./svg.js";

const R = 100;
export const SHADES = ["#0072B2", "#009E73", "#CC79A7"];

export class Disk {
  constructor(svg, app) {
    Object.assign(this, { svg, app, trace: [] });
  }

  build() {
    const { svg, app } = this, { robot } = app;
    svg.replaceChildren();
    for (const r of [1 / 3, 2 / 3]) add(svg, "circle", { class: "grid", r: r * R });
    add(svg, "path", { class: "grid", d: `M-${R} 0H${R}M0 -${R}V${R}` });
    add(svg, "circle", { class: "rim", r: R });
    add(svg, "text", { x: R + 3, y: 3 }, "Re");
    add(svg, "text", { x: -4, y: -R - 4 }, "Im");
    const degrees = Math.round((robot.maxBending[0] * 180) / Math.PI);
    add(svg, "text", { y: R + 13, "text-anchor": "middle" }, `rim: bent by ${degrees}°`);
    this.path = add(svg, "path", { class: "trace" });
    this.star = add(svg, "path", { class: "star", d: star(6) });
    this.handles = robot.lengths.map((_, k) => {
      const name = robot.lengths.length > 1 ? ` of segment ${k + 1}` : "";
      const made = handle(svg, 6, `Clarke coordinates${name}`, [0, 100], {
        drag: ([x, y]) => this.move(k, x / R, y / R),
        key: ([dx, dy]) => {
          const [x, y] = this.place(k);
          this.move(k, x + dx / 33, y + dy / 33);
        },
      });
      made.dot.setAttribute("fill", SHADES[k]);
      made.group.addEventListener("focus", () => app.select(k));
      if (name) add(made.group, "text", { y: 2.6, "text-anchor": "middle", style: "fill:#fff" }, k + 1);
      return made;
    });
    this.trace = [];
  }

  /** Where a segment is, as shares of its limit. */
  place(k) {
    const { bends, robot } = this.app;
    return [0, 1].map((i) => bends[2 * k + i] / robot.maxBending[k]);
  }

  move(k, x, y) {
    const { robot } = this.app, bends = [...this.app.wantedBends];
    [bends[2 * k], bends[2 * k + 1]] = shortened(x, y, 1).map((v) => v * robot.maxBending[k]);
    this.app.bendByHand(bends);
  }

  update() {
    const { app } = this, { robot } = app;
    this.handles.forEach((made, k) => {
      const [x, y] = this.place(k);
      const [u, v] = [x, y].map((s) => (s * robot.radii[k] * robot.maxBending[k] * 1e3).toFixed(1));
      made.place(R * x, -R * y, 100 * Math.hypot(x, y), `Re ${u}, Im ${v} millimetres`);
    });
    const single = robot.lengths.length === 1;
    this.star.style.display = single ? "" : "none";
    if (single) {
      const [x, y] = app.goalBends.map((b) => b / robot.maxBending[0]);
      set(this.star, { transform: `translate(${R * x} ${-R * y})`, class: app.reached ? "star reached" : "star" });
    }
    const [x, y] = this.place(app.selected);
    this.trace.push(`${(R * x).toFixed(1)} ${(-R * y).toFixed(1)}`);
    if (this.trace.length > 150) this.trace.shift();
    this.path.setAttribute("d", `M${this.trace.join("L")}`);
  }
}

function star(r) {
  const points = Array.from({ length: 10 }, (_, i) => {
    const s = i % 2 ? 0.42 * r : r, a = (i * Math.PI) / 5;
    return `${(s * Math.sin(a)).toFixed(2)} ${(-s * Math.cos(a)).toFixed(2)}`;
  });
  return `M${points.join("L")}Z`;
}
