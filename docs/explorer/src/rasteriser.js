// Who draws the scene: the graphics card through WebGL or, where WebGL is missing or itself done in
// software, the painter, which is several times as fast there.

import { WebGLRenderer } from "../vendor/three.min.js";
import { Painter } from "./painter.js";

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** "webgl" where a graphics card stands behind it, else "canvas". */
function suited() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return "canvas";
  // Some browsers tell the name only through the extension, others tell it without.
  const named = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name) ? "canvas" : "webgl";
}

/** The rasteriser of a canvas: the one asked for, "webgl" or "canvas", or the one that suits. */
export function makeRasteriser(canvas, asked) {
  const kind = ["webgl", "canvas"].includes(asked) ? asked : suited();
  canvas.dataset.drawn = kind;
  return kind === "webgl" ? new WebGLRenderer({ canvas, antialias: true }) : new Painter(canvas);
}
