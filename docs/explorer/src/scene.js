// The robot in three dimensions: discs, backbone, tendons, goal with its drop line, floor.

import * as THREE from "../vendor/three.min.js";
import { SHADES } from "./disk.js";
import { turned } from "./kinematics.js";
import { makeRasteriser } from "./rasteriser.js";

const UP = new THREE.Vector3(0, 1, 0);

export class Scene {
  constructor(canvas, app, rasteriser) {
    Object.assign(this, { canvas, app });
    this.renderer = makeRasteriser(canvas, rasteriser);
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 20);
    this.camera.up.set(0, 0, 1);
    this.orbit = new THREE.OrbitControls(this.camera, canvas);
    this.orbit.enablePan = false;
    this.orbit.addEventListener("change", () => app.touch());
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.4);
    sun.position.set(1, -2, 3);
    this.scene.add(sun);
    this.root = new THREE.Group();
    this.scene.add(this.root);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.dragGoal();
  }

  colour(name) {
    return new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  }

  /** Make everything for a new robot or theme. */
  build() {
    const { app, root } = this, { robot } = app, length = robot.length;
    root.traverse((part) => {
      part.geometry?.dispose();
      part.material?.dispose();
      part.dispose?.();
    });
    root.clear();
    this.scene.background = this.colour("--sky");
    const total = robot.maxBending.reduce((a, b) => a + b, 0);
    // Below every tip, and as far as tips get from the base's axis (rendering/room.py).
    this.floor = -Math.max(0.1, Math.max(0, 1 - Math.PI / total) + 0.05) * length;
    const turning = Math.min(1, (0.5 * Math.PI) / total);
    this.reach = ((turning * 2) / Math.PI + 1 - turning) * length;
    this.points = Math.max(...robot.segments.map((s) => s.n_disks));

    const matt = (name, options = {}) =>
      new THREE.MeshStandardMaterial({ color: this.colour(name), roughness: 0.75, ...options });
    const side = 1.4 * this.reach;
    const floor = new THREE.Mesh(
      new THREE.CircleGeometry(side, 64), new THREE.MeshBasicMaterial({ color: this.colour("--floor") }));
    floor.position.z = this.floor - 1e-3;
    const grid = this.grid(side);
    root.add(floor, grid);

    const radius = Math.max(...robot.radii);
    const base = new THREE.Mesh(
      new THREE.CylinderGeometry(1.6 * radius, 1.6 * radius, -this.floor, 32), matt("--disk"));
    base.rotation.x = Math.PI / 2;
    base.position.z = this.floor / 2;
    root.add(base);

    const pieces = robot.lengths.length * this.points;
    const thick = Math.max(0.0035 * length, 7e-4);
    const cylinders = (r, count, material, sides = 12) => {
      const mesh = new THREE.InstancedMesh(new THREE.CylinderGeometry(r, r, 1, sides, 1), material, count);
      mesh.frustumCulled = false;
      root.add(mesh);
      return mesh;
    };
    this.backbone = cylinders(thick, pieces, matt("--back"));
    this.discs = robot.segments.map((segment, k) =>
      cylinders(1.12 * segment.pitch_radius_m, this.points - 1, matt("--disk", { transparent: true, opacity: 0.9 }), 32));
    this.strands = strands(robot);
    const most = this.strands.reduce((sum, { from, to }) => sum + (to - from) * this.points, 0);
    const slim = 0.0022 * length;
    this.tendons = cylinders(slim, most, new THREE.MeshStandardMaterial({ roughness: 0.6 }), 6);
    // Stretches where tendons stand so close that they hide those on the far side.
    this.dense = robot.segments.map(({ pitch_radius_m: d }, s) =>
      this.strands.filter(({ from, to }) => from <= s && s < to).length * slim > 0.8 * Math.PI * d);
    this.ends = robot.segments.map((segment, k) => {
      const ring = new THREE.Mesh(
        new THREE.CylinderGeometry(1.16 * segment.pitch_radius_m, 1.16 * segment.pitch_radius_m, 0.012 * length, 32),
        new THREE.MeshStandardMaterial({ color: new THREE.Color(SHADES[k]), roughness: 0.7 }));
      root.add(ring);
      return ring;
    });
    this.ghost = cylinders(1.6 * thick, pieces, matt("--ghost", { transparent: true, opacity: 0.55 }));
    this.shadow = this.line(2 * pieces, "--line");

    this.ball = new THREE.Mesh(
      new THREE.SphereGeometry(0.02 * length, 32, 16), matt("--goal", { transparent: true, opacity: 0.85 }));
    this.drop = this.line(2, "--goal");
    this.spot = new THREE.Mesh(
      new THREE.RingGeometry(0.012 * length, 0.02 * length, 32), new THREE.MeshBasicMaterial({ color: this.colour("--goal") }));
    root.add(this.ball, this.spot);
    this.lying = [floor, grid, this.shadow, this.spot];
    this.goalColours = { goal: this.colour("--goal"), reached: this.colour("--reached") };
    this.look(app.view);
    this.resize();
  }

  /** Squares of 5 cm. */
  grid(side) {
    const lines = [], step = 0.05, z = this.floor;
    for (let k = -Math.floor(side / step); k <= side / step; k++) {
      const x = k * step, y = Math.sqrt(Math.max(0, side * side - x * x));
      lines.push(x, -y, z, x, y, z, -y, x, z, y, x, z);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines), 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour("--line") }));
  }

  line(points, colour) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * points), 3));
    const line = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour(colour) }));
    line.frustumCulled = false;
    this.root.add(line);
    return line;
  }

  /** Frame the arm: azimuth and elevation [deg]. */
  look([azimuth, elevation]) {
    const { length } = this.app.robot;
    const centre = 0.5 * (length + this.floor);
    // The whole reach fits into the narrower of the two directions.
    const aspect = Math.min(1, this.camera.aspect || 1);
    const size = Math.max(this.reach, 0.62 * (length - this.floor));
    const distance = (1.12 * size) / Math.tan((this.camera.fov * Math.PI) / 360) / aspect;
    const [a, e] = [azimuth, elevation].map((v) => (v * Math.PI) / 180);
    this.orbit.target.set(0, 0, centre);
    this.camera.position.set(
      distance * Math.cos(e) * Math.cos(a), distance * Math.cos(e) * Math.sin(a), centre + distance * Math.sin(e));
    this.orbit.minDistance = 0.3 * distance;
    this.orbit.maxDistance = 2 * distance;
    this.orbit.update();
  }

  get view() {
    const [x, y, z] = this.camera.position.clone().sub(this.orbit.target).toArray();
    return [Math.atan2(y, x), Math.atan2(z, Math.hypot(x, y))].map((v) => (v * 180) / Math.PI);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    const before = this.camera.aspect;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.floor !== undefined && before !== this.camera.aspect) this.look(this.view);
    this.app.touch();
  }

  /** Put a piece of a cylinder from a to b. */
  put(mesh, index, a, b) {
    const { from, to, along, turn, size, matrix } = scratch;
    from.fromArray(a);
    to.fromArray(b);
    along.subVectors(to, from);
    const length = along.length();
    turn.setFromUnitVectors(UP, along.divideScalar(length || 1));
    matrix.compose(from.add(to).multiplyScalar(0.5), turn, size.set(1, length, 1));
    mesh.setMatrixAt(index, matrix);
  }

  update(curve, ghostCurve) {
    const { app, points } = this, { robot } = app;
    // What lies on the floor is behind all else, or before it where the camera is below.
    const lowest = this.camera.position.z > this.floor ? -this.lying.length : 1;
    this.lying.forEach((part, k) => { part.renderOrder = lowest + k; });
    const shadow = this.shadow.geometry.attributes.position;
    for (let k = 0; k + 1 < curve.length; k++) {
      const [a, b] = [curve[k][0], curve[k + 1][0]];
      this.put(this.backbone, k, a, b);
      shadow.setXYZ(2 * k, a[0], a[1], this.floor);
      shadow.setXYZ(2 * k + 1, b[0], b[1], this.floor);
      const segment = Math.floor(k / points);
      const normal = turned(curve[k + 1][1], [0, 0, 0.1 * robot.lengths[segment] / points]);
      const [down, up] = [-1, 1].map((s) => b.map((v, i) => v + s * normal[i]));
      // The last one of a segment is its coloured end.
      if ((k + 1) % points) this.put(this.discs[segment], k % points, down, up);
    }
    shadow.needsUpdate = true;
    this.ends.forEach((ring, k) => {
      const [position, [w, x, y, z]] = curve[(k + 1) * points];
      ring.position.fromArray(position);
      ring.quaternion.set(x, y, z, w).multiply(scratch.lying);
    });
    let piece = 0;
    const colours = robot.segments.map((_, j) => app.tendonColours(j));
    const eye = this.camera.position.toArray();
    for (const { j, i, place, from, to } of this.strands) {
      scratch.colour.set(colours[j][i]);
      let last, lastSeen;
      for (let k = from * points; k <= to * points; k++) {
        const [centre, turn] = curve[k], out = turned(turn, place), hole = out.map((v, c) => v + centre[c]);
        const stretch = Math.max(0, Math.ceil(k / points) - 1);
        const seen = !this.dense[stretch] || towards(eye, hole, out);
        if (last && (seen || lastSeen)) {
          this.tendons.setColorAt(piece, scratch.colour);
          this.put(this.tendons, piece++, last, hole);
        }
        [last, lastSeen] = [hole, seen];
      }
    }
    this.tendons.count = piece;
    this.tendons.instanceColor.needsUpdate = true;
    this.ghost.visible = Boolean(ghostCurve);
    if (ghostCurve) {
      for (let k = 0; k + 1 < ghostCurve.length; k++) {
        this.put(this.ghost, k, ghostCurve[k][0], ghostCurve[k + 1][0]);
      }
    }
    for (const mesh of [this.backbone, this.tendons, this.ghost, ...this.discs]) {
      mesh.instanceMatrix.needsUpdate = true;
    }
    const [x, y, z] = app.goal, colour = this.goalColours[app.reached ? "reached" : "goal"];
    this.ball.position.set(x, y, z);
    this.spot.position.set(x, y, this.floor + 5e-4);
    const drop = this.drop.geometry.attributes.position;
    drop.setXYZ(0, x, y, z);
    drop.setXYZ(1, x, y, this.floor);
    drop.needsUpdate = true;
    for (const part of [this.ball, this.spot, this.drop]) part.material.color.copy(colour);
    this.renderer.render(this.scene, this.camera);
  }

  /** The ball follows a pointer in the plane that faces the camera. */
  dragGoal() {
    const { canvas, camera } = this;
    const caster = new THREE.Raycaster(), plane = new THREE.Plane(), hit = new THREE.Vector3();
    const aim = (event) => {
      const box = canvas.getBoundingClientRect();
      caster.setFromCamera(new THREE.Vector2(
        ((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2), camera);
    };
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      aim(event);
      const near = caster.ray.distanceToPoint(this.ball.position) < 0.045 * this.app.robot.length;
      if (!near) return;
      held = event.pointerId;
      this.orbit.enabled = false;
      canvas.setPointerCapture(held);
      plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), this.ball.position);
      event.stopImmediatePropagation();
    }, { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      if (event.pointerId !== held) return;
      aim(event);
      if (caster.ray.intersectPlane(plane, hit)) this.app.setGoal(hit.toArray());
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => {
        if (event.pointerId !== held) return;
        held = null;
        this.orbit.enabled = true;
      });
    }
  }
}

/** Whether a direction at a place is on the side of an eye. */
function towards(eye, place, out) {
  return out[0] * (eye[0] - place[0]) + out[1] * (eye[1] - place[1]) + out[2] * (eye[2] - place[2]) > 0;
}

/** Where each tendon is seen: in a hole that tendons share, the one that ends first. */
function strands(robot) {
  const found = [];
  robot.segments.forEach(({ pitch_radius_m: d, ring }, j) => {
    ring.angles.forEach((psi, i) => {
      const place = [d * Math.cos(psi), d * Math.sin(psi), 0];
      const shared = found.filter((other) => other.place.every((p, c) => Math.abs(p - place[c]) < 1e-6));
      found.push({ j, i, place, from: Math.max(0, ...shared.map((other) => other.to)), to: j + 1 });
    });
  });
  return found;
}

const scratch = {
  from: new THREE.Vector3(), to: new THREE.Vector3(), along: new THREE.Vector3(),
  turn: new THREE.Quaternion(), size: new THREE.Vector3(), matrix: new THREE.Matrix4(),
  colour: new THREE.Color(),
  lying: new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI / 2),
};
