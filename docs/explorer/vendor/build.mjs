// Builds the two libraries of the explorer from npm: run `make explorer-vendor`.
// three.min.js is what the pictures use of three.js; MuJoCo's WebAssembly is packed, unpacked by
// the browser when "gravity and slack" is chosen for the first time.
import { build } from "esbuild";
import { gzipSync } from "node:zlib";
import { readFileSync, writeFileSync } from "node:fs";

const banner = (name) => {
  const { version, license } = JSON.parse(readFileSync(`node_modules/${name}/package.json`));
  return { js: `/* ${name} ${version}, ${license ?? "Apache-2.0"}; see LICENSES.md */` };
};
const common = { bundle: true, minify: true, format: "esm", legalComments: "none", target: "es2022" };
await build({ ...common, entryPoints: ["three.entry.js"], outfile: "three.min.js", banner: banner("three") });
await build({
  ...common,
  entryPoints: ["node_modules/@mujoco/mujoco/mujoco.js"],
  outfile: "mujoco.min.js",
  platform: "browser",
  external: ["module", "node:*", "fs", "path", "url", "crypto", "worker_threads"],
  banner: banner("@mujoco/mujoco"),
});
writeFileSync("mujoco.wasm.gz", gzipSync(readFileSync("node_modules/@mujoco/mujoco/mujoco.wasm"), { level: 9 }));
