// JavaScript against the golden numbers that Python wrote: node --test tests/explorer

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { decode, encode, layout, project, ringAngles } from "../../docs/explorer/src/clarke.js";
import { resolvedRate } from "../../docs/explorer/src/control.js";
import {
  backbone, chainPoses, coupled, decoupled, nearestShape, tipJacobian, tipPosition,
} from "../../docs/explorer/src/kinematics.js";
import { ConstantCurvature } from "../../docs/explorer/src/physics.js";
import { act, observation } from "../../docs/explorer/src/policy.js";
import { limitedCommand, makeRobot } from "../../docs/explorer/src/robot.js";

const read = (path) => JSON.parse(readFileSync(new URL(path, import.meta.url)));
const golden = read("golden.json");
const robots = read("../../docs/explorer/data/robots.json");
const dt = golden.control_dt;

/** Every number of `a` within `tolerance` of that of `b`, however they are nested. */
function near(a, b, tolerance, what = "") {
  const [x, y] = [[a].flat(9), [b].flat(9)];
  assert.equal(x.length, y.length, `${what}: ${x.length} numbers, not ${y.length}`);
  x.forEach((value, i) => assert.ok(
    Math.abs(value - y[i]) <= tolerance, `${what}[${i}]: ${value} is not ${y[i]}`));
}

test("maps of 3 to 32 tendons equal Python's to 1e-12", () => {
  assert.equal(golden.maps.length, 30);
  for (const { n, rho, clarke, encoded, decoded, projected } of golden.maps) {
    const ring = layout(ringAngles(n));
    near(encode(ring, rho), encoded, 1e-12, `encode ${n}`);
    near(decode(ring, clarke), decoded, 1e-12, `decode ${n}`);
    near(project(ring, rho), projected, 1e-12, `project ${n}`);
  }
});

test("shapes, tips, frames and Jacobians equal Python's to 1e-12", () => {
  for (const shape of golden.shapes) {
    const robot = makeRobot(robots[shape.robot], 3), { bends } = shape;
    near(coupled(bends, robot.radii), shape.clarke, 1e-12, "coupled");
    near(decoupled(shape.clarke, robot.radii), bends, 1e-12, "decoupled");
    near(tipPosition(bends, robot.lengths), shape.tip, 1e-12, "tip");
    near(chainPoses(bends, robot.lengths).at(-1)[1], shape.quaternion, 1e-12, "quaternion");
    const curve = backbone(bends, robot.lengths, 4);
    near(curve.map(([position]) => position), shape.backbone, 1e-12, "backbone");
    near(curve.at(-1)[1], shape.quaternion, 1e-12, "frame of the last point");
    near(tipJacobian(bends, robot.lengths), shape.jacobian, 1e-12, "jacobian");
  }
});

test("limits and drives follow raw actions as Python does, off the manifold, too", () => {
  let off = 0;
  for (const { robot: key, n, steps } of golden.moves) {
    const robot = makeRobot(robots[key], n);
    const physics = new ConstantCurvature(robot, dt);
    let command = { clarke: physics.displacement, off: null };
    steps.forEach((step, k) => {
      command = limitedCommand(robot, step.action, command, dt);
      physics.step(command);
      near(command.clarke, step.command.clarke, 1e-12, `${key} command ${k}`);
      if (step.command.off) near(command.off, step.command.off, 1e-12, `${key} off ${k}`);
      if (step.command.off) off += 1;
      near(physics.displacement, step.held, 1e-12, `${key} held ${k}`);
    });
  }
  assert.ok(off > 100, "commands off the manifold must have been tried");
});

test("policies and classical control act as Python's in whole episodes, to 1e-6", () => {
  const agents = new Set();
  for (const { robot: key, n, agent, goal, command: start, steps } of golden.episodes) {
    agents.add(agent);
    const robot = makeRobot(robots[key], n);
    const network = agent === "policy" && read(`../../docs/explorer/data/policy_${key}.json`);
    const physics = new ConstantCurvature(robot, dt);
    physics.reset(start);
    let command = { clarke: start, off: null };
    steps.forEach((step, k) => {
      const seen = observation(robot, command.clarke, physics.displacement, physics.tip, goal);
      near(seen, step.observation, 2e-7, `${key} ${agent} n=${n} observation ${k}`);
      let action;
      if (network) {
        action = act(network, step.observation);
      } else {
        // Python's controllers read the float32 observation, too.
        const size = 2 * robot.lengths.length, from = step.observation;
        const joint = (o) => from.slice(o, o + size).map((v, i) => v * robot.maxClarke[i >> 1]);
        const place = (o) => from.slice(2 * size + o, 2 * size + o + 3).map((v) => v * robot.length);
        action = resolvedRate(robot, joint(0), joint(size), place(0), place(3), dt);
      }
      near(action, step.action, 1e-6, `${key} ${agent} n=${n} action ${k}`);
      command = limitedCommand(robot, { clarke: step.action }, command, dt);
      physics.step(command);
      const error = Math.hypot(...physics.tip.map((t, i) => t - goal[i]));
      near(error, step.tip_error_m, 1e-7 * robot.length, "tip error"); // Python's is of float32
    });
  }
  assert.deepEqual([...agents].sort(), ["policy", "resolved_rate"]);
});

test("a policy sees the same numbers and acts alike for every number of tendons", () => {
  const network = read("../../docs/explorer/data/policy_default.json");
  const runs = [3, 4, 7, 11, 32].map((n) => {
    const robot = makeRobot(robots.default, n), physics = new ConstantCurvature(robot, dt);
    const goal = [0.06, -0.05, 0.17];
    let command = { clarke: [0, 0], off: null };
    for (let k = 0; k < 60; k++) {
      const seen = observation(robot, command.clarke, physics.displacement, physics.tip, goal);
      command = limitedCommand(robot, { clarke: act(network, seen) }, command, dt);
      physics.step(command);
    }
    return physics.displacement;
  });
  for (const run of runs) near(run, runs[0], 1e-12, "displacement");
});

test("the nearest shape reaches what can be reached and stays inside the limits", () => {
  for (const shape of golden.shapes.filter(({ bends }) => Math.hypot(...bends) > 0.1)) {
    const robot = makeRobot(robots[shape.robot], 3);
    const start = shape.bends.map((b, i) => 0.8 * b + 0.01 * (i % 3));
    const found = nearestShape(shape.tip, robot, start);
    const gap = tipPosition(found, robot.lengths).map((t, i) => t - shape.tip[i]);
    assert.ok(Math.hypot(...gap) < 1e-4 * robot.length, `${shape.robot}: ${Math.hypot(...gap)} m`);
    found.forEach((_, i) => assert.ok(
      Math.hypot(found[i & ~1], found[i | 1]) <= robot.maxBending[i >> 1] + 1e-12));
  }
});
