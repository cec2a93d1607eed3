// Learning curves to touch: hover or arrow keys for values, buttons for arms. Reads #curves-data.
"use strict";
(() => {
  const root = document.getElementById("curves");
  const data = JSON.parse(document.getElementById("curves-data").textContent);
  const seed = root.querySelector("svg"), SVG = seed.namespaceURI;
  seed.remove();
  const shown = new Set(data.arms.map((_, i) => i));
  let quantity = 0;

  const element = (parent, name, attributes = {}, text) => {
    const made = parent.namespaceURI === SVG || name === "svg"
      ? document.createElementNS(SVG, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text; // never markup
    return parent.appendChild(made);
  };

  const marked = (node, arm) => { // colours of both schemes; the style sheet picks one
    node.classList.add("mark");
    node.style.setProperty("--light", data.arms[arm].light);
    node.style.setProperty("--dark", data.arms[arm].dark);
    return node;
  };

  const steps = (value) =>
    value >= 1e6 ? `${+(value / 1e6).toFixed(2)}M` : value >= 1e3 ? `${+(value / 1e3).toFixed(1)}k` : `${value}`;
  const number = (value) => value === null ? "–" : Number(value.toPrecision(3)).toString();

  // Round numbers between low and high, `count` of them or so.
  const ticks = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
      found.push(Number((k * step).toPrecision(12)));
    }
    return found;
  };

  class Plot {
    constructor(parent, panel) {
      this.panel = panel;
      this.box = element(parent, "div", { class: "panel" });
      element(this.box, "h3", {}, panel.title);
      this.svg = element(this.box, "svg", { class: "plot", tabindex: 0, role: "img" });
      this.values = element(this.box, "div", { class: "values", role: "status", hidden: "" });
      this.at = null;
      this.svg.addEventListener("pointermove", (event) => this.point(event));
      this.svg.addEventListener("pointerdown", (event) => this.point(event));
      this.svg.addEventListener("pointerleave", (event) => { // a finger that is lifted has chosen
        if (event.pointerType !== "touch") this.look(null);
      });
      this.svg.addEventListener("blur", () => this.look(null));
      this.svg.addEventListener("keydown", (event) => this.key(event));
      new ResizeObserver(() => this.draw()).observe(this.svg);
    }

    get curves() {
      return this.panel.curves[quantity].filter((curve) => shown.has(curve.arm));
    }

    draw() {
      const { width, height } = this.svg.getBoundingClientRect();
      const name = this.panel.quantities[quantity];
      const all = this.panel.curves[quantity].flatMap(
        (curve) => [...curve.centre, ...curve.low, ...curve.high].filter((value) => value !== null));
      this.svg.replaceChildren();
      this.svg.setAttribute("aria-label",
        `${name} over environment steps, ${this.panel.title}; arrow keys read values`);
      if (!width || !all.length) return;
      const left = 44, right = 12, top = 20, bottom = 30, last = data.steps[data.steps.length - 1];
      let low = quantity ? Math.min(...all) : 0, high = quantity ? Math.max(...all) : 1;
      const log = quantity > 0 && low > 0 && high > 4 * low;
      if (!log && high === low) high = low + 1;
      const scale = log ? Math.log : (value) => value, start = data.steps[0];
      const pad = (scale(high) - scale(low)) * 0.04;
      const from = scale(low) - pad, range = scale(high) + pad - from;
      this.x = (value) => left + (value - start) / (last - start) * (width - left - right);
      this.y = (value) => height - bottom - (scale(value) - from) / range * (height - bottom - top);
      let rows = ticks(low, high, 5);
      if (log) {
        const first = Math.floor(Math.log10(low)), decades = Math.ceil(Math.log10(high)) - first;
        rows = Array.from({ length: decades + 1 }, (_, k) => 10 ** (first + k))
          .flatMap((power) => [1, 2, 5].map((digit) => digit * power))
          .filter((value) => value >= low && value <= high);
      }
      for (const value of rows) {
        const y = this.y(value);
        element(this.svg, "line", { class: "grid", x1: left, x2: width - right, y1: y, y2: y });
        element(this.svg, "text", { x: left - 6, y: y + 4, "text-anchor": "end" }, number(value));
      }
      for (const value of ticks(start, last, width < 330 ? 3 : 5)) {
        element(this.svg, "text",
          { x: this.x(value), y: height - 10, "text-anchor": "middle" }, steps(value));
      }
      element(this.svg, "text", { x: 8, y: 14 }, name);
      if (!quantity) {
        const y = this.y(data.threshold);
        element(this.svg, "line", { class: "threshold", x1: left, x2: width - right, y1: y, y2: y });
      }
      for (const curve of this.curves) this.curve(curve);
      this.cursor = element(this.svg, "g");
      this.look(this.at);
    }

    curve({ arm, centre, low, high }) {
      const group = marked(element(this.svg, "g", { class: "arm", "data-arm": arm }), arm);
      const line = (values) => values.map((value, i) =>
        `${this.x(data.steps[i]).toFixed(1)} ${this.y(value).toFixed(1)}`);
      if (low[0] !== null) {
        const edge = [...line(high), ...line(low).reverse()];
        element(group, "path", { class: "band", d: `M${edge.join("L")}Z` });
      }
      element(group, "path", { class: "centre", d: `M${line(centre).join("L")}`,
        "stroke-dasharray": data.arms[arm].dash });
      const every = Math.max(1, Math.round(centre.length / 5)), offset = arm % every;
      centre.forEach((value, i) => {
        if (i % every === offset) this.marker(group, arm, this.x(data.steps[i]), this.y(value));
      });
    }

    marker(parent, arm, x, y) {
      const place = `translate(${x.toFixed(1)} ${y.toFixed(1)})`;
      element(parent, "path", { class: "dot", d: data.arms[arm].marker, transform: place });
    }

    point(event) {
      if (!this.x) return;
      const box = this.svg.getBoundingClientRect(), x = event.clientX - box.left;
      let best = 0;
      data.steps.forEach((value, i) => {
        if (Math.abs(this.x(value) - x) < Math.abs(this.x(data.steps[best]) - x)) best = i;
      });
      this.look(best, event.clientY - box.top);
    }

    key(event) {
      const end = data.steps.length - 1, at = this.at ?? -1;
      const to = { ArrowRight: Math.min(at + 1, end), ArrowLeft: Math.max(at - 1, 0), Home: 0,
        End: end, Escape: null }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.look(to);
    }

    // Show the values at one evaluation; the curve nearest to the pointer is bold.
    look(at, pointer) {
      this.at = at;
      if (this.cursor) this.cursor.replaceChildren();
      const curves = at === null ? [] : [...this.curves].sort((a, b) => b.centre[at] - a.centre[at]);
      this.values.hidden = !curves.length;
      if (!curves.length || !this.cursor) return;
      const x = this.x(data.steps[at]), height = this.svg.getBoundingClientRect().height;
      element(this.cursor, "line", { class: "cursor", x1: x, x2: x, y1: 20, y2: height - 30 });
      const away = (curve) => Math.abs(this.y(curve.centre[at]) - pointer);
      const nearest = pointer === undefined ? null
        : curves.reduce((a, b) => (away(b) < away(a) ? b : a));
      this.values.replaceChildren();
      element(this.values, "div", {},
        `${data.steps[at].toLocaleString("en")} steps, ${this.panel.quantities[quantity]}`);
      const body = element(element(this.values, "table"), "tbody");
      for (const curve of curves) {
        const row = element(body, "tr", curve === nearest ? { class: "nearest" } : {});
        swatch(element(row, "td"), curve.arm);
        element(row, "td", { class: "name" }, data.arms[curve.arm].name);
        element(row, "td", {}, number(curve.centre[at]));
        element(row, "td", {}, curve.low[at] === null ? ""
          : `[${number(curve.low[at])}, ${number(curve.high[at])}]`);
        this.marker(marked(element(this.cursor, "g"), curve.arm), curve.arm, x, this.y(curve.centre[at]));
      }
      const spare = this.box.clientWidth - this.values.offsetWidth; // below the plot: hides no curve
      this.values.style.left = `${Math.max(0, Math.min(x - this.values.offsetWidth / 2, spare))}px`;
      this.values.style.top = `${this.svg.offsetTop + height + 4}px`;
    }
  }

  const swatch = (parent, arm) => {
    const picture = marked(element(parent, "svg",
      { width: 34, height: 14, viewBox: "-17 -7 34 14", "aria-hidden": "true" }), arm);
    element(picture, "path",
      { class: "centre", d: "M-17 0H17", "stroke-dasharray": data.arms[arm].dash });
    element(picture, "path", { class: "dot", d: data.arms[arm].marker });
  };

  const plots = [];
  const draw = () => plots.forEach((plot) => plot.draw());
  const press = (button, on) => button.setAttribute("aria-pressed", String(on));

  const choices = (label, kind) =>
    element(root, "div", { class: `choices ${kind}`, role: "group", "aria-label": label });

  const names = data.quantities;
  if (names.length > 1) {
    const group = choices("Quantity", "quantity");
    const buttons = names.map((name, i) => {
      const button = element(group, "button", { type: "button" });
      element(button, "span", {}, name);
      press(button, i === quantity);
      button.addEventListener("click", () => {
        quantity = i;
        buttons.forEach((other, k) => press(other, k === quantity));
        draw();
      });
      return button;
    });
  }
  const arms = choices("Arms", "arms");
  data.arms.forEach((arm, i) => {
    const button = element(arms, "button", { type: "button", title: arm.name });
    swatch(button, i);
    element(button, "span", {}, arm.name);
    press(button, true);
    button.addEventListener("click", () => {
      if (!shown.delete(i)) shown.add(i);
      press(button, shown.has(i));
      draw();
    });
  });
  const panels = element(root, "div", { class: "panels" });
  data.panels.forEach((panel) => plots.push(new Plot(panels, panel)));
  root.hidden = false;
})();
