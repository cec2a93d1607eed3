// The light of three.js's scene on matt surfaces, for the painter: Lambert's law.

import { Color, Vector3 } from "../vendor/three.min.js";

// From linear light to what a screen is sent, looked up: powers are slow. In steps of 3, which no
// eye sees, so that the browser meets the same styles again and need not parse them.
const STEPS = 1023;
const SCREEN = Uint8Array.from({ length: STEPS + 1 }, (_, i) =>
  3 * Math.round(new Color(i / STEPS, 0, 0).convertLinearToSRGB().r * 85));

/** The style of a colour in linear light. */
function style(r, g, b) {
  const sent = (v) => SCREEN[v >= 1 ? STEPS : (v * STEPS + 0.5) | 0];
  return `rgb(${sent(r)},${sent(g)},${sent(b)})`;
}

export class Light {
  /** The lights of a scene, seen by a camera: all directions are the camera's. */
  constructor(scene, camera) {
    this.skies = [];
    this.suns = [];
    scene.traverse((light) => {
      if (!light.isLight) return;
      const towards = new Vector3().setFromMatrixPosition(light.matrixWorld)
        .transformDirection(camera.matrixWorldInverse);
      (light.isHemisphereLight ? this.skies : this.suns).push({ light, towards });
    });
  }

  /** The direction that is lit most. */
  get brightest() {
    return this.suns[0].towards;
  }

  /** The style of a material's colour, where its surface looks along (x, y, z) if it takes light. */
  on(material, color, x, y, z) {
    if (!material.isMeshStandardMaterial) return color.getStyle();
    let r = 0, g = 0, b = 0;
    for (const { light: { color: sky, groundColor, intensity }, towards } of this.skies) {
      const share = 0.5 + 0.5 * (towards.x * x + towards.y * y + towards.z * z);
      r += intensity * (groundColor.r + share * (sky.r - groundColor.r));
      g += intensity * (groundColor.g + share * (sky.g - groundColor.g));
      b += intensity * (groundColor.b + share * (sky.b - groundColor.b));
    }
    for (const { light: { color: sun, intensity }, towards } of this.suns) {
      const share = intensity * Math.max(0, towards.x * x + towards.y * y + towards.z * z);
      r += share * sun.r;
      g += share * sun.g;
      b += share * sun.b;
    }
    return style((r * color.r) / Math.PI, (g * color.g) / Math.PI, (b * color.b) / Math.PI);
  }
}
