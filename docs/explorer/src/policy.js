// A trained policy: observation in Clarke coordinates, a small tanh network, action in [-1, 1].

/** What the policy sees, as clarke_gym writes it: command, displacement, tip, goal, gap. */
export function observation(robot, command, displacement, tip, goal, most = Infinity) {
  const joint = [command, displacement].flatMap((parts) =>
    parts.map((part, i) => {
      const scaled = part / robot.maxClarke[i >> 1];
      return Math.fround(Math.min(Math.max(scaled, -most), most));
    }));
  const seen = tip.map((p) => Math.fround(p / robot.length));
  const wanted = goal.map((p) => Math.fround(p / robot.length));
  return [...joint, ...seen, ...wanted, ...wanted.map((w, i) => Math.fround(w - seen[i]))];
}

/** The action of a network {layers: [{weight, bias}]}: tanh between, clipped at the end. */
export function act({ layers }, seen) {
  let values = seen;
  layers.forEach(({ weight, bias }, depth) => {
    values = weight.map((row, i) => {
      const sum = row.reduce((total, w, j) => total + w * values[j], bias[i]);
      return depth < layers.length - 1 ? Math.tanh(sum) : sum;
    });
  });
  return values.map((a) => Math.min(1, Math.max(-1, a)));
}
