// What a link holds: everything that the picture depends on, in words and millimetres.

const numbers = (text) => text.split(",").map(Number);
const written = (values, factor, digits) => values.map((v) => +(v * factor).toFixed(digits)).join(",");

/** The settings of a hash; what it does not name is missing. Impossible parts are left out. */
export function readHash(hash) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const state = {};
  for (const name of ["robot", "mode"]) if (given.has(name)) state[name] = given.get(name);
  for (const name of ["gravity", "beside", "again"]) {
    if (given.has(name)) state[name] = given.get(name) === "1";
  }
  const n = Number(given.get("n"));
  if (Number.isInteger(n) && n >= 3 && n <= 32) state.n = n;
  for (const [name, factor] of [["c", 1e-3], ["off", 1e-3], ["goal", 1e-3], ["view", 1]]) {
    if (!given.has(name)) continue;
    const values = numbers(given.get(name)).map((v) => v * factor);
    if (values.every(Number.isFinite)) state[name] = values;
  }
  return state;
}

/** The hash of a state. */
export function writeHash(state) {
  const parts = [`robot=${state.robot}`, `n=${state.n}`, `mode=${state.mode}`];
  for (const name of ["gravity", "beside", "again"]) if (state[name]) parts.push(`${name}=1`);
  parts.push(`c=${written(state.c, 1e3, 3)}`);
  if (state.off) parts.push(`off=${written(state.off, 1e3, 3)}`);
  parts.push(`goal=${written(state.goal, 1e3, 1)}`, `view=${written(state.view, 1, 1)}`);
  return `#${parts.join("&")}`;
}

/** Pictures to start from. */
export const PRESETS = [
  ["seven tendons", "#robot=default&n=7&mode=hand&c=8,4&goal=60,-50,170"],
  ["three tendons", "#robot=default&n=3&mode=hand&c=8,4&goal=60,-50,170"],
  ["the policy with 32 tendons", "#robot=default&n=32&mode=policy&again=1&c=0,0&goal=60,-50,170"],
  ["policy beside classical control", "#robot=default&n=11&mode=policy&beside=1&again=1&c=-10,3&goal=80,50,150"],
  ["one of five tendons pulled", "#robot=default&n=5&mode=hand&c=6.2,0&off=1.8,-1.456,0.556,0.556,-1.456&goal=60,-50,170"],
  ["gravity, and a slack tendon", "#robot=default&n=4&mode=hand&gravity=1&c=9,0&off=0.15,-0.15,0.15,-0.15&goal=60,-50,170"],
  ["two segments of six", "#robot=default2&n=6&mode=classical&again=1&c=6,0,2,8&goal=150,60,250"],
  ["three segments", "#robot=default3&n=4&mode=hand&c=8,2,4,6,9,9&goal=150,60,250"],
  ["soft arm", "#robot=soft_arm&n=4&mode=hand&c=-12,8&goal=120,-90,330"],
  ["three segments as on the bench", "#robot=hardware&n=3&mode=classical&again=1&c=2,0,3,2,1,4&goal=60,40,140"],
];
