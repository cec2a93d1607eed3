// Colours of tendons, as clarke_gym's pictures have them: blue is slack, grey rests, red pulls.

const STOPS = [[0.16, 0.42, 0.88], [0.62, 0.63, 0.66], [0.85, 0.1, 0.15]];

/** The colour of a load: -1 slack, 0 at rest, 1 under twice the load at rest, or more. */
export function loadColour(load) {
  const x = Math.max(-1, Math.min(1, load));
  // The root lets small differences show: a bent arm's tensions differ by a fifth.
  const s = Math.sqrt(Math.abs(x)), end = STOPS[x < 0 ? 0 : 2];
  const mixed = STOPS[1].map((grey, i) => Math.round(255 * (grey + s * (end[i] - grey))));
  return `rgb(${mixed.join(", ")})`;
}
