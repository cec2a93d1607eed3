// Robots as data/robots.json describes them, with any number of tendons; limits and drives.

import { coupled, decoupled, shortened } from "./kinematics.js";
import { layout, ringAngles } from "./clarke.js";

/** A robot of a preset; n tendons a segment where the preset's are evenly spaced. */
export function makeRobot(preset, n) {
  const segments = preset.segments.map((segment) => {
    const angles = preset.even ? ringAngles(n, segment.angles[0]) : segment.angles;
    return { ...segment, ring: layout(angles) };
  });
  const radii = segments.map((s) => s.pitch_radius_m);
  const maxBending = segments.map((s) => s.max_bending_rad);
  let sum = 0;
  const maxClarke = maxBending.map((most, k) => radii[k] * (sum += most));
  return {
    name: preset.name,
    segments,
    radii,
    maxBending,
    maxClarke,
    lengths: segments.map((s) => s.length_m),
    length: segments.reduce((total, s) => total + s.length_m, 0),
    speeds: maxClarke.map((most) => (preset.max_tendon_speed_m_s * most) / maxClarke[0]),
    maxSpeed: preset.max_tendon_speed_m_s,
    maxOff: preset.max_cocontraction_m,
    lag: preset.actuator_time_constant_s,
    counts: segments.map((s) => s.ring.angles.length),
  };
}

/** A copy scaled down until no number passes the limit. */
function bounded(numbers, limit) {
  const largest = Math.max(...numbers.map(Math.abs));
  return largest > limit ? numbers.map((x) => (x * limit) / largest) : numbers;
}

/** The command that follows `command` under an increment; both {clarke, off} [m]. */
export function limitedCommand(robot, action, command, dt) {
  const parts = robot.lengths.flatMap((_, k) => {
    const step = robot.speeds[k] * dt, i = 2 * k;
    const [u, v] = shortened(action.clarke[i] * step, action.clarke[i + 1] * step, step);
    return [command.clarke[i] + u, command.clarke[i + 1] + v];
  });
  const bends = decoupled(parts, robot.radii);
  const kept = robot.maxBending.flatMap((most, k) => shortened(bends[2 * k], bends[2 * k + 1], most));
  let off = command.off;
  if (action.off) {
    const owner = robot.counts.flatMap((count, k) => Array(count).fill(k));
    const moved = bounded(
      action.off.map((a, i) => a * robot.speeds[owner[i]] * dt), robot.maxSpeed * dt);
    off = moved.map((m, i) => m + (command.off ? command.off[i] : 0));
  }
  if (off) off = bounded(off, robot.maxOff);
  return { clarke: coupled(kept, robot.radii), off };
}

/** Where the drives get to within one control period; `limited` keeps to the speed limit. */
export function driven(robot, held, command, dt, limited = false) {
  const gain = robot.lag === 0 ? 1 : -Math.expm1(-dt / robot.lag);
  const clarke = robot.speeds.flatMap((speed, k) => {
    const i = 2 * k;
    let u = gain * (command.clarke[i] - held.clarke[i]);
    let v = gain * (command.clarke[i + 1] - held.clarke[i + 1]);
    if (limited) [u, v] = shortened(u, v, speed * dt * (1 + 1e-9));
    return [held.clarke[i] + u, held.clarke[i + 1] + v];
  });
  if (!held.off && !command.off) return { clarke, off: null };
  const size = robot.counts.reduce((a, b) => a + b, 0);
  const from = held.off ?? Array(size).fill(0), to = command.off ?? Array(size).fill(0);
  return { clarke, off: from.map((x, i) => x + gain * (to[i] - x)) };
}
