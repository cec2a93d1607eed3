// MuJoCo in WebAssembly against the native simulator: 200 control steps, taut and slack.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { gunzipSync } from "node:zlib";

import { Mujoco } from "../../docs/explorer/src/mujoco.js";
import { makeRobot } from "../../docs/explorer/src/robot.js";

const vendor = new URL("../../docs/explorer/vendor/", import.meta.url);
const read = (path) => JSON.parse(readFileSync(new URL(path, import.meta.url)));
const golden = read("golden.json");
const robots = read("../../docs/explorer/data/robots.json");
const { default: load } = await import(new URL("mujoco.min.js", vendor));
const mujoco = await load({ wasmBinary: gunzipSync(readFileSync(new URL("mujoco.wasm.gz", vendor))) });

for (const { robot: key, n, slack, steps } of golden.simulations) {
  const name = `${key} with ${n} tendons, ${slack ? "some slack" : "taut"}, ${steps.length} steps`;
  test(`${name}: joint angles within 1e-6 rad of native MuJoCo`, () => {
    const robot = makeRobot(robots[key], n);
    const physics = new Mujoco(mujoco, robot, robots[key].mjcf, golden.control_dt);
    let worst = 0, wentSlack = 0, compared = 0;
    for (const { command, qpos, tip, tension } of steps) {
      physics.step(command);
      wentSlack += physics.wentSlack;
      if (!qpos) continue;
      compared += 1;
      qpos.forEach((q, i) => { worst = Math.max(worst, Math.abs(q - physics.qpos[i])); });
      tip.forEach((t, i) => assert.ok(Math.abs(t - physics.tip[i]) < 1e-6, "tip"));
      const pulls = physics.tension.flat();
      tension.forEach((t, i) => assert.ok(Math.abs(t - pulls[i]) < 0.01, `tension ${t} ${pulls[i]}`));
    }
    physics.free();
    assert.equal(compared, steps.length / 20);
    assert.equal(wentSlack > 0, slack, `${wentSlack} steps with slack tendons`);
    assert.ok(worst < 1e-6, `${worst} rad`);
    console.log(`# ${name}: ${worst.toExponential(1)} rad, ${wentSlack} steps slack`);
  });
}
