// Classical control: the tip straight at the goal through the damped inverse Jacobian
// (resolved rate, clarke_gym/control/controllers.py).

import { coupled, dampedStep, decoupled, saturated, tipJacobian } from "./kinematics.js";

const GAIN = 0.6, DAMPING = 0.1;

/** The action, in units of the speed limit, of a robot that sees its displacement and tip. */
export function resolvedRate(robot, command, displacement, tip, goal, dt) {
  const bends = decoupled(displacement, robot.radii);
  const jacobian = tipJacobian(bends, robot.lengths).map((row) => row.map((v) => v / robot.length));
  const gap = goal.map((g, i) => (GAIN * (g - tip[i])) / robot.length);
  const step = dampedStep(jacobian, gap, DAMPING * DAMPING);
  const slow = periods(robot, coupled(step, robot.radii), dt); // before limits turn a long step
  const moved = saturated(bends.map((b, i) => b + step[i] / slow), robot.maxBending);
  const change = coupled(moved.map((m, i) => m - bends[i]), robot.radii);
  return towards(robot, command.map((c, i) => c + change[i]), command, dt);
}

/** How many control periods, at least one, a change of the command takes. */
function periods(robot, change, dt) {
  const steps = robot.speeds.map((speed, k) =>
    Math.hypot(change[2 * k], change[2 * k + 1]) / (speed * dt));
  return Math.max(1, ...steps);
}

/** The action that moves the command along a straight line to a target, at most at full speed. */
export function towards(robot, target, command, dt) {
  const change = target.map((t, i) => t - command[i]);
  const slow = periods(robot, change, dt);
  return change.map((c, i) => {
    const action = c / slow / (robot.speeds[i >> 1] * dt);
    return Math.min(1, Math.max(-1, action));
  });
}
