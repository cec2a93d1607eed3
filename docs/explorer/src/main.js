// The explorer: one state, three linked views, a clock of control steps where something moves by
// itself. Whoever moves the robot, you, the policy or classical control, gives the same actions.

import { decode, encode } from "./clarke.js";
import { loadColour } from "./colours.js";
import { resolvedRate, towards } from "./control.js";
import { Disk } from "./disk.js";
import { backbone, coupled, decoupled, nearestShape, saturated, tipPosition } from "./kinematics.js";
import { loadMujoco, Mujoco } from "./mujoco.js";
import { ConstantCurvature } from "./physics.js";
import { act, observation } from "./policy.js";
import { Ring } from "./ring.js";
import { limitedCommand, makeRobot } from "./robot.js";
import { Scene } from "./scene.js";
import { PRESETS, readHash, writeHash } from "./state.js";

const DT = 0.05, TOLERANCE = 0.02, MAGNIFIED = 20;
const POLICIES = ["default", "default2", "default3"];
const element = (id) => document.getElementById(id);
const here = new URL("..", import.meta.url);

/** A file of data; what goes wrong names it. */
async function fetched(name) {
  const file = `data/${name}.json`;
  try {
    const answer = await fetch(new URL(file, here));
    if (!answer.ok) throw new Error(`status ${answer.status}`);
    return await answer.json();
  } catch (error) {
    throw new Error(`${file} could not be loaded: ${error.message}`);
  }
}

class App {
  constructor(robots) {
    Object.assign(this, {
      robots, networks: {}, selected: 0, mode: "hand", gravity: false, beside: false, again: false,
      view: [50, 14], dirty: true, owed: 0, heldSince: null, simulator: null, generation: 0, asked: {}, pending: "",
    });
    this.disk = new Disk(element("disk"), this);
    this.ring = new Ring(element("ring"), this);
  }

  // --- what is shown ------------------------------------------------------------------------

  get displacement() {
    return this.physics.displacement;
  }

  get bends() {
    return this.physics.bends;
  }

  /** The shape that the hand asks for; the robot may still be on its way. */
  get wantedBends() {
    return decoupled(this.wanted.clarke, this.robot.radii);
  }

  /** The policy trained for this robot, where there is one. */
  get network() {
    return this.networks[this.key];
  }

  get reached() {
    return this.error <= TOLERANCE * this.robot.length;
  }

  get error() {
    const { tip } = this.physics;
    return Math.hypot(...this.goal.map((g, i) => g - tip[i]));
  }

  /** How much the part off the manifold is enlarged: real drives allow it tenths of millimetres. */
  get magnified() {
    return this.gravity ? MAGNIFIED : 1;
  }

  /** The off-manifold numbers of one segment's tendons [m]. */
  offOf(j) {
    const first = this.robot.counts.slice(0, j).reduce((a, b) => a + b, 0);
    const { off } = this.physics.held;
    return Array.from({ length: this.robot.counts[j] }, (_, i) => (off ? off[first + i] : 0));
  }

  /** The colours of one segment's tendons. */
  tendonColours(j) {
    const { tension } = this.physics, segment = this.robot.segments[j];
    if (tension) return tension[j].map((t) => loadColour(t / segment.pretension_n - 1));
    const off = this.offOf(j), onto = decode(segment.ring, this.displacement.slice(2 * j, 2 * j + 2));
    return onto.map((rho, i) => loadColour((rho + off[i]) / this.robot.maxClarke[j]));
  }

  touch() {
    this.dirty = true;
  }

  // --- what changes -------------------------------------------------------------------------

  /**
   * Make the robot anew: another one, other tendons, other physics. The shape is kept, unless
   * `start` has one. All that was goes on, untouched, until all that is asked for is loaded.
   */
  async build(asked) {
    const generation = ++this.generation;
    this.asked = { ...this.asked, ...asked };
    const next = { ...this, ...this.asked }, { key, n } = next, preset = this.robots[key], troubles = [];
    const robot = makeRobot(preset, preset.even ? n : preset.segments[0].angles.length);
    let { gravity } = next;
    let made = () => new ConstantCurvature(robot, DT);
    if (gravity) {
      if (!this.simulator) this.waitFor("MuJoCo");
      try {
        this.simulator ??= loadMujoco(new URL("vendor/", here));
        const mujoco = await this.simulator;
        made = () => new Mujoco(mujoco, robot, preset.mjcf, DT);
      } catch (error) {
        this.simulator = null;
        gravity = false;
        troubles.push(`MuJoCo could not be loaded: ${error.message}.`);
      }
    }
    if (POLICIES.includes(key) && !this.networks[key]) {
      this.waitFor("the policy");
      try {
        this.networks[key] = await fetched(`policy_${key}`);
      } catch (error) {
        troubles.push(`There is no trained policy here: ${error.message}.`);
      }
    }
    if (generation !== this.generation) return; // something newer is on its way
    let physics;
    try {
      physics = made();
    } catch (error) {
      if (!gravity) throw error;
      gravity = false;
      made = () => new ConstantCurvature(robot, DT);
      physics = made();
      troubles.push(`MuJoCo cannot simulate this robot: ${error.message}.`);
    }
    const { start, ...changes } = this.asked;
    const before = !start && this.robot?.name === key ? this.bends : null;
    this.physics?.free();
    this.ghost?.physics.free();
    this.view = this.pictures?.view ?? this.view; // where it was turned to by hand, unless a link says
    Object.assign(this, changes, { gravity, robot, made, physics, ghost: null, asked: {}, pending: "" });
    this.selected = Math.min(this.selected, robot.lengths.length - 1);
    const clarke = before ? coupled(before, robot.radii) : this.fitting(start?.c, 2 * robot.lengths.length);
    this.place({ clarke, off: before ? null : this.fittingOff(start?.off) });
    this.aim(this.goal ?? tipPosition(robot.maxBending.flatMap((b) => [0.4 * b, 0.2 * b]), robot.lengths));
    if (!this.network && this.mode === "policy") this.mode = "classical";
    this.disk.build();
    this.ring.build();
    this.pictures?.build();
    this.controls();
    write(element("trouble"), troubles.join(" "));
    this.touch();
  }

  /** Change what needs no robot anew: now, and still when what is being loaded is there. */
  set(changes) {
    Object.assign(this, changes);
    if (Object.keys(this.asked).length) Object.assign(this.asked, changes);
  }

  /** Say what is being loaded, until it is there. */
  waitFor(what) {
    this.pending = `loading ${what} …`;
    this.say(this.pending);
  }

  fitting(numbers, size) {
    const clarke = numbers?.length === size ? numbers : Array(size).fill(0);
    const { radii, maxBending } = this.robot;
    return coupled(saturated(decoupled(clarke, radii), maxBending), radii);
  }

  /** Numbers off the manifold of a link; what lies on it is taken away. */
  fittingOff(numbers) {
    const { counts, segments, maxOff } = this.robot;
    if (numbers?.length !== counts.reduce((a, b) => a + b, 0)) return null;
    let first = 0;
    const off = counts.flatMap((count, j) => {
      const rho = numbers.slice(first, (first += count));
      const onto = decode(segments[j].ring, encode(segments[j].ring, rho));
      return rho.map((r, i) => r - onto[i]);
    });
    const largest = Math.max(...off.map(Math.abs));
    return this.gravity && largest > maxOff ? off.map((o) => (o * maxOff) / largest) : off;
  }

  /** Put the robot somewhere, at rest. */
  place({ clarke, off }) {
    this.wanted = { clarke, off };
    this.command = { clarke: [...clarke], off: this.gravity ? null : off };
    this.physics.reset(clarke, this.gravity ? null : off);
    this.before = this.after = this.curveOf(this.physics);
    this.share = 1;
    if (this.ghost) this.startGhost();
    this.touch();
  }

  curveOf(physics) {
    const points = Math.max(...this.robot.segments.map((s) => s.n_disks));
    return physics.curve ? physics.curve(points) : backbone(physics.bends, this.robot.lengths, points);
  }

  bendByHand(bends) {
    this.takeOver();
    this.want({ clarke: coupled(bends, this.robot.radii), off: this.wanted.off });
  }

  /** Pull tendon i of the selected segment in by so much more; its neighbours hold theirs. */
  pullByHand(i, change) {
    this.takeOver();
    const { robot, selected: j } = this, { ring } = robot.segments[j];
    const first = robot.counts.slice(0, j).reduce((a, b) => a + b, 0);
    const from = this.wanted, off = from.off ? [...from.off] : robot.counts.flatMap((c) => Array(c).fill(0));
    const rho = decode(ring, from.clarke.slice(2 * j, 2 * j + 2)).map((r, k) => r + off[first + k]);
    rho[i] += change;
    const clarke = [...from.clarke], seen = encode(ring, rho), onto = decode(ring, seen);
    [clarke[2 * j], clarke[2 * j + 1]] = seen;
    onto.forEach((r, k) => { off[first + k] = rho[k] - r; });
    const kept = coupled(saturated(decoupled(clarke, robot.radii), robot.maxBending), robot.radii);
    const largest = Math.max(...off.map(Math.abs));
    const most = this.gravity ? robot.maxOff : Infinity;
    this.want({ clarke: kept, off: largest > most ? off.map((o) => (o * most) / largest) : off });
  }

  want(wanted) {
    if (this.gravity) this.wanted = wanted;
    else this.place(wanted);
    this.touch();
  }

  projected() {
    this.want({ clarke: this.wanted.clarke, off: null });
  }

  /** A hand on the robot ends what a policy does. */
  takeOver() {
    if (this.mode === "hand") return;
    this.set({ mode: "hand" });
    this.wanted = { clarke: [...this.command.clarke], off: this.command.off };
    this.controls();
  }

  select(k) {
    if (k === this.selected) return;
    this.selected = k;
    this.ring.build();
    this.touch();
  }

  /** Set the goal to the reachable position that is nearest to one asked for. */
  setGoal(position) {
    this.goalBends = nearestShape(position, this.robot, this.goalBends);
    this.goal = tipPosition(this.goalBends, this.robot.lengths);
    this.heldSince = null;
    this.touch();
  }

  aim(position) {
    this.goalBends = this.robot.maxBending.flatMap((b) => [0.3 * b, 0.1 * b]);
    this.setGoal(position);
  }

  /** Another goal: the tip of a random shape, uniform over the dome of each segment. */
  anotherGoal() {
    const bends = this.robot.maxBending.flatMap((most) => {
      const density = (phi) => {
        const e = 1e-4, at = (p) => [(1 - Math.cos(p)) / p, Math.sin(p) / p];
        const [r, z] = at(phi), [r1, z1] = at(phi + e);
        return (r * Math.hypot(r1 - r, z1 - z)) / e;
      };
      let phi;
      do phi = (0.02 + 0.98 * Math.random()) * most; while (Math.random() * 0.35 > density(phi));
      const theta = 2 * Math.PI * Math.random();
      return [phi * Math.cos(theta), phi * Math.sin(theta)];
    });
    this.goalBends = bends;
    this.goal = tipPosition(bends, this.robot.lengths);
    this.heldSince = null;
    this.touch();
  }

  // --- the clock ----------------------------------------------------------------------------

  get moves() {
    return this.gravity || this.mode !== "hand";
  }

  /** The action of whoever moves the robot, in Clarke coordinates and units of the speed limit. */
  action(mode, physics, command) {
    const { robot } = this;
    if (mode === "policy") {
      return { clarke: act(this.network,
        observation(robot, command.clarke, physics.displacement, physics.tip, this.goal, physics.most)) };
    }
    if (mode === "classical") {
      return { clarke: resolvedRate(robot, command.clarke, physics.displacement, physics.tip, this.goal, DT) };
    }
    const { clarke, off } = this.wanted;
    const gap = (o, i) => ((off ? off[i] : 0) - o) / (robot.maxSpeed * DT);
    const held = command.off ?? (off && off.map(() => 0));
    return { clarke: towards(robot, clarke, command.clarke, DT), off: held && held.map(gap) };
  }

  control() {
    const { physics } = this;
    this.command = limitedCommand(this.robot, this.action(this.mode, physics, this.command), this.command, DT);
    physics.step(this.command);
    [this.before, this.after] = [this.after, this.curveOf(physics)];
    if (this.mode !== "hand") this.wanted = { clarke: [...this.command.clarke], off: this.command.off };
    this.ghostStep();
  }

  startGhost() {
    this.ghost?.physics.free();
    const physics = this.made();
    physics.reset(this.command.clarke);
    this.ghost = { physics, command: { clarke: [...this.command.clarke], off: null } };
    this.ghost.before = this.ghost.after = this.curveOf(physics);
  }

  ghostStep() {
    if (!this.beside || this.mode !== "policy") return;
    if (!this.ghost) this.startGhost();
    const { ghost } = this;
    ghost.command = limitedCommand(
      this.robot, this.action("classical", ghost.physics, ghost.command), ghost.command, DT);
    ghost.physics.step(ghost.command);
    [ghost.before, ghost.after] = [ghost.after, this.curveOf(ghost.physics)];
  }

  tick(seconds) {
    if (this.moves) {
      this.owed = Math.min(this.owed + seconds, 2 * DT);
      if (this.owed >= DT) {
        this.owed -= DT;
        this.control();
        this.goalHeld();
      }
      this.share = Math.min(1, this.owed / DT);
      this.dirty = true;
    }
    if (this.dirty) this.draw();
  }

  goalHeld() {
    if (!this.reached) this.heldSince = null;
    else this.heldSince ??= performance.now();
    const held = this.heldSince !== null && performance.now() - this.heldSince > 700;
    if (this.again && this.mode !== "hand" && held) this.anotherGoal();
  }

  // --- drawing ------------------------------------------------------------------------------

  draw() {
    this.dirty = false;
    this.disk.update();
    this.ring.update();
    const ghost = this.beside && this.mode === "policy" && this.ghost;
    this.pictures?.update(
      between(this.before, this.after, this.share),
      ghost && between(ghost.before, ghost.after, this.share));
    this.tell();
  }

  say(text) {
    write(element("verdict"), text);
  }

  tell() {
    const { robot, physics, mode } = this, millimetres = (v, digits = 1) => (v * 1e3).toFixed(digits);
    const off = this.offOf(this.selected), largest = Math.max(...off.map(Math.abs));
    element("project").disabled = !this.wanted.off || !this.wanted.off.some((o) => Math.abs(o) > 1e-7);
    const rows = robot.lengths.map((_, k) => {
      const [x, y] = this.bends.slice(2 * k, 2 * k + 2), d = robot.radii[k];
      const [angle, direction] = [Math.hypot(x, y), Math.atan2(y, x)].map((a) => (a * 180) / Math.PI);
      const of = robot.lengths.length > 1 ? ` of segment ${k + 1}` : "";
      return [`Clarke coordinates${of}`,
        `${millimetres(d * x)}, ${millimetres(d * y)} mm: bent by ${angle.toFixed(0)}° towards ${direction.toFixed(0)}°`];
    });
    const tendons = robot.counts.reduce((a, b) => a + b, 0);
    rows.push(["numbers for the tendons", `${tendons}, of which ${2 * robot.lengths.length} bend the robot`]);
    rows.push(["off the manifold", `${millimetres(largest, 2)} mm at most${
      this.gravity ? `, drawn ${MAGNIFIED} times; drives allow ${millimetres(robot.maxOff)} mm` : ""}`]);
    rows.push(["tip", `${physics.tip.map((t) => millimetres(t, 0)).join(", ")} mm`]);
    rows.push(["distance to the goal", `${millimetres(this.error)} mm`]);
    const { tension } = physics;
    if (tension) {
      const all = tension.flat(), slack = all.filter((t) => t === 0).length;
      rows.push(["tensions", `${Math.min(...all).toFixed(1)} to ${Math.max(...all).toFixed(1)} N${
        slack ? `, ${slack} slack` : ""}`]);
    }
    const list = element("numbers");
    if (list.children.length !== 2 * rows.length) {
      list.replaceChildren(...rows.flatMap(() => [document.createElement("dt"), document.createElement("dd")]));
    }
    rows.flat().forEach((text, i) => write(list.children[i], text));
    const inputs = element("goal").querySelectorAll("input[type=number]");
    inputs.forEach((input, i) => {
      if (document.activeElement !== input) input.value = Math.round(this.goal[i] * 1e3);
    });
    element("verdict").classList.toggle("reached", this.reached);
    const who = {
      hand: "You",
      policy: `Policy trained with ${this.network?.trained_on.n_tendons} tendons, here with ${robot.counts[0]}`,
      classical: "Classical control",
    }[mode];
    const distance = this.reached ? "goal reached" : `${millimetres(this.error, 0)} mm to the goal`;
    this.say(this.pending || `${who}: ${distance}`);
    write(element("ring-of"), robot.lengths.length > 1 ? `of segment ${this.selected + 1}` : "");
  }

  /** Bring the controls up to what is. */
  controls() {
    const preset = this.robots[this.key], { network } = this;
    element("robot").value = this.asked.key ?? this.key;
    element("n").value = this.robot.counts[0];
    element("n").disabled = !preset.even;
    element("n-out").value = this.robot.counts[0];
    for (const input of document.querySelectorAll("input[name=mode]")) {
      input.checked = input.value === this.mode;
      if (input.value === "policy") {
        input.disabled = !network;
        input.parentElement.title = network || POLICIES.includes(this.key)
          ? "" : "There is a policy for the default robot only.";
      }
    }
    for (const name of ["gravity", "beside", "again"]) element(name).checked = this.asked[name] ?? this[name];
    element("beside").disabled = this.mode !== "policy";
    element("about").textContent = network
      ? `The policy: ${network.env_steps.toLocaleString("en")} steps of training with `
        + `${network.trained_on.n_tendons} tendons; ${network.note}` : "";
    element("scale").textContent = "squares of 5 cm";
    for (const [name, value] of Object.entries({ mode: this.mode, robot: this.key, n: this.robot.counts[0] })) {
      document.documentElement.dataset[name] = value;
    }
  }

  // --- links --------------------------------------------------------------------------------

  get hash() {
    return writeHash({
      robot: this.key, n: this.robot.counts[0], mode: this.mode, gravity: this.gravity, beside: this.beside,
      again: this.again, c: this.wanted.clarke, off: this.wanted.off, goal: this.goal,
      view: this.pictures?.view ?? this.view,
    });
  }

  follow(hash) {
    const given = readHash(hash), { n = 7, gravity = false, beside = false, again = false } = given;
    return this.build({
      key: Object.hasOwn(this.robots, given.robot) ? given.robot : "default",
      mode: ["hand", "policy", "classical"].includes(given.mode) ? given.mode : "hand",
      n, gravity, beside, again,
      goal: given.goal?.length === 3 ? given.goal : null,
      start: given,
      ...(given.view?.length === 2 && { view: given.view }),
    });
  }
}

/** Write a text where it is not what stands there: the page is laid out again for every other. */
function write(place, text) {
  if (place.textContent !== text) place.textContent = text;
}

/** Points and frames part of the way between two curves. */
function between(a, b, share) {
  if (share >= 1 || a.length !== b.length) return b;
  return b.map(([position, turn], k) => {
    const mixed = turn.map((q, i) => a[k][1][i] + share * (q - a[k][1][i]));
    const size = Math.hypot(...mixed);
    return [position.map((p, i) => a[k][0][i] + share * (p - a[k][0][i])), mixed.map((q) => q / size)];
  });
}

/** Fill the two lists to choose from. */
function fillLists(robots) {
  element("preset").add(new Option("a picture …", ""));
  PRESETS.forEach(([name], i) => element("preset").add(new Option(name, i)));
  Object.entries(robots).forEach(([key, { label }]) => element("robot").add(new Option(label, key)));
}

function connect(app) {
  const presets = element("preset");
  presets.addEventListener("change", () => {
    if (presets.value) location.hash = PRESETS[presets.value][1];
    presets.value = "";
  });
  element("robot").addEventListener("change", (event) => {
    app.build({ key: event.target.value, goal: null, start: null });
  });
  element("n").addEventListener("input", (event) => app.build({ n: Number(event.target.value) }));
  const mode = (value) => {
    app.takeOver();
    app.set({ mode: value });
    app.wanted = { clarke: app.wanted.clarke, off: null };
    app.command = { clarke: app.command.clarke, off: null };
    if (!app.gravity) app.physics.held.off = null;
    app.ghost?.physics.free();
    app.ghost = null;
    app.controls();
    app.touch();
  };
  for (const input of document.querySelectorAll("input[name=mode]")) {
    input.addEventListener("change", () => mode(input.value));
  }
  element("gravity").addEventListener("change", (event) => app.build({ gravity: event.target.checked }));
  for (const name of ["beside", "again"]) {
    element(name).addEventListener("change", (event) => {
      app.set({ [name]: event.target.checked });
      if (!app.beside) {
        app.ghost?.physics.free();
        app.ghost = null;
      }
      app.touch();
    });
  }
  element("project").addEventListener("click", () => app.projected());
  element("random").addEventListener("click", () => app.anotherGoal());
  const inputs = [...element("goal").querySelectorAll("input[type=number]")];
  for (const input of inputs) {
    input.addEventListener("change", () => {
      const asked = inputs.map((i) => i.valueAsNumber * 1e-3);
      if (asked.every(Number.isFinite)) app.setGoal(asked);
    });
    input.addEventListener("blur", () => app.touch()); // what stands there is the goal again
  }
  element("link").addEventListener("click", async () => {
    history.replaceState(null, "", app.hash);
    const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
    element("linked").textContent = copied ? "copied" : "it stands in the address bar";
  });
  element("theme").addEventListener("click", () => {
    theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    app.view = app.pictures?.view ?? app.view;
    app.pictures?.build();
    app.touch();
  });
  const policy = () => mode(app.mode === "hand" ? (app.network ? "policy" : "classical") : "hand");
  const keys = {
    " ": policy,
    g: () => app.anotherGoal(),
    p: () => app.projected(),
    0: () => app.bendByHand(app.bends.map(() => 0)),
    "+": () => step(1),
    "=": () => step(1),
    "-": () => step(-1),
  };
  const step = (by) => {
    if (!app.robots[app.key].even) return;
    app.build({ n: Math.min(32, Math.max(3, app.robot.counts[0] + by)) });
  };
  addEventListener("keydown", (event) => {
    // Fields and lists take every key; what is pressed by a space, that one alone.
    const pressed = event.key === " " ? ", button, input[type=checkbox]" : "";
    const taken = event.target.closest(`input[type=number], select${pressed}`);
    if (taken || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  addEventListener("hashchange", () => app.follow(location.hash));
}

function theme(name) {
  document.documentElement.dataset.theme = name;
}

async function main() {
  theme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  const robots = await fetched("robots");
  fillLists(robots);
  const app = new App(robots);
  const { hash } = location;
  await app.follow(hash.length > 1 ? hash : PRESETS[0][1]);
  connect(app);
  if (location.hash !== hash) app.follow(location.hash); // followed while the page began
  try {
    app.pictures = new Scene(element("scene"), app, new URLSearchParams(location.search).get("draw"));
    app.pictures.build();
  } catch (error) {
    element("scale").textContent = `no picture in three dimensions: ${error.message}`;
  }
  let last = performance.now();
  const frame = (now) => {
    requestAnimationFrame(frame); // a frame that fails is not the last one
    app.tick(Math.min(0.2, (now - last) / 1e3));
    last = now;
  };
  frame(last);
  performance.mark("first picture");
  // The address holds the picture, written while nothing else happens.
  let seen;
  setInterval(() => {
    if (app.pending || app.moves) return;
    const { hash } = app, still = hash === seen;
    seen = hash;
    if (still && hash !== location.hash) history.replaceState(null, "", hash);
  }, 700);
  window.explorer = app; // for tests and curious consoles
}

main().catch((error) => {
  write(element("trouble"), `The explorer could not start: ${error.message}`);
  throw error; // for the console
});
