// A scene by itself: surfaces with their materials, classes and numbers.

import { classColour, materialColour } from "./colours.js";
import { data } from "./data.js";
import { el, number } from "./dom.js";
import { SceneView } from "./scene3d.js";

export class ThingView {
  constructor() {
    this.scene = new SceneView({ pick: (hit) => this.hit(hit) });
    this.details = el("div", { class: "details" });
    const count = (key) => data.scene.objects.reduce((m, o) => m.set(key(o), (m.get(key(o)) ?? 0) + 1), new Map());
    const row = (rgb, name, n) => el("li", {}, el("i", { style: `background:rgb(${rgb.join(",")})` }), `${name || "without a class"}: ${n}`);
    this.summary = [
      el("h2", {}, data.title),
      el("p", {}, `${data.scene.objects.length} objects, ${data.scene.meshes.length} meshes`),
      el("h3", {}, "classes"), el("ul", {}, [...count((o) => o.class)].map(([c, n]) => row(classColour(c), c, n))),
      el("h3", {}, "materials"), el("ul", {}, data.scene.materials.map((m) => el("li", {}, el("i", { style: `background:rgb(${materialColour(m, "").join(",")})` }), m))),
    ];
    this.element = el("main", { class: "thing" }, el("section", { class: "left" }, el("div", { class: "tools" }, el("button", { onclick: () => this.reset() }, "all")), this.scene.box), el("section", { class: "right" }, this.details));
  }

  async start() {
    this.scene.set(data.scene);
    this.scene.legend(SceneView.used(data.scene));
    this.reset();
    this.hit({});
  }

  reset() {
    const [lo, hi] = this.scene.bounds();
    const middle = lo.map((v, i) => 0.5 * (v + hi[i]));
    const size = Math.max(0.02, Math.hypot(...lo.map((v, i) => hi[i] - v)));
    if (this.scene.camera) {
      this.scene.camera.near = size / 1000;
      this.scene.camera.far = 20 * size;
      this.scene.camera.updateProjectionMatrix();
    }
    // From ahead, where the radar stands before a reflector that looks along +x.
    this.scene.look(middle, [middle[0] + 0.9 * size, middle[1] - 0.5 * size, middle[2] + 0.5 * size]);
  }

  hit(hit) {
    const o = hit.object;
    if (!o) return this.details.replaceChildren(...this.summary);
    this.details.replaceChildren(el("h2", {}, o.name || `object ${o.id}`), el("dl", { class: "facts" },
      [["number", o.id], ["class", o.class || "–"], ["material", data.scene.materials[hit.material] ?? "–"], ["place", `${hit.at.map((v) => number(v, 3)).join(", ")} m`]].flatMap(([k, v]) => [el("dt", {}, k), el("dd", {}, v)])),
      el("button", { onclick: () => this.hit({}) }, "back to all"));
  }

  key_press(e) {
    if (e.key === "r") this.reset();
    if (e.key === "Escape") this.hit({});
  }

  theme() {
    this.scene.theme();
  }
}
