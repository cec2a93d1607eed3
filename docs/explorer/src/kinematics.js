// Constant-curvature kinematics in half-angle form: clarke_gym/kinematics, line by line.
// A robot with S segments bends by 2S numbers [rad]: x, y of each segment from the base on.

/** cos(phi/2) and h = sin(phi/2)/phi of u = phi^2, without a singularity at 0. */
export function halfAngle(u) {
  const half = 0.5 * Math.sqrt(u);
  const safe = Math.max(half, 1e-300);
  return [Math.cos(half), Math.sin(safe) / (2 * safe)];
}

/** dh/du. */
function halfAngleSlope(u, cosine, h) {
  if (u >= 1) return (0.5 * cosine - h) / (2 * u);
  let series = 1;
  for (let k = 10; k > 0; k--) {
    series = 1 - (series * (u / 4) * (k + 1)) / (k * (2 * k + 2) * (2 * k + 3));
  }
  return series / -48;
}

/** Position [m] and quaternion (w, x, y, z) at the end of an arc. */
export function arcPose(x, y, length) {
  const [cosine, h] = halfAngle(x * x + y * y);
  const scale = 2 * length * h;
  return [[scale * x * h, scale * y * h, scale * cosine], [cosine, -y * h, x * h, 0]];
}

/** A vector turned by a quaternion. */
export function turned([w, a, b, c], [x, y, z]) {
  const tx = 2 * (b * z - c * y), ty = 2 * (c * x - a * z), tz = 2 * (a * y - b * x);
  return [x + w * tx + b * tz - c * ty, y + w * ty + c * tx - a * tz, z + w * tz + a * ty - b * tx];
}

/** The product of two quaternions. */
export function product([w, a, b, c], [p, q, r, s]) {
  return [
    w * p - a * q - b * r - c * s,
    w * q + a * p + b * s - c * r,
    w * r - a * s + b * p + c * q,
    w * s + a * r - b * q + c * p,
  ];
}

/** Poses of all segments' ends in the base frame. */
export function chainPoses(bends, lengths) {
  const poses = [];
  let position = [0, 0, 0], quaternion = [1, 0, 0, 0];
  lengths.forEach((length, k) => {
    const [step, turn] = arcPose(bends[2 * k], bends[2 * k + 1], length);
    const moved = turned(quaternion, step);
    position = position.map((p, i) => p + moved[i]);
    quaternion = product(quaternion, turn);
    poses.push([position, quaternion]);
  });
  return poses;
}

/** Tip position [m]. */
export function tipPosition(bends, lengths) {
  return chainPoses(bends, lengths).at(-1)[0];
}

/** Points along the backbone with their frames: [position, quaternion], base first. */
export function backbone(bends, lengths, points) {
  const curve = [[[0, 0, 0], [1, 0, 0, 0]]];
  let position = [0, 0, 0], quaternion = [1, 0, 0, 0];
  lengths.forEach((length, k) => {
    let end;
    for (let i = 1; i <= points; i++) {
      const f = i / points;
      const [step, turn] = arcPose(f * bends[2 * k], f * bends[2 * k + 1], f * length);
      const moved = turned(quaternion, step);
      end = [position.map((p, j) => p + moved[j]), product(quaternion, turn)];
      curve.push(end);
    }
    [position, quaternion] = end;
  });
  return curve;
}

/** Bending vectors from the Clarke coordinates of all tendons: distal ones pass the proximal. */
export function decoupled(parts, radii) {
  return parts.map((part, i) => {
    const k = i >> 1;
    return part / radii[k] - (k ? parts[i - 2] / radii[k - 1] : 0);
  });
}

/** Clarke coordinates of all tendons from bending vectors. */
export function coupled(bends, radii) {
  const sum = [0, 0];
  return bends.map((bend, i) => (sum[i % 2] += bend) * radii[i >> 1]);
}

const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** Rows x, y, z of the tip's position Jacobian [m/rad], 2S columns. */
export function tipJacobian(bends, lengths) {
  const poses = chainPoses(bends, lengths);
  const tip = poses.at(-1)[0];
  const columns = [];
  lengths.forEach((length, k) => {
    const x = bends[2 * k], y = bends[2 * k + 1], u = x * x + y * y;
    const [cosine, h] = halfAngle(u);
    const slope = halfAngleSlope(u, cosine, h);
    const lateral = 2 * h * h, rise = 8 * h * slope, axial = 4 * slope * cosine - h * h;
    const push = [
      [length * (lateral + x * x * rise), length * x * y * rise, length * x * axial],
      [length * x * y * rise, length * (lateral + y * y * rise), length * y * axial],
    ];
    const [w, a, b] = [cosine, -y * h, x * h];
    const slopes = [
      [-0.5 * x * h, -x * y * 2 * slope, h + x * x * 2 * slope],
      [-0.5 * y * h, -h - y * y * 2 * slope, x * y * 2 * slope],
    ];
    const lever = tip.map((t, i) => t - poses[k][0][i]);
    for (const axis of [0, 1]) {
      const [w_, a_, b_] = slopes[axis];
      let spin = [2 * (a_ * w - w_ * a), 2 * (b_ * w - w_ * b), 2 * (b_ * a - a_ * b)];
      let move = push[axis];
      if (k) {
        spin = turned(poses[k - 1][1], spin);
        move = turned(poses[k - 1][1], move);
      }
      const swing = cross(spin, lever);
      columns.push(move.map((p, i) => p + swing[i]));
    }
  });
  return [0, 1, 2].map((row) => columns.map((column) => column[row]));
}

/** A vector shortened to at most a limit, its direction kept. */
export function shortened(x, y, limit) {
  const length = Math.sqrt(x * x + y * y);
  if (length <= limit) return [x, y];
  const scale = limit / length;
  return [x * scale, y * scale];
}

/** The solution of a small linear system, by elimination with pivots. */
export function solve(matrix, right) {
  const n = right.length;
  const rows = matrix.map((row, i) => [...row, right[i]]);
  for (let i = 0; i < n; i++) {
    let pivot = i;
    for (let r = i + 1; r < n; r++) if (Math.abs(rows[r][i]) > Math.abs(rows[pivot][i])) pivot = r;
    [rows[i], rows[pivot]] = [rows[pivot], rows[i]];
    for (let r = i + 1; r < n; r++) {
      const f = rows[r][i] / rows[i][i];
      for (let c = i; c <= n; c++) rows[r][c] -= f * rows[i][c];
    }
  }
  const result = new Array(n);
  for (let i = n - 1; i >= 0; i--) {
    let sum = rows[i][n];
    for (let c = i + 1; c < n; c++) sum -= rows[i][c] * result[c];
    result[i] = sum / rows[i][i];
  }
  return result;
}

/** The damped least-squares step (J^T J + lambda I)^-1 J^T e. */
export function dampedStep(jacobian, error, damping) {
  const columns = jacobian[0].length;
  const gram = Array.from({ length: columns }, (_, i) =>
    Array.from({ length: columns }, (_, j) =>
      jacobian.reduce((sum, row) => sum + row[i] * row[j], i === j ? damping : 0)));
  const right = Array.from({ length: columns }, (_, i) =>
    jacobian.reduce((sum, row, r) => sum + row[i] * error[r], 0));
  return solve(gram, right);
}

/** Bends within each segment's limit. */
export function saturated(bends, limits) {
  return limits.flatMap((limit, k) => shortened(bends[2 * k], bends[2 * k + 1], limit));
}

/** A reachable shape whose tip is near a position: damped steps from the shape at hand. */
export function nearestShape(position, robot, start, iterations = 60) {
  const length = robot.length;
  const cost = (bends) =>
    Math.hypot(...tipPosition(bends, robot.lengths).map((p, i) => position[i] - p));
  let bends = start, best = cost(start), damping = 1e-4;
  for (let i = 0; i < iterations && best > 1e-9; i++) {
    const tip = tipPosition(bends, robot.lengths);
    const jacobian = tipJacobian(bends, robot.lengths).map((row) => row.map((v) => v / length));
    const step = dampedStep(jacobian, tip.map((p, j) => (position[j] - p) / length), damping);
    const tried = saturated(bends.map((b, j) => b + step[j]), robot.maxBending);
    const reached = cost(tried);
    if (reached < best) [bends, best, damping] = [tried, reached, Math.max(damping / 4, 1e-9)];
    else damping = Math.min(4 * damping, 1e3);
  }
  return bends;
}
