// The ring: displacement of every tendon, outwards from the dashed circle. What two numbers can do
// is the blue curve, r(psi) = r0 + Re cos psi + Im sin psi; the orange part is off the manifold.

import { decode } from "./clarke.js";
import { add, handle, set } from "./svg.js";

const ZERO = 62, SPAN = 46;
const LEAST = -1.25, MOST = 1.05; // where a hand stops, paying out and pulling in, in units of the limit

export class Ring {
  constructor(svg, app) {
    Object.assign(this, { svg, app });
  }

  build() {
    const { svg, app } = this, { robot, selected } = app;
    const segment = robot.segments[selected];
    this.angles = segment.ring.angles;
    svg.replaceChildren();
    add(svg, "circle", { class: "zero", r: ZERO });
    for (const psi of this.angles) {
      add(svg, "line", {
        class: "spoke", x1: 12 * Math.cos(psi), y1: -12 * Math.sin(psi),
        x2: (ZERO + SPAN) * Math.cos(psi), y2: -(ZERO + SPAN) * Math.sin(psi),
      });
    }
    this.curve = add(svg, "path", { class: "curve" });
    this.gaps = add(svg, "path", { class: "gap" });
    const size = this.angles.length > 16 ? 3.4 : 5;
    this.handles = this.angles.map((psi, i) => {
      const made = handle(svg, size, `Tendon ${i + 1}`, [100 * LEAST, 100 * MOST], {
        drag: ([x, y]) => this.pull(i, (x * Math.cos(psi) + y * Math.sin(psi) - ZERO) / SPAN),
        key: ([dx, dy]) => this.pull(i, this.shown(i) + (dx + dy) / 40),
      });
      if (this.angles.length <= 12) {
        add(svg, "text", {
          x: (ZERO + SPAN + 7) * Math.cos(psi), y: -(ZERO + SPAN + 7) * Math.sin(psi) + 3,
          "text-anchor": "middle",
        }, i + 1);
      }
      return made;
    });
  }

  /** Where tendon i is drawn, in units of the limit. */
  shown(i) {
    const { robot, selected } = this.app;
    return (this.onto[i] + this.app.magnified * this.off[i]) / robot.maxClarke[selected];
  }

  pull(i, share) {
    const { app } = this;
    const change = (Math.min(MOST, Math.max(LEAST, share)) - this.shown(i)) / app.magnified;
    app.pullByHand(i, change * app.robot.maxClarke[app.selected]);
  }

  update() {
    const { app } = this, { robot, selected: j } = app;
    const most = robot.maxClarke[j], clarke = app.displacement.slice(2 * j, 2 * j + 2);
    this.onto = decode(robot.segments[j].ring, clarke);
    this.off = app.offOf(j);
    const points = [];
    for (let k = 0; k <= 72; k++) {
      const psi = (k * Math.PI) / 36;
      const r = ZERO + (SPAN * (clarke[0] * Math.cos(psi) + clarke[1] * Math.sin(psi))) / most;
      points.push(`${(r * Math.cos(psi)).toFixed(2)} ${(-r * Math.sin(psi)).toFixed(2)}`);
    }
    this.curve.setAttribute("d", `M${points.join("L")}Z`);
    const colours = app.tendonColours(j), gaps = [];
    this.angles.forEach((psi, i) => {
      const on = ZERO + (SPAN * this.onto[i]) / most, at = ZERO + SPAN * this.shown(i);
      const [c, s] = [Math.cos(psi), -Math.sin(psi)];
      if (Math.abs(at - on) > 0.05) gaps.push(`M${on * c} ${on * s}L${at * c} ${at * s}`);
      const made = this.handles[i], rho = (this.onto[i] + this.off[i]) * 1e3;
      made.dot.setAttribute("fill", colours[i]);
      made.place(at * c, at * s, 100 * this.shown(i), `${rho.toFixed(1)} millimetres`);
    });
    set(this.gaps, { d: gaps.join("") });
  }
}
