// Gravity, inertia and tendons that only pull: MuJoCo's own WebAssembly build with the model that
// clarke_gym exports, for any number of tendons. While all are taut, two virtual tendons stand for
// the n of a segment; a step in which one goes slack is repeated with all of them, in shorter time
// steps (clarke_gym/physics/mujoco/folded.py).

import { decode, encode } from "./clarke.js";
import { solve } from "./kinematics.js";
import { driven } from "./robot.js";

const SLACK_DT = 2.5e-4;

/** The axes of a segment's two virtual tendons, [stiffness factor, [x, y]] each. */
function foldedAxes({ decoder }) {
  let a = 0, b = 0, c = 0;
  for (const [x, y] of decoder) [a, b, c] = [a + x * x, b + x * y, c + y * y];
  if (Math.abs(b) + Math.abs(a - c) < 1e-12 * a) return [[a, [1, 0]], [c, [0, 1]]];
  const turn = 0.5 * Math.atan2(2 * b, a - c), cos = Math.cos(turn), sin = Math.sin(turn);
  const along = a * cos * cos + 2 * b * cos * sin + c * sin * sin;
  return [[along, [cos, sin]], [a + c - along, [-sin, cos]]];
}

/** The exported model with the tendons of this robot; `input` is unknown to this older build. */
export function modelText(exported, robot, folded) {
  const hinges = hingesOf(exported);
  const tendons = [], actuators = [];
  robot.segments.forEach((segment, j) => {
    const offsets = folded ? foldedAxes(segment.ring) : segment.ring.decoder.map((row) => [1, row]);
    offsets.forEach(([factor, [x, y]], i) => {
      const name = `tendon${j}_${i}`, d = segment.pitch_radius_m;
      const wraps = hinges
        .map((hinge) => [hinge, { x: d * y, y: -d * x, z: 0 }[hinge.axis]])
        .filter(([hinge, coef]) => hinge.segment <= j && coef !== 0)
        .map(([hinge, coef]) => `<joint joint="${hinge.name}" coef="${coef}"/>`);
      tendons.push(`<fixed name="${name}" springlength="0">${wraps.join("")}</fixed>`);
      const k = segment.tendon_stiffness_n_m * factor;
      const pulls = folded ? "" : 'forcelimited="true" forcerange="-1e9 0" ';
      actuators.push(`<general name="${name}" tendon="${name}" ctrllimited="false" actlimited="false"`
        + ` ${pulls}dyntype="integrator" actearly="true" biastype="affine" gainprm="${k}"`
        + ` biasprm="0 ${-k}"/>`);
    });
  });
  return exported
    .replace(/<tendon>[^]*<\/tendon>/, `<tendon>${tendons.join("")}</tendon>`)
    .replace(/<actuator>[^]*<\/actuator>/, `<actuator>${actuators.join("")}</actuator>`);
}

function hingesOf(text) {
  return [...text.matchAll(/<joint name="(([xyz])(\d+)_\d+)"/g)].map(
    ([, name, axis, segment]) => ({ name, axis, segment: Number(segment) }));
}

/** One compiled model with its state. */
class Simulation {
  constructor(mujoco, text) {
    this.mujoco = mujoco;
    this.model = mujoco.MjModel.from_xml_string(text);
    this.data = new mujoco.MjData(this.model);
    this.dt = this.model.opt.timestep;
  }

  place({ qpos, qvel, warm }) {
    this.data.qpos.set(qpos);
    this.data.qvel.set(qvel);
    this.data.qacc_warmstart.set(warm);
  }

  get where() {
    const { qpos, qvel, qacc_warmstart } = this.data;
    return { qpos: [...qpos], qvel: [...qvel], warm: [...qacc_warmstart] };
  }

  /** Advance while the commanded lengths run from `first` to `last`; `watch` may stop it. */
  run(first, last, steps, watch = () => true) {
    const { mujoco, model, data } = this;
    const time = steps * this.dt;
    data.act.set(first);
    data.ctrl.set(last.map((l, i) => (l - first[i]) / time));
    for (let k = 1; k <= steps; k++) {
      mujoco.mj_step(model, data);
      if (!watch(k / steps)) return false;
    }
    return true;
  }

  free() {
    this.data.delete();
    this.model.delete();
  }
}

export class Mujoco {
  most = 1.25;

  constructor(mujoco, robot, exported, dt) {
    this.mujoco = mujoco;
    this.robot = robot;
    this.dt = dt;
    this.exported = exported;
    this.folded = new Simulation(mujoco, modelText(exported.folded, robot, true));
    this.steps = Math.round(dt / this.folded.dt);
    this.hinges = hingesOf(exported.folded);
    this.bending = robot.segments.map((_, k) =>
      this.hinges.filter((hinge) => hinge.segment === k && hinge.axis !== "z").length);
    this.stations = [0];
    const places = this.folded.model.body_pos;
    for (let i = 1; i < places.length / 3; i++) {
      this.stations.push(this.stations[i - 1] + places[3 * i + 2]);
    }
    this.axes = robot.segments.map((segment) => foldedAxes(segment.ring).map(([, axis]) => axis));
    this.preload = robot.segments.map((s) => s.pretension_n / s.tendon_stiffness_n_m);
    this.wentSlack = false;
    this.reset(Array(2 * robot.lengths.length).fill(0));
  }

  /** The model with all tendons, made when the first one goes slack. */
  get whole() {
    this._whole ??= new Simulation(this.mujoco, modelText(this.exported.whole, this.robot, false));
    return this._whole;
  }

  reset(clarke, off = null) {
    this.held = { clarke: [...clarke], off };
    const rest = this.equilibrium(clarke);
    const qpos = this.hinges.map(({ axis, segment }) => {
      const share = 2 / this.bending[segment];
      return { x: -share * rest[2 * segment + 1], y: share * rest[2 * segment], z: 0 }[axis];
    });
    const still = qpos.map(() => 0);
    this.folded.place({ qpos, qvel: still, warm: still });
    this.update();
  }

  /** The bends at which taut tendons balance an unloaded backbone. */
  equilibrium(clarke) {
    const { robot } = this, size = clarke.length;
    const matrix = Array.from({ length: size }, () => Array(size).fill(0));
    const right = Array(size).fill(0);
    robot.segments.forEach((segment, j) => {
      matrix[2 * j][2 * j] += segment.flexural_nm_rad;
      matrix[2 * j + 1][2 * j + 1] += segment.flexural_nm_rad;
      const d = segment.pitch_radius_m, k = segment.tendon_stiffness_n_m;
      segment.ring.decoder.forEach((row) => {
        const pulled = row[0] * clarke[2 * j] + row[1] * clarke[2 * j + 1] + this.preload[j];
        for (let a = 0; a < 2 * j + 2; a++) {
          right[a] += k * d * row[a % 2] * pulled;
          for (let b = 0; b < 2 * j + 2; b++) matrix[a][b] += k * d * d * row[a % 2] * row[b % 2];
        }
      });
    });
    return solve(matrix, right);
  }

  /** Commanded displacements of all tendons [m], segment by segment. */
  commanded({ clarke, off }) {
    let place = 0;
    return this.robot.segments.map(({ ring }, j) =>
      decode(ring, [clarke[2 * j], clarke[2 * j + 1]]).map((rho) =>
        rho + (off ? off[place++] : 0)));
  }

  foldedLengths({ clarke }) {
    return this.robot.segments.flatMap(({ ring }, j) => {
      const preload = encode(ring, ring.decoder.map(() => this.preload[j]));
      const [x, y] = [clarke[2 * j] + preload[0], clarke[2 * j + 1] + preload[1]];
      return this.axes[j].map(([a, b]) => -(a * x + b * y));
    });
  }

  /** Clarke coordinates [m] that joint angles take the tendons up by. */
  taken(qpos) {
    const sum = Array(2 * this.robot.lengths.length).fill(0);
    this.hinges.forEach(({ axis, segment }, i) => {
      if (axis === "y") sum[2 * segment] += qpos[i];
      if (axis === "x") sum[2 * segment + 1] -= qpos[i];
    });
    const total = [0, 0];
    return sum.map((bend, i) => (total[i % 2] += bend) * this.robot.radii[i >> 1]);
  }

  /** Tensions [N] by segment, negative where a tendon would push. */
  pulls(commanded, qpos) {
    const taken = this.taken(qpos);
    return this.robot.segments.map((segment, j) => {
      const actual = decode(segment.ring, [taken[2 * j], taken[2 * j + 1]]);
      const k = segment.tendon_stiffness_n_m;
      return actual.map((rho, i) => segment.pretension_n + k * (commanded[j][i] - rho));
    });
  }

  step(command) {
    const start = this.held, end = driven(this.robot, start, command, this.dt, true);
    const from = this.commanded(start), to = this.commanded(end);
    const taut = (share) => this.pulls(
      from.map((row, j) => row.map((x, i) => x + share * (to[j][i] - x))), this.folded.data.qpos,
    ).every((row) => row.every((pull) => pull >= 0));
    const before = this.folded.where;
    const loose = start.off && !taut(0);
    const run = !loose && this.folded.run(
      this.foldedLengths(start), this.foldedLengths(end), this.steps, taut);
    this.wentSlack = !run;
    if (!run) {
      const lengths = (rows) =>
        rows.flatMap((row, j) => row.map((rho) => -rho - this.preload[j]));
      const finer = Math.ceil(this.folded.dt / SLACK_DT - 1e-9);
      this.whole.place(before);
      this.whole.run(lengths(from), lengths(to), this.steps * finer);
      this.folded.place(this.whole.where);
    }
    this.held = end;
    this.update();
  }

  update() {
    this.mujoco.mj_kinematics(this.folded.model, this.folded.data);
    this.qpos = [...this.folded.data.qpos];
  }

  get displacement() {
    return this.taken(this.qpos);
  }

  get bends() {
    const { radii } = this.robot, taken = this.displacement;
    return taken.map((part, i) => part / radii[i >> 1] - (i > 1 ? taken[i - 2] / radii[(i >> 1) - 1] : 0));
  }

  get tip() {
    return [...this.folded.data.xpos.slice(-3)];
  }

  /** Tensions [N] of all tendons, by segment; 0 where one is slack. */
  get tension() {
    return this.pulls(this.commanded(this.held), this.qpos).map((row) => row.map((t) => Math.max(0, t)));
  }

  /** Points along the backbone with their frames, as kinematics.backbone gives them. */
  curve(points) {
    const { xpos, xquat } = this.folded.data, last = this.stations.length - 1;
    const place = (station) => {
      let body = last;
      while (body > 1 && this.stations[body] > station + 1e-12) body--;
      const along = station - this.stations[body];
      const q = [...xquat.slice(4 * body, 4 * body + 4)];
      const axis = [2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]),
        1 - 2 * (q[1] * q[1] + q[2] * q[2])];
      return [axis.map((a, i) => xpos[3 * body + i] + along * a), q];
    };
    let start = 0;
    const stations = this.robot.lengths.flatMap((length) => {
      const here = start;
      start += length;
      return Array.from({ length: points }, (_, i) => here + (length * (i + 1)) / points);
    });
    return [0, ...stations].map(place);
  }

  free() {
    this.folded.free();
    this._whole?.free();
  }
}

/** Load the simulator; the packed WebAssembly is unpacked here. */
export async function loadMujoco(folder) {
  const [{ default: load }, packed] = await Promise.all([
    import(new URL("mujoco.min.js", folder).href),
    fetch(new URL("mujoco.wasm.gz", folder)),
  ]);
  if (!packed.ok) throw new Error(`mujoco.wasm.gz: ${packed.status}`);
  const bytes = await packed.arrayBuffer();
  // A server may have unpacked it on the way already.
  const zipped = new Uint8Array(bytes, 0, 2).join() === "31,139";
  const stream = new Blob([bytes]).stream();
  const wasmBinary = zipped
    ? await new Response(stream.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer()
    : bytes;
  return load({ wasmBinary });
}
