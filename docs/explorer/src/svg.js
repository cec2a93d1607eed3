// Small helpers of the two flat views: elements, and handles for pointer, touch and keyboard.

const SPACE = "http://www.w3.org/2000/svg";

/** A new element inside `parent`. */
export function add(parent, tag, attributes = {}, text = "") {
  const element = document.createElementNS(SPACE, tag);
  set(element, attributes);
  if (text) element.textContent = text;
  parent.append(element);
  return element;
}

/** Set what has changed: to ask costs less than to set. */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

/** The point of an event in the coordinates of an SVG with y upwards. */
export function pointIn(svg, event) {
  const matrix = svg.getScreenCTM().inverse();
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
  return [point.x, -point.y];
}

/** A handle that is dragged with a pointer or moved with the arrow keys; its value is between two bounds. */
export function handle(svg, radius, label, [least, most], { drag, key }) {
  const group = add(svg, "g", {
    class: "handle", tabindex: 0, role: "slider", "aria-label": label,
    "aria-valuemin": least, "aria-valuemax": most, "aria-valuenow": 0,
  });
  add(group, "circle", { class: "halo", r: Math.max(radius, 9) });
  const dot = add(group, "circle", { r: radius });
  group.addEventListener("pointerdown", (event) => {
    group.setPointerCapture(event.pointerId);
    group.focus({ preventScroll: true });
    event.preventDefault();
  });
  group.addEventListener("pointermove", (event) => {
    if (group.hasPointerCapture(event.pointerId)) drag(pointIn(svg, event));
  });
  group.addEventListener("keydown", (event) => {
    const step = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!step) return;
    event.preventDefault();
    key(step.map((s) => s * (event.shiftKey ? 5 : 1)));
  });
  const place = (x, y, value, text) => set(group, {
    transform: `translate(${x} ${y})`,
    "aria-valuenow": Math.round(Math.min(most, Math.max(least, value))),
    "aria-valuetext": text,
  });
  return { group, dot, place };
}
