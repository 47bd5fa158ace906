// The scene as the radar sees it: surfaces, vehicles, points and the ways of echoes. Axes are x ahead, y left, z up, in metres.

import {
  AmbientLight, BufferAttribute, BufferGeometry, CanvasTexture, Color, DirectionalLight, DoubleSide, EdgesGeometry, BoxGeometry, Group, Line,
  LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshLambertMaterial, NearestFilter, PerspectiveCamera, PlaneGeometry, Points, PointsMaterial, Quaternion,
  Raycaster, Scene, SphereGeometry, SRGBColorSpace, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { classColour, materialColour } from "./colours.js";
import { numbers } from "./data.js";
import { colour, el } from "./dom.js";

const paint = ([r, g, b]) => new Color(`rgb(${r},${g},${b})`);
/** Colours of lane lines: what is true, and what a method found. */
export const TRUTH = [240, 228, 66], ESTIMATE = [213, 94, 0];
const FLAT = new Set(["road", "verge", "ground", "terrain", "lane_line"]);

/** A round dot for points, which are no squares then. Its colours multiply those of the points: the rim keeps pale ones apart from a pale sky. */
function dot() {
  const c = document.createElement("canvas");
  c.width = c.height = 64;
  const g = c.getContext("2d");
  for (const [colour, radius] of [["#666", 30], ["#fff", 23]]) {
    g.fillStyle = colour;
    g.beginPath();
    g.arc(32, 32, radius, 0, 2 * Math.PI);
    g.fill();
  }
  return new CanvasTexture(c);
}

export class SceneView {
  constructor({ pick }) {
    this.box = el("div", { class: "scene", tabIndex: 0 });
    this.pick = pick;
    this.key = el("div", { class: "materials", hidden: true });
    this.box.append(this.key);
    try {
      this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    } catch {
      this.box.append(el("p", { class: "missing" }, "The browser gives no WebGL, so the scene is not drawn. Maps, plots and tables are all there."));
      return;
    }
    this.box.append(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(50, 1, 0.1, 5000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new AmbientLight(0xffffff, 1.6));
    const sun = new DirectionalLight(0xffffff, 1.8);
    sun.position.set(-30, 40, 80);
    this.scene.add(sun);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.maxPolarAngle = 0.499 * Math.PI;
    this.layers = Object.fromEntries(["bodies", "boxes", "mask", "lanes", "estimates", "field", "ego", "tracks", "points", "chosen", "paths"].map((n) => [n, new Group()]));
    this.scene.add(...Object.values(this.layers));
    this.texture = dot();
    new ResizeObserver(() => this.size()).observe(this.box);
    const canvas = this.renderer.domElement;
    canvas.addEventListener("pointerdown", (e) => (this.down = [e.clientX, e.clientY]));
    canvas.addEventListener("pointerup", (e) => {
      if (this.down && Math.hypot(e.clientX - this.down[0], e.clientY - this.down[1]) < 4) this.click(e);
    });
    this.theme();
  }

  theme() {
    if (!this.renderer) return;
    this.scene.background = new Color(colour("sky"));
    this.draw();
  }

  size() {
    const { clientWidth: w, clientHeight: h } = this.box;
    if (!w || !h || !this.renderer) return;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draws once in the next picture of the browser, however often it is asked for. */
  draw() {
    if (!this.renderer || this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.renderer.render(this.scene, this.camera);
      this.drawn = (this.drawn ?? 0) + 1;
    });
  }

  /** Meshes and objects of the whole page. */
  set(scene) {
    if (!this.renderer || !scene) return;
    const geometries = scene.meshes.map((m) => {
      const g = new BufferGeometry();
      g.setAttribute("position", new BufferAttribute(numbers(m.positions), 3));
      g.setIndex(new BufferAttribute(numbers(m.triangles), 1));
      let start = 0;
      m.materials.forEach(([material, n]) => {
        g.addGroup(3 * start, 3 * n, material);
        start += n;
      });
      return g;
    });
    this.bodies = scene.objects.map((o) => {
      const poses = numbers(o.poses);
      let body;
      if ("mesh" in o.shape) {
        const materials = scene.materials.map((name) => new MeshLambertMaterial({
          color: paint(materialColour(name, o.class)), side: DoubleSide, flatShading: true,
          transparent: !o.radar, opacity: o.radar ? 1 : 0.35, polygonOffset: FLAT.has(o.class), polygonOffsetFactor: 1, polygonOffsetUnits: 1,
        }));
        body = new Mesh(geometries[o.shape.mesh], materials.length ? materials : new MeshLambertMaterial());
      } else {
        body = new Mesh(new SphereGeometry(0.15, 12, 8), new MeshLambertMaterial({ color: paint(classColour(o.class)) }));
      }
      body.userData = o;
      this.layers.bodies.add(body);
      return { body, poses, many: poses.length > 7 };
    });
    this.move(0);
  }

  /** Triangles of one body in place of all bodies: lists of corners, three numbers each, with the names of their materials. */
  triangles(parts) {
    this.legend(parts.map((p) => p.material));
    if (!this.renderer) return;
    this.clear("bodies");
    this.bodies = parts.map(({ corners, material }) => {
      const g = new BufferGeometry();
      g.setAttribute("position", new BufferAttribute(corners, 3));
      const body = new Mesh(g, new MeshLambertMaterial({ color: paint(materialColour(material, "")), side: DoubleSide, flatShading: true }));
      body.userData = { material };
      this.layers.bodies.add(body);
      return { body, poses: new Float32Array([0, 0, 0, 0, 0, 0, 1]), many: false };
    });
    const { size } = this.extent();
    Object.assign(this.camera, { near: size / 1000, far: 30 * size });
    this.camera.updateProjectionMatrix();
    this.controls.maxPolarAngle = Math.PI;
    this.draw();
  }

  /** The materials that are drawn, each with its colour. */
  legend(names) {
    this.key.hidden = !names.length;
    this.key.replaceChildren(...[...new Set(names)].map((n) => el("span", {}, el("i", { style: `background:rgb(${materialColour(n, "").join(",")})` }), n || "without a material")));
  }

  /** Names of the materials that a scene's objects have; those of a ground are not told by colour. */
  static used(scene) {
    const found = scene.objects.flatMap((o) => ("mesh" in o.shape && !FLAT.has(o.class) ? scene.meshes[o.shape.mesh].materials.map(([m]) => m) : []));
    return [...new Set(found)].sort((a, b) => a - b).map((m) => scene.materials[m] ?? "");
  }

  /** Middle and length of the diagonal of all that stands in the scene. */
  extent() {
    const [lo, hi] = this.bounds();
    return { middle: lo.map((v, i) => 0.5 * (v + hi[i])), size: Math.max(0.005, Math.hypot(...lo.map((v, i) => hi[i] - v))) };
  }

  /** Puts the bodies where they are in frame `index`. */
  move(index) {
    for (const { body, poses, many } of this.bodies ?? []) {
      const p = poses.subarray(many ? 7 * index : 0);
      body.position.set(p[0], p[1], p[2]);
      body.quaternion.set(p[3], p[4], p[5], p[6]);
    }
    this.draw();
  }

  clear(layer) {
    for (const child of [...this.layers[layer].children]) {
      child.geometry?.dispose();
      this.layers[layer].remove(child);
    }
  }

  /** Boxes in place of a scene that is not there. */
  boxes(list) {
    if (!this.renderer) return;
    this.clear("boxes");
    for (const b of list ?? []) {
      const [sx, sy, sz] = b.size.map((s) => Math.max(0.02, s));
      const ground = FLAT.has(b.class);
      const body = ground
        ? new Mesh(new BoxGeometry(sx, sy, sz), new MeshLambertMaterial({ color: paint(materialColour("asphalt", b.class)) }))
        : new LineSegments(new EdgesGeometry(new BoxGeometry(sx, sy, sz)), new LineBasicMaterial({ color: paint(classColour(b.class)) }));
      body.position.set(...b.pose.slice(0, 3));
      body.quaternion.set(...b.pose.slice(3));
      body.userData = b;
      this.layers.boxes.add(body);
    }
    this.draw();
  }

  line(layer, positions, rgb, options = {}) {
    const g = new BufferGeometry();
    g.setAttribute("position", new BufferAttribute(Float32Array.from(positions), 3));
    this.layers[layer].add(new Line(g, new LineBasicMaterial({ color: paint(rgb), transparent: true, opacity: options.opacity ?? 0.9 })));
  }

  lanes(list) {
    if (!this.renderer) return;
    this.clear("lanes");
    for (const lane of list ?? []) {
      for (const side of ["left", "right"]) {
        const p = Float32Array.from(numbers(lane[side]));
        for (let i = 2; i < p.length; i += 3) p[i] += 0.03;
        this.line("lanes", p, TRUTH);
      }
    }
  }

  /** Lines that a method found, broad and in another colour than the truth; those of which it is less sure are fainter. */
  estimates(list) {
    if (!this.renderer) return;
    this.clear("estimates");
    for (const { points, confidence } of list ?? []) {
      const g = new LineGeometry();
      g.setPositions(numbers(points));
      const m = new LineMaterial({ color: paint(ESTIMATE), linewidth: 3, transparent: true, opacity: 0.35 + 0.6 * Math.min(1, Math.max(0, confidence)) });
      m.resolution.set(this.box.clientWidth, this.box.clientHeight);
      const line = new Line2(g, m);
      line.renderOrder = 3;
      this.layers.estimates.add(line);
    }
    this.draw();
  }

  /** The ego vehicle's outline and each radar's field of view, at their poses. */
  sensors(ego, radars) {
    if (!this.renderer) return;
    this.clear("ego");
    this.clear("field");
    if (ego) {
      const box = new LineSegments(new EdgesGeometry(new BoxGeometry(4.5, 1.8, 1.4)), new LineBasicMaterial({ color: paint([86, 180, 233]) }));
      const turn = new Quaternion(...ego.slice(3));
      box.position.copy(new Vector3(1.35, 0, 0.8).applyQuaternion(turn)).add(new Vector3(...ego.slice(0, 3)));
      box.quaternion.copy(turn);
      this.layers.ego.add(box);
    }
    for (const { pose, halfAngle, range } of radars) {
      if (!pose) continue;
      const turn = new Quaternion(...pose.slice(3)), at = new Vector3(...pose.slice(0, 3));
      const points = [at.clone()];
      for (let k = -24; k <= 24; k++) {
        const a = (k / 24) * halfAngle;
        points.push(new Vector3(range * Math.cos(a), range * Math.sin(a), 0).applyQuaternion(turn).add(at));
      }
      points.push(at.clone());
      this.line("field", points.flatMap((p) => p.toArray()), [86, 180, 233], { opacity: 0.5 });
    }
  }

  /** The classes of cells before a radar, on the ground: rows go ahead, columns from the left. */
  mask(mask, pose, colours) {
    if (!this.renderer) return;
    this.clear("mask");
    if (!mask) return;
    const { rows, columns, ahead_m, across_m, classes } = mask;
    const picture = document.createElement("canvas");
    picture.width = columns;
    picture.height = rows;
    const image = new ImageData(columns, rows);
    classes.forEach((c, i) => colours[c] && image.data.set([...colours[c], 150], 4 * ((rows - 1 - Math.floor(i / columns)) * columns + (i % columns))));
    picture.getContext("2d").putImageData(image, 0, 0);
    const texture = new CanvasTexture(picture);
    texture.magFilter = NearestFilter;
    texture.colorSpace = SRGBColorSpace;
    const sheet = new Mesh(new PlaneGeometry(across_m, ahead_m), new MeshBasicMaterial({ map: texture, transparent: true, depthWrite: false, side: DoubleSide }));
    // Its picture's right is the radar's right, and up is ahead.
    const turn = new Quaternion(...pose.slice(3)), ahead = new Vector3(1, 0, 0).applyQuaternion(turn);
    const yaw = Math.atan2(ahead.y, ahead.x);
    sheet.rotation.z = yaw - Math.PI / 2;
    sheet.position.set(pose[0] + 0.5 * ahead_m * Math.cos(yaw), pose[1] + 0.5 * ahead_m * Math.sin(yaw), 0.02);
    this.layers.mask.add(sheet);
    this.draw();
  }

  /** Tracks as dots with arrows of a second's way. */
  tracks(list) {
    if (!this.renderer) return;
    this.clear("tracks");
    for (const t of list) {
      this.line("tracks", [t.x, t.y, 0.8, t.x + t.vx, t.y + t.vy, 0.8], [204, 121, 167]);
      const ring = [];
      for (let k = 0; k <= 24; k++) ring.push(t.x + 0.9 * Math.cos((k * Math.PI) / 12), t.y + 0.9 * Math.sin((k * Math.PI) / 12), 0.8);
      this.line("tracks", ring, [204, 121, 167]);
    }
    this.draw();
  }

  /** Points: positions in the world and colours, three numbers each, colours from 0 to 1. */
  points(positions, colours) {
    if (!this.renderer) return;
    this.clear("points");
    this.places = positions;
    if (positions.length) {
      const g = new BufferGeometry();
      g.setAttribute("position", new BufferAttribute(positions, 3));
      g.setAttribute("color", new BufferAttribute(colours, 3));
      const material = new PointsMaterial({ size: positions.length > 15000 ? 4 : 9, sizeAttenuation: false, vertexColors: true, map: this.texture, alphaTest: 0.5, depthTest: false, transparent: true });
      const cloud = new Points(g, material);
      cloud.renderOrder = 5;
      this.layers.points.add(cloud);
    }
    this.draw();
  }

  /** Stresses a place, with an ellipsoid of three standard deviations along `axes`. */
  choose(at, axes, lengths) {
    if (!this.renderer) return;
    this.clear("chosen");
    this.clear("paths");
    if (at) {
      const g = new BufferGeometry();
      g.setAttribute("position", new BufferAttribute(Float32Array.from(at), 3));
      const ring = new Points(g, new PointsMaterial({ size: 18, sizeAttenuation: false, color: 0xff2d55, map: this.texture, alphaTest: 0.5, depthTest: false, transparent: true, opacity: 0.85 }));
      ring.renderOrder = 4;
      this.layers.chosen.add(ring);
      if (axes) {
        const ball = new Mesh(new SphereGeometry(1, 16, 10), new MeshBasicMaterial({ color: 0xff2d55, wireframe: true, transparent: true, opacity: 0.45 }));
        ball.matrixAutoUpdate = false;
        ball.matrix.set(
          axes[0].x * lengths[0], axes[1].x * lengths[1], axes[2].x * lengths[2], at[0],
          axes[0].y * lengths[0], axes[1].y * lengths[1], axes[2].y * lengths[2], at[1],
          axes[0].z * lengths[0], axes[1].z * lengths[1], axes[2].z * lengths[2], at[2],
          0, 0, 0, 1);
        this.layers.chosen.add(ball);
      }
    }
    this.draw();
  }

  /** Ways of echoes: lists of places in the world, closed at the radar; `known` is false where a middle is not known. */
  paths(list, stressed) {
    if (!this.renderer) return;
    this.clear("paths");
    list.forEach((path, k) => {
      const g = new LineGeometry();
      g.setPositions(path.places.flat());
      const on = stressed == null || stressed === k;
      const m = new LineMaterial({ color: paint(path.rgb), linewidth: on ? 3 : 1, dashed: !path.known, dashSize: 0.6, gapSize: 0.4, depthTest: false, transparent: true, opacity: on ? 0.95 : 0.3 });
      m.resolution.set(this.box.clientWidth, this.box.clientHeight);
      const line = new Line2(g, m);
      line.computeLineDistances();
      line.renderOrder = 6;
      this.layers.paths.add(line);
    });
    this.draw();
  }

  look(at, from) {
    if (!this.renderer) return;
    this.controls.target.set(...at);
    this.camera.position.set(...from);
    this.controls.update();
    this.draw();
  }

  /** Moves the view as a body moves from one pose to another, turns about the vertical with it. */
  along(from, to) {
    if (!this.renderer) return;
    const yaw = (p) => { const x = new Vector3(1, 0, 0).applyQuaternion(new Quaternion(...p.slice(3))); return Math.atan2(x.y, x.x); };
    const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), yaw(to) - yaw(from));
    const [a, b] = [new Vector3(...from.slice(0, 3)), new Vector3(...to.slice(0, 3))];
    for (const v of [this.controls.target, this.camera.position]) v.sub(a).applyQuaternion(turn).add(b);
    this.controls.update();
  }

  /** Corners of all that stands in the scene. */
  bounds() {
    let lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
    for (const { body } of this.bodies ?? []) {
      body.updateMatrixWorld();
      const g = body.geometry;
      g.computeBoundingBox();
      for (const x of ["min", "max"]) for (const y of ["min", "max"]) for (const z of ["min", "max"]) {
        const v = new Vector3(g.boundingBox[x].x, g.boundingBox[y].y, g.boundingBox[z].z).applyMatrix4(body.matrixWorld).toArray();
        lo = lo.map((a, i) => Math.min(a, v[i]));
        hi = hi.map((a, i) => Math.max(a, v[i]));
      }
    }
    return lo[0] <= hi[0] ? [lo, hi] : [[-1, -1, 0], [1, 1, 1]];
  }

  /** Where a place of the world is on the screen, in CSS pixels of the box. */
  project(p) {
    const v = new Vector3(...p).project(this.camera);
    return [((v.x + 1) / 2) * this.box.clientWidth, ((1 - v.y) / 2) * this.box.clientHeight, v.z];
  }

  click(e) {
    const box = this.box.getBoundingClientRect();
    const [x, y] = [e.clientX - box.left, e.clientY - box.top];
    let best = -1, least = 12;
    const v = new Vector3();
    for (let i = 0; i < (this.places?.length ?? 0) / 3; i++) {
      v.fromArray(this.places, 3 * i).project(this.camera);
      if (v.z > 1) continue;
      const d = Math.hypot(((v.x + 1) / 2) * box.width - x, ((1 - v.y) / 2) * box.height - y);
      if (d < least) [best, least] = [i, d];
    }
    if (best >= 0) return this.pick({ point: best });
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * x) / box.width - 1, 1 - (2 * y) / box.height), this.camera);
    const hit = ray.intersectObjects([...this.layers.bodies.children, ...this.layers.boxes.children], false)[0];
    this.pick(hit ? { object: hit.object.userData, material: hit.face?.materialIndex, at: hit.point.toArray() } : {});
  }

  show(layer, on) {
    if (!this.renderer) return;
    this.layers[layer].visible = on;
    this.draw();
  }
}

/** Axes of a radar's coordinates at a direction: along, to the left, up; turned by the radar's pose. */
export function lookAxes(azimuth, elevation, pose) {
  const turn = new Quaternion(...pose.slice(3));
  const along = new Vector3(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation));
  const left = new Vector3(-Math.sin(azimuth), Math.cos(azimuth), 0);
  return [along, left, along.clone().cross(left)].map((v) => v.applyQuaternion(turn));
}

/** A function from the radar's frame to the world. */
export function toWorld(pose) {
  const turn = new Quaternion(...pose.slice(3)), at = new Vector3(...pose.slice(0, 3));
  return (x, y, z) => new Vector3(x, y, z).applyQuaternion(turn).add(at).toArray();
}
