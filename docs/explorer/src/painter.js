// Draws three.js's scene on a 2-D canvas, for where WebGL is missing or slow: what is farthest is
// painted first. It knows what the explorer's scene is made of: cylinders, balls, discs, rings and
// lines; each is painted as an outline or two, not as triangles. All places are the camera's, z backwards.

import { Color, Matrix4 } from "../vendor/three.min.js";
import { Light } from "./light.js";

const SHAPES = { CylinderGeometry: "cylinder", SphereGeometry: "ball", CircleGeometry: "face", RingGeometry: "face" };
const THIN = 12; // a cylinder with no more sides than this may be a stroke
const CORNERS = 32; // of a circle

export class Painter {
  constructor(canvas) {
    Object.assign(this, { canvas, context: canvas.getContext("2d", { alpha: false }), ratio: 1 });
  }

  setPixelRatio(ratio) {
    this.ratio = ratio;
  }

  setSize(width, height) {
    Object.assign(this, { width, height });
    this.canvas.width = Math.floor(width * this.ratio);
    this.canvas.height = Math.floor(height * this.ratio);
  }

  render(scene, camera) {
    const { context, width, height, ratio } = this;
    scene.updateMatrixWorld();
    camera.updateMatrixWorld();
    this.near = camera.near;
    this.focal = (camera.projectionMatrix.elements[5] * height) / 2;
    this.light = new Light(scene, camera);
    this.strokes = [];
    scene.traverseVisible((part) => this.collect(part, camera));
    this.strokes.sort((a, b) => a.order - b.order || b.depth - a.depth);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = scene.background.getStyle();
    context.fillRect(0, 0, width, height);
    context.translate(width / 2, height / 2);
    for (const { opacity, paint } of this.strokes) {
      context.globalAlpha = opacity;
      paint();
    }
    context.globalAlpha = 1;
  }

  /** Turn a part into what has to be painted. */
  collect(part, camera) {
    const { geometry, material } = part;
    if (!geometry) return;
    const shape = this[part.isLineSegments ? "lines" : SHAPES[geometry.type]];
    const { at, piece, color } = scratch;
    at.multiplyMatrices(camera.matrixWorldInverse, part.matrixWorld);
    if (!part.isInstancedMesh) {
      shape.call(this, part, at, material.color);
      return;
    }
    color.copy(material.color);
    for (let k = 0; k < part.count; k++) {
      part.getMatrixAt(k, piece);
      if (part.instanceColor) part.getColorAt(k, color);
      shape.call(this, part, piece.premultiply(at), color);
    }
  }

  /** Remember what to paint when its turn comes. */
  later({ renderOrder: order, material: { opacity } }, depth, paint) {
    this.strokes.push({ order, depth, opacity, paint });
  }

  // --- shapes -------------------------------------------------------------------------------

  cylinder(part, { elements: m }, color) {
    const { parameters } = part.geometry, half = parameters.height / 2;
    const radius = parameters.radiusTop * Math.hypot(m[0], m[1], m[2]);
    const centre = [m[12], m[13], m[14]], axis = [half * m[4], half * m[5], half * m[6]];
    if (-centre[2] < this.near + radius) return;
    if (parameters.radialSegments <= THIN) this.rod(part, centre, axis, radius, color);
    else this.drum(part, m, centre, axis, radius, color);
  }

  /** A thin cylinder: one stroke, lit as its side towards the camera is. */
  rod(part, [x, y, z], [a, b, c], radius, color) {
    const { context, focal } = this, near = focal / -(z + c), far = focal / -(z - c);
    const along = -(x * a + y * b + z * c) / (a * a + b * b + c * c || 1);
    const [u, v, w] = [-x - along * a, -y - along * b, -z - along * c], size = Math.hypot(u, v, w) || 1;
    const style = this.light.on(part.material, color, u / size, v / size, w / size);
    const width = (2 * radius * focal) / -z;
    // Square ends close the joints, but what shows through must not overlap itself there.
    const end = part.material.transparent ? "butt" : "square";
    this.later(part, -z, () => {
      context.strokeStyle = style;
      context.lineWidth = width;
      context.lineCap = end;
      context.beginPath();
      context.moveTo((x + a) * near, -(y + b) * near);
      context.lineTo((x - a) * far, -(y - b) * far);
      context.stroke();
    });
  }

  /** A wide cylinder: the side as far as it is seen, and the cap that is. */
  drum(part, m, centre, axis, radius, color) {
    const u = unit(m, 0), v = unit(m, 8), n = unit(m, 4), depth = -centre[2];
    const lit = (normal) => this.light.on(part.material, color, ...normal);
    const [top, foot] = [1, -1].map((s) => centre.map((p, i) => p + s * axis[i]));
    const [x, y] = [-dot(u, centre), -dot(v, centre)], distance = Math.hypot(x, y);
    if (distance > radius) {
      const middle = Math.atan2(y, x), half = Math.acos(radius / distance);
      const angles = between(middle - half, middle + half, CORNERS / 2);
      const [upper, lower] = [top, foot].map((c) => this.projected(circle(c, u, v, radius, angles)));
      const normals = circle([0, 0, 0], u, v, 1, angles);
      const style = this.across(upper, (k) => lit(normals[k]));
      // Tendons run inside a disc's side, so that it hides those before its middle.
      this.later(part, depth - radius, () => this.fill([[...upper, ...lower.reverse()]], style));
    }
    const sides = [[top, n], [foot, n.map((p) => -p)]];
    const [cap, normal] = sides.find(([c, out]) => dot(out, c) < 0) ?? [];
    if (!cap) return; // the camera is between the planes of both
    // Tendons go through a disc, but all stand on a tall drum.
    const tall = dot(axis, axis) > 0.09 * radius * radius;
    const rim = this.projected(circle(cap, u, v, radius)), style = lit(normal);
    this.later(part, depth + (tall ? radius : 0), () => this.fill([rim], style));
  }

  ball(part, { elements: m }, color) {
    const { context, focal, light } = this, { material, geometry } = part;
    const depth = -m[14], scale = focal / depth, size = geometry.parameters.radius * scale;
    if (depth < this.near) return;
    const x = m[12] * scale, y = -m[13] * scale, { x: a, y: b, z: c } = light.brightest;
    const style = context.createRadialGradient(x + 0.6 * a * size, y - 0.6 * b * size, 0, x, y, size);
    style.addColorStop(0, light.on(material, color, a, b, c));
    style.addColorStop(1, light.on(material, color, -a, -b, 0));
    this.later(part, depth, () => {
      context.fillStyle = style;
      context.beginPath();
      context.arc(x, y, size, 0, 2 * Math.PI);
      context.fill();
    });
  }

  /** A disc or a ring without thickness, of one side only. */
  face(part, { elements: m }, color) {
    const { radius, innerRadius, outerRadius } = part.geometry.parameters;
    const centre = [m[12], m[13], m[14]], u = unit(m, 0), v = unit(m, 4), n = unit(m, 8);
    if (dot(n, centre) > 0) return;
    const rims = [radius ?? outerRadius, innerRadius].filter(Boolean)
      .map((r) => this.projected(circle(centre, u, v, r)));
    const style = this.light.on(part.material, color, ...n);
    this.later(part, -centre[2], () => this.fill(rims, style));
  }

  /** Lines of one pixel, all in one stroke. */
  lines(part, { elements: m }, color) {
    const { context } = this, { array, count } = part.geometry.attributes.position;
    const points = Array.from({ length: count }, (_, k) => [0, 1, 2].map((i) =>
      m[i] * array[3 * k] + m[4 + i] * array[3 * k + 1] + m[8 + i] * array[3 * k + 2] + m[12 + i]));
    const depth = points.reduce((sum, p) => sum - p[2], 0) / count;
    const style = this.light.on(part.material, color);
    this.later(part, depth, () => {
      context.strokeStyle = style;
      context.lineWidth = 1;
      context.beginPath();
      for (let k = 0; k < count; k += 2) this.trace(this.projected([points[k], points[k + 1]]));
      context.stroke();
    });
  }

  // --- outlines -----------------------------------------------------------------------------

  /** Corners of an outline on the canvas; what is behind the camera is cut off. */
  projected(points) {
    const { near, focal } = this, kept = [];
    points.forEach((b, k) => {
      const a = points.at(k - 1), ahead = -b[2] > near;
      if (-a[2] > near !== ahead) {
        const share = (-near - a[2]) / (b[2] - a[2]);
        kept.push(a.map((p, i) => p + share * (b[i] - p)));
      }
      if (ahead) kept.push(b);
    });
    return kept.map(([x, y, z]) => [(-focal * x) / z, (focal * y) / z]);
  }

  trace(corners) {
    corners.forEach(([x, y], k) => (k ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }

  fill(outlines, style) {
    const { context } = this;
    context.fillStyle = style;
    context.beginPath();
    for (const corners of outlines) {
      this.trace(corners);
      context.closePath();
    }
    context.fill("evenodd");
  }

  /** A gradient along a row of points on the canvas, with the style of every few. */
  across(points, styleOf) {
    const last = points.length - 1, [x, y] = points[0], [dx, dy] = points[last].map((p, i) => p - points[0][i]);
    const shades = this.context.createLinearGradient(x, y, x + dx, y + dy);
    for (let k = 0; k <= last; k += last / 4) {
      const [px, py] = points[k], share = ((px - x) * dx + (py - y) * dy) / (dx * dx + dy * dy || 1);
      shades.addColorStop(Math.min(1, Math.max(0, share)), styleOf(k));
    }
    return shades;
  }
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** A column of a matrix, of length 1. */
function unit(m, first) {
  const size = Math.hypot(m[first], m[first + 1], m[first + 2]) || 1;
  return [m[first] / size, m[first + 1] / size, m[first + 2] / size];
}

const between = (from, to, steps) => Array.from({ length: steps + 1 }, (_, k) => from + (k / steps) * (to - from));

const TURN = between(0, 2 * Math.PI, CORNERS);

function circle([x, y, z], u, v, radius, angles = TURN) {
  return angles.map((angle) => {
    const c = radius * Math.cos(angle), s = radius * Math.sin(angle);
    return [x + c * u[0] + s * v[0], y + c * u[1] + s * v[1], z + c * u[2] + s * v[2]];
  });
}

const scratch = { at: new Matrix4(), piece: new Matrix4(), color: new Color() };
