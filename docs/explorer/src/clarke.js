// The Clarke transform of n tendons on a ring: maps between n displacements and 2 coordinates.
// The same formulas as clarke_gym/clarke/transform.py; tests/explorer holds them together.

/** Angles of n tendons spaced evenly from `first` [rad]. */
export function ringAngles(n, first = 0) {
  return Array.from({ length: n }, (_, i) => first + (2 * Math.PI * i) / n);
}

/** A layout of tendons: decoder rows (cos, sin) and the least-squares encoder. */
export function layout(angles) {
  const decoder = angles.map((psi) => [Math.cos(psi), Math.sin(psi)]);
  let a = 0, b = 0, c = 0;
  for (const [x, y] of decoder) {
    a += x * x;
    b += x * y;
    c += y * y;
  }
  const det = a * c - b * b;
  const encoder = decoder.map(([x, y]) => [(c * x - b * y) / det, (a * y - b * x) / det]);
  return { angles, decoder, encoder };
}

/** Clarke coordinates [Re, Im] of displacements. */
export function encode({ encoder }, rho) {
  let re = 0, im = 0;
  encoder.forEach(([x, y], i) => {
    re += x * rho[i];
    im += y * rho[i];
  });
  return [re, im];
}

/** Displacements of Clarke coordinates. */
export function decode({ decoder }, [re, im]) {
  return decoder.map(([x, y]) => x * re + y * im);
}

/** What the projector leaves of displacements; the rest is off the manifold. */
export function project(ring, rho) {
  return decode(ring, encode(ring, rho));
}
