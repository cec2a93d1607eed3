// Two physics behind one face: {reset, step, bends, displacement, tip, tension}.

import { decoupled, tipPosition } from "./kinematics.js";
import { driven } from "./robot.js";

/** Taut tendons, circular arcs, drives with a first-order lag. */
export class ConstantCurvature {
  most = 1;

  constructor(robot, dt) {
    this.robot = robot;
    this.dt = dt;
    this.reset(Array(2 * robot.lengths.length).fill(0));
  }

  reset(clarke, off = null) {
    this.held = { clarke: [...clarke], off };
  }

  step(command) {
    this.held = driven(this.robot, this.held, command, this.dt);
  }

  get displacement() {
    return this.held.clarke;
  }

  get bends() {
    return decoupled(this.held.clarke, this.robot.radii);
  }

  get tip() {
    return tipPosition(this.bends, this.robot.lengths);
  }

  free() {}
}
