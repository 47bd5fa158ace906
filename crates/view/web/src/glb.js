// The triangles of a binary glTF that the program's physics made, by material. It has no more than such files need: plain float32 places.

import { Matrix4, Quaternion, Vector3 } from "three";

const WIDTH = { 5121: [Uint8Array, 1], 5123: [Uint16Array, 2], 5125: [Uint32Array, 4], 5126: [Float32Array, 4] };
const PARTS = { SCALAR: 1, VEC3: 3 };

/** Corners of all triangles in the radar's axes (x ahead, y left, z up; glTF has z, x, y for them), one list for each material's name. */
export function triangles_of(glb) {
  const view = new DataView(glb.buffer, glb.byteOffset, glb.byteLength);
  const length = view.getUint32(12, true);
  const text = new TextDecoder().decode(glb.subarray(20, 20 + length));
  const json = JSON.parse(text), data = 20 + length + 8;
  const values = (index) => {
    const a = json.accessors[index], b = json.bufferViews[a.bufferView], [Type, width] = WIDTH[a.componentType], n = a.count * PARTS[a.type];
    const from = glb.byteOffset + data + (b.byteOffset ?? 0) + (a.byteOffset ?? 0);
    return new Type(glb.buffer.slice(from, from + n * width));
  };
  const lists = new Map();
  const place = new Vector3();
  const visit = (index, above) => {
    const node = json.nodes[index];
    const own = node.matrix ? new Matrix4().fromArray(node.matrix) : new Matrix4().compose(new Vector3(...(node.translation ?? [0, 0, 0])), new Quaternion(...(node.rotation ?? [0, 0, 0, 1])), new Vector3(...(node.scale ?? [1, 1, 1])));
    const whole = above.clone().multiply(own);
    for (const p of node.mesh == null ? [] : json.meshes[node.mesh].primitives) {
      const at = values(p.attributes.POSITION), name = json.materials?.[p.material]?.name ?? "";
      const corners = p.indices == null ? Array.from({ length: at.length / 3 }, (_, i) => i) : values(p.indices);
      if (!lists.has(name)) lists.set(name, []);
      for (const i of corners) {
        place.fromArray(at, 3 * i).applyMatrix4(whole);
        lists.get(name).push(place.z, place.x, place.y);
      }
    }
    for (const child of node.children ?? []) visit(child, whole);
  };
  for (const root of json.scenes[json.scene ?? 0].nodes) visit(root, new Matrix4());
  return [...lists].map(([material, corners]) => ({ material, corners: Float32Array.from(corners) }));
}
