// One view of an instant: bodies by mode and colour, arrows of contact forces, scale bar, colour bar.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Body, Field, Instant } from "./frames";
import { kPlain, lengthText, roundBelow, shortNumber, viridis } from "./colours";

export type Mode = "normal" | "wire" | "transparent" | "xray";
export interface BodyLook {
  shown: boolean;
  mode: Mode | "";
}

export interface Look {
  mode: Mode;
  bodies: Map<string, BodyLook>;
  field: string; // "" for plain
  arrows: boolean;
  range: [number, number] | null; // of the field; null: of what is seen
}

export interface Camera {
  position: THREE.Vector3;
  target: THREE.Vector3;
  up: THREE.Vector3;
  zoom: number;
}

export const kPresets: Record<string, [number, number, number]> = {
  Isometric: [1, -1.4, 0.9],
  "+x": [1, 0, 0],
  "-x": [-1, 0, 0],
  "+y": [0, 1, 0],
  "-y": [0, -1, 0],
  "+z": [0, 0, 1],
  "-z": [0, 0, -1],
};

interface Drawn {
  edges: THREE.LineSegments; // where a surface has a corner: shape without shades, which would change colours
  body: Body;
  mesh: THREE.Mesh<THREE.BufferGeometry, THREE.Material>;
  geometry: THREE.BufferGeometry;
  triangles: Uint32Array;
}

const kSharp = Math.cos((30 * Math.PI) / 180); // neighbours that turn by more have an edge between them

/** Colours as the light of the screen is added up. */
const linear = (c: readonly number[]) => c.map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
const kMap = Array.from({ length: 1024 }, (_, i) => linear(viridis(i / 1023)));
const kLinearPlain = kPlain.map(linear);
const kWire = linear([0.16, 0.2, 0.28]);

/** Pairs of points along edges with a corner, and along open borders. */
function sharpEdges(points: Float32Array, triangles: Uint32Array): number[] {
  const count = triangles.length / 3;
  const normals = new Float32Array(3 * count);
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  for (let t = 0; t < count; ++t) {
    [a, b, c].forEach((v, k) => v.fromArray(points, 3 * triangles[3 * t + k]));
    b.sub(a).cross(c.sub(a)).normalize().toArray(normals, 3 * t);
  }
  const n = points.length / 3;
  const seen = new Map<number, number>();
  const out: number[] = [];
  for (let t = 0; t < count; ++t)
    for (let k = 0; k < 3; ++k) {
      const i = triangles[3 * t + k];
      const j = triangles[3 * t + ((k + 1) % 3)];
      const key = Math.min(i, j) * n + Math.max(i, j);
      const other = seen.get(key);
      if (other === undefined) {
        seen.set(key, t);
        continue;
      }
      seen.delete(key);
      const dot =
        normals[3 * t] * normals[3 * other] +
        normals[3 * t + 1] * normals[3 * other + 1] +
        normals[3 * t + 2] * normals[3 * other + 2];
      if (dot < kSharp) out.push(i, j);
    }
  for (const key of seen.keys()) out.push(Math.floor(key / n), key % n);
  return out;
}

const kSides = 12; // of a wire's tube
const kAttenuation = 1.2; // of a solid as thick as a third of the scene, and of a wire along its diameter

/** Triangles with the outside where their corners run against the clock; an open surface stays as it is nearly. */
function outwards(points: Float32Array, triangles: Uint32Array): Uint32Array {
  const at = (i: number, k: number) => points[3 * triangles[i] + k] - points[k];
  let volume = 0;
  for (let i = 0; i < triangles.length; i += 3)
    volume +=
      at(i, 0) * (at(i + 1, 1) * at(i + 2, 2) - at(i + 1, 2) * at(i + 2, 1)) +
      at(i, 1) * (at(i + 1, 2) * at(i + 2, 0) - at(i + 1, 0) * at(i + 2, 2)) +
      at(i, 2) * (at(i + 1, 0) * at(i + 2, 1) - at(i + 1, 1) * at(i + 2, 0));
  if (volume >= 0) return triangles;
  const out = triangles.slice();
  for (let i = 0; i < out.length; i += 3) [out[i + 1], out[i + 2]] = [out[i + 2], out[i + 1]];
  return out;
}

/** A wire as a closed tube around its middle line. */
function tube(line: Float32Array, radius: Float32Array | undefined, thinnest: number) {
  const n = line.length / 3;
  const points = new Float32Array(3 * (n * kSides + 2));
  const at = (i: number) => new THREE.Vector3(line[3 * i], line[3 * i + 1], line[3 * i + 2]);
  let normal = new THREE.Vector3(0, 0, 1);
  for (let i = 0; i < n; ++i) {
    const along = at(Math.min(n - 1, i + 1)).sub(at(Math.max(0, i - 1))).normalize();
    if (i === 0 && Math.abs(along.z) > 0.9) normal.set(1, 0, 0);
    normal = normal.sub(along.clone().multiplyScalar(normal.dot(along))).normalize(); // no twist of its own
    const side = along.clone().cross(normal);
    const r = Math.max(thinnest, radius?.[i] ?? 0);
    for (let k = 0; k < kSides; ++k) {
      const a = (2 * Math.PI * k) / kSides;
      for (let c = 0; c < 3; ++c)
        points[3 * (i * kSides + k) + c] =
          line[3 * i + c] + r * (Math.cos(a) * normal.getComponent(c) + Math.sin(a) * side.getComponent(c));
    }
  }
  const caps = n * kSides;
  for (let c = 0; c < 3; ++c) {
    points[3 * caps + c] = line[c];
    points[3 * caps + 3 + c] = line[3 * (n - 1) + c];
  }
  const out: number[] = [];
  for (let k = 0; k < kSides; ++k) {
    const next = (k + 1) % kSides;
    for (let i = 0; i + 1 < n; ++i) {
      const a = i * kSides;
      out.push(a + k, a + next, a + kSides + k, a + next, a + kSides + next, a + kSides + k);
    }
    out.push(caps, next, k, caps + 1, (n - 1) * kSides + k, (n - 1) * kSides + next);
  }
  return { points, triangles: Uint32Array.from(out) };
}

export class View {
  readonly canvas = document.createElement("canvas");
  readonly overlay = document.createElement("canvas");
  readonly element = document.createElement("div");
  readonly camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1000, 1000);
  onCamera: (() => void) | null = null;
  partner: View | null = null; // compared with this one: the same colours and arrows mean the same
  frames = 0;
  cost = 0; // of a drawing, until the browser is ready for the next one [ms]
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly thick = new THREE.Scene(); // of the X-ray view: path lengths are added up
  private readonly controls: OrbitControls;
  private readonly drawn = new Map<string, Drawn>();
  private readonly light = new THREE.DirectionalLight(0xffffff, 1.3);
  private readonly shafts: THREE.InstancedMesh;
  private readonly heads: THREE.InstancedMesh;
  private readonly ghosts: THREE.InstancedMesh[] = []; // of arrows that bodies hide
  private picked: THREE.Mesh | null = null;
  private instant: Instant | null = null;
  private waiting = false;
  private centre = new THREE.Vector3();
  private size = 1;
  private box = new THREE.Box3();
  private longest = 0;
  private bar: { name: string; unit: string; range: [number, number] } | null = null;
  private target: THREE.WebGLRenderTarget | null = null;
  private readonly film: THREE.Mesh<THREE.PlaneGeometry, THREE.ShaderMaterial>;
  private readonly filmScene = new THREE.Scene();
  private readonly path: THREE.ShaderMaterial;
  private readonly wirePath: THREE.ShaderMaterial; // metal: seen in whatever it stands

  constructor(label: string, private readonly look: Look) {
    this.element.className = "view";
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.overlay.className = "overlay";
    this.overlay.setAttribute("aria-hidden", "true");
    this.element.append(this.canvas, this.overlay);
    this.renderer = new THREE.WebGLRenderer({
      canvas: this.canvas,
      antialias: true,
      preserveDrawingBuffer: true, // pictures are taken from it
    });
    this.renderer.setClearColor(0xffffff);
    this.renderer.autoClear = false;
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b0b8, 1.7), this.light);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => {
      this.draw();
      this.onCamera?.();
    });
    const dark = new THREE.MeshLambertMaterial({ color: 0xc1440e });
    this.shafts = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0), dark, 4096);
    this.heads = new THREE.InstancedMesh(new THREE.ConeGeometry(1, 1, 14).translate(0, -0.5, 0), dark, 4096);
    for (const m of [this.shafts, this.heads]) {
      m.frustumCulled = false;
      m.count = 0;
      this.scene.add(m);
    }
    const faint = new THREE.MeshBasicMaterial({ color: 0xc1440e, transparent: true, opacity: 0.22, depthTest: false, depthWrite: false });
    for (const m of [this.shafts, this.heads]) {
      const ghost = new THREE.InstancedMesh(m.geometry, faint, 4096);
      ghost.instanceMatrix = m.instanceMatrix;
      ghost.frustumCulled = false;
      ghost.renderOrder = 3;
      ghost.count = 0;
      this.ghosts.push(ghost);
      this.scene.add(ghost);
    }
    this.path = new THREE.ShaderMaterial({
      side: THREE.DoubleSide,
      depthTest: false,
      depthWrite: false,
      transparent: true,
      blending: THREE.CustomBlending,
      blendEquation: THREE.AddEquation,
      blendSrc: THREE.OneFactor,
      blendDst: THREE.OneFactor,
      uniforms: { size: { value: 1 } },
      vertexShader: `varying float depth; uniform float size;
        void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); depth = -p.z / size; gl_Position = projectionMatrix * p; }`,
      fragmentShader: `varying float depth;
        void main() { gl_FragColor = vec4(gl_FrontFacing ? -depth : depth, 0.0, 0.0, 1.0); }`,
    });
    this.wirePath = this.path.clone();
    this.film = new THREE.Mesh(
      new THREE.PlaneGeometry(2, 2),
      new THREE.ShaderMaterial({
        uniforms: { map: { value: null }, attenuation: { value: kAttenuation } },
        depthTest: false,
        vertexShader: `varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }`,
        fragmentShader: `varying vec2 at; uniform sampler2D map; uniform float attenuation;
          void main() { float t = exp(-attenuation * max(0.0, texture2D(map, at).r)); gl_FragColor = vec4(vec3(t), 1.0); }`,
      }),
    );
    this.film.frustumCulled = false;
    this.filmScene.add(this.film);
    this.turn("Isometric");
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  show(instant: Instant | null) {
    const first = this.instant === null && instant !== null && instant.bodies.length > 0;
    this.instant = instant;
    this.update();
    if (first) this.fit();
    this.draw();
  }

  /** After a change of the look. */
  restyle() {
    this.update();
    this.draw();
  }

  fit() {
    const box = this.box.makeEmpty();
    for (const b of this.instant?.bodies ?? [])
      if (this.lookOf(b.name).shown)
        for (let i = 0; i < b.points.length; i += 3)
          box.expandByPoint(new THREE.Vector3(b.points[i], b.points[i + 1], b.points[i + 2]));
    if (box.isEmpty()) return;
    box.getCenter(this.centre);
    this.size = box.getSize(new THREE.Vector3()).length() || 1;
    const way = this.camera.position.clone().sub(this.controls.target).normalize();
    this.controls.target.copy(this.centre);
    this.camera.position.copy(this.centre).addScaledVector(way, 2 * this.size);
    this.camera.near = -10 * this.size;
    this.camera.far = 20 * this.size;
    this.controls.update();
    this.fill();
    this.update();
    this.draw();
    this.onCamera?.();
  }

  /** Zooms so that all is seen from where the camera is. */
  private fill() {
    this.setBounds();
    this.camera.updateMatrixWorld();
    const out = new THREE.Vector3();
    let wide = 1e-12;
    let high = 1e-12;
    for (let i = 0; i < 8; ++i) {
      out.set(
        i & 1 ? this.box.max.x : this.box.min.x,
        i & 2 ? this.box.max.y : this.box.min.y,
        i & 4 ? this.box.max.z : this.box.min.z,
      );
      out.applyMatrix4(this.camera.matrixWorldInverse);
      wide = Math.max(wide, Math.abs(out.x));
      high = Math.max(high, Math.abs(out.y));
    }
    this.camera.zoom = 0.86 * Math.min(this.camera.right / wide, this.camera.top / high);
  }

  private setBounds() {
    const aspect = Math.max(1, this.element.clientWidth) / Math.max(1, this.element.clientHeight);
    this.camera.top = 0.45 * this.size * Math.max(1, 1 / aspect);
    this.camera.bottom = -this.camera.top;
    this.camera.right = this.camera.top * aspect;
    this.camera.left = -this.camera.right;
  }

  turn(preset: string) {
    const way = new THREE.Vector3(...kPresets[preset]).normalize();
    this.camera.up.set(0, 0, 1);
    if (Math.abs(way.z) > 0.99) this.camera.up.set(0, 1, 0);
    this.camera.position.copy(this.controls.target).addScaledVector(way, 2 * this.size);
    this.controls.update();
    if (!this.box.isEmpty()) {
      this.controls.target.copy(this.centre);
      this.camera.position.copy(this.centre).addScaledVector(way, 2 * this.size);
      this.controls.update();
      this.fill();
    }
    this.draw();
    this.onCamera?.();
  }

  getCamera(): Camera {
    return {
      position: this.camera.position.clone(),
      target: this.controls.target.clone(),
      up: this.camera.up.clone(),
      zoom: this.camera.zoom,
    };
  }

  setCamera(c: Camera, other: View) {
    this.size = other.size;
    this.camera.near = other.camera.near;
    this.camera.far = other.camera.far;
    this.camera.position.copy(c.position);
    this.camera.up.copy(c.up);
    this.camera.zoom = c.zoom;
    this.controls.target.copy(c.target);
    this.camera.lookAt(c.target);
    this.draw();
  }

  set interactive(on: boolean) {
    this.controls.enabled = on;
  }

  private lookOf(name: string): BodyLook {
    return this.look.bodies.get(name) ?? { shown: true, mode: "" };
  }

  private modeOf(name: string): Mode {
    return this.look.mode === "xray" ? "xray" : this.lookOf(name).mode || this.look.mode;
  }

  private update() {
    const now = this.instant;
    const there = new Set(now?.bodies.map((b) => b.name));
    for (const [name, d] of this.drawn)
      if (!there.has(name)) {
        d.mesh.removeFromParent();
        d.edges.removeFromParent();
        d.geometry.dispose();
        this.drawn.delete(name);
      }
    this.bar = null;
    if (!now) return;
    const range = this.fieldRange(now);
    now.bodies.forEach((b, i) => this.updateBody(b, i, range));
    this.updateArrows(now);
  }

  private fieldOf(b: Body): Field | undefined {
    return this.look.field ? b.fields.find((f) => f.name === this.look.field) : undefined;
  }

  private fieldRange(now: Instant): [number, number] | null {
    let low = Infinity;
    let high = -Infinity;
    let unit = "";
    for (const b of [...now.bodies, ...(this.partner?.instant?.bodies ?? [])]) {
      const field = this.lookOf(b.name).shown ? this.fieldOf(b) : undefined;
      if (!field) continue;
      unit = field.unit;
      for (const v of field.values) {
        if (v < low) low = v;
        if (v > high) high = v;
      }
    }
    if (!(low <= high)) return null;
    if (low > 0 && low < 0.5 * high) low = 0; // sizes begin at nothing
    let range: [number, number] = this.look.range ?? [low, high];
    // A spread that is all round-off has no colours.
    const flat = !(range[1] - range[0] > 1e-6 * Math.max(Math.abs(range[0]), Math.abs(range[1])));
    this.bar = { name: this.look.field, unit, range };
    return flat ? null : range;
  }

  private updateBody(b: Body, index: number, range: [number, number] | null) {
    let points = b.points;
    let triangles = b.triangles;
    if (b.kind === "wire") ({ points, triangles } = tube(b.points, b.radius, 0.002 * this.size));
    let d = this.drawn.get(b.name);
    const same = d && d.triangles.length === triangles.length && d.geometry.attributes.position.count === points.length / 3;
    if (!d || !same || (b.kind !== "wire" && d.triangles !== b.triangles)) {
      d?.mesh.removeFromParent();
      d?.edges.removeFromParent();
      d?.geometry.dispose();
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(points.slice(), 3));
      geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(points.length), 3));
      geometry.setIndex(new THREE.BufferAttribute(outwards(points, triangles), 1));
      const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial() as THREE.Material);
      mesh.frustumCulled = false;
      mesh.name = b.name;
      const lines = new THREE.BufferGeometry();
      lines.setAttribute("position", geometry.attributes.position);
      lines.setIndex(b.kind === "solid" || b.kind === "rigid" ? sharpEdges(points, triangles) : []);
      const edges = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: 0x1b1f24 }));
      edges.frustumCulled = false;
      this.scene.add(edges);
      d = { edges, body: b, mesh, geometry, triangles: b.kind === "wire" ? triangles : b.triangles };
      this.drawn.set(b.name, d);
    } else {
      (d.geometry.attributes.position.array as Float32Array).set(points);
      d.geometry.attributes.position.needsUpdate = true;
    }
    d.body = b;
    const smooth = b.kind === "wire" || b.kind === "wall";
    if (smooth) d.geometry.computeVertexNormals();
    const field = range ? this.fieldOf(b) : undefined;
    const colours = d.geometry.attributes.color.array as Float32Array;
    const plain = b.kind === "wire" ? kWire : kLinearPlain[index % kPlain.length];
    const each = b.kind === "wire" ? kSides : 1;
    for (let i = 0; i < colours.length / 3; ++i) {
      const at = b.kind === "wire" ? Math.min((field?.values.length ?? 1) - 1, Math.floor(i / each)) : i;
      const x = field ? (field.values[at] - range![0]) / (range![1] - range![0]) : 0;
      const c = field ? kMap[Math.round(1023 * Math.min(1, Math.max(0, x)))] : plain;
      colours[3 * i] = c[0];
      colours[3 * i + 1] = c[1];
      colours[3 * i + 2] = c[2];
    }
    d.geometry.attributes.color.needsUpdate = true;
    const mode = this.modeOf(b.name);
    const parent = mode === "xray" ? this.thick : this.scene;
    // A colour that means a number is that of the bar, whatever light falls on it.
    const lit = !field;
    const key = mode + smooth + b.kind + lit;
    if (d.mesh.userData.key !== key) {
      d.mesh.userData.key = key;
      if (d.mesh.material !== this.path && d.mesh.material !== this.wirePath) d.mesh.material.dispose();
      d.mesh.material =
        mode === "xray"
          ? b.kind === "wire"
            ? this.wirePath
            : this.path
          : new (lit ? THREE.MeshLambertMaterial : THREE.MeshBasicMaterial)({
              vertexColors: true,
              side: THREE.DoubleSide,
              ...(lit ? { flatShading: !smooth } : {}),
              wireframe: mode === "wire",
              transparent: mode === "transparent" || (b.kind === "wall" && mode === "normal"),
              opacity: mode === "transparent" ? 0.35 : b.kind === "wall" && mode === "normal" ? 0.25 : 1,
              depthWrite: mode === "wire" || (mode === "normal" && b.kind !== "wall"),
              polygonOffset: true,
              polygonOffsetFactor: 1,
              polygonOffsetUnits: 1,
            });
      d.mesh.renderOrder = mode === "transparent" || b.kind === "wall" ? 1 : 0;
    }
    if (d.mesh.parent !== parent) parent.add(d.mesh);
    d.mesh.visible = this.lookOf(b.name).shown;
    d.edges.visible = d.mesh.visible && mode !== "xray" && mode !== "wire";
  }

  private updateArrows(now: Instant) {
    const c = now.contacts;
    const count = Math.min(c.length / 6, 4096);
    let largest = 0;
    for (const all of [c, this.partner?.instant?.contacts ?? []])
      for (let i = 0; i + 5 < all.length; i += 6) largest = Math.max(largest, Math.hypot(all[i + 3], all[i + 4], all[i + 5]));
    this.longest = this.look.arrows && this.look.mode !== "xray" ? largest : 0;
    let n = 0;
    if (this.longest > 0) {
      const full = 0.16 * this.size;
      const turn = new THREE.Quaternion();
      const up = new THREE.Vector3(0, 1, 0);
      const m = new THREE.Matrix4();
      for (let i = 0; i < count; ++i) {
        const force = new THREE.Vector3(c[6 * i + 3], c[6 * i + 4], c[6 * i + 5]);
        const length = (full * force.length()) / largest;
        if (length < 0.02 * full) continue;
        const at = new THREE.Vector3(c[6 * i], c[6 * i + 1], c[6 * i + 2]);
        turn.setFromUnitVectors(up, force.clone().normalize());
        const head = Math.min(0.25 * full, 0.45 * length);
        const thick = 0.014 * full;
        m.compose(at, turn, new THREE.Vector3(thick, length - head, thick));
        this.shafts.setMatrixAt(n, m);
        m.compose(at.addScaledVector(force.normalize(), length), turn, new THREE.Vector3(0.3 * head, head, 0.3 * head));
        this.heads.setMatrixAt(n++, m);
      }
    }
    for (const mesh of [this.shafts, this.heads, ...this.ghosts]) {
      mesh.count = n;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.drawNow();
    });
  }

  drawNow() {
    const width = Math.max(1, this.element.clientWidth);
    const height = Math.max(1, this.element.clientHeight);
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height);
      this.overlay.width = width * ratio;
      this.overlay.height = height * ratio;
    }
    this.setBounds();
    this.camera.updateProjectionMatrix();
    this.light.position.copy(this.camera.position).sub(this.controls.target).normalize();
    this.light.position.add(new THREE.Vector3(0.3, 0.2, 0.6));
    this.renderer.setRenderTarget(null);
    this.renderer.clear();
    if (this.look.mode === "xray") this.drawXray(width * ratio, height * ratio);
    else this.renderer.render(this.scene, this.camera);
    this.drawOverlay(width, height, ratio);
    ++this.frames;
    const begun = performance.now();
    requestAnimationFrame(() => (this.cost = 0.5 * (this.cost + performance.now() - begun)));
  }

  private drawXray(width: number, height: number) {
    if (!this.target || this.target.width !== width || this.target.height !== height) {
      this.target?.dispose();
      this.target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, depthBuffer: false });
    }
    this.path.uniforms.size.value = 0.35 * this.size;
    let thick = 0.002 * this.size;
    for (const d of this.drawn.values()) for (const r of d.body.radius ?? []) thick = Math.max(thick, r);
    this.wirePath.uniforms.size.value = 2 * thick;
    this.renderer.setRenderTarget(this.target);
    this.renderer.setClearColor(0x000000);
    this.renderer.clear();
    this.renderer.render(this.thick, this.camera);
    this.renderer.setRenderTarget(null);
    this.renderer.setClearColor(0xffffff);
    this.film.material.uniforms.map.value = this.target.texture;
    this.renderer.render(this.filmScene, this.camera);
  }

  /** Scale bar, colour bar, axes and what the arrows mean; the same in every picture that leaves the page. */
  private drawOverlay(width: number, height: number, ratio: number) {
    const g = this.overlay.getContext("2d")!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = "12px system-ui, sans-serif";
    g.fillStyle = g.strokeStyle = "#1b1f24";
    g.lineWidth = 1.5;
    const metre = height / ((this.camera.top - this.camera.bottom) / this.camera.zoom); // pixels
    if (this.instant && this.instant.bodies.length > 0) {
      const length = roundBelow((0.2 * width) / metre);
      const pixels = length * metre;
      const x = width - 20 - pixels;
      const y = height - 18;
      g.beginPath();
      g.moveTo(x, y - 5);
      g.lineTo(x, y);
      g.lineTo(x + pixels, y);
      g.lineTo(x + pixels, y - 5);
      g.stroke();
      g.textAlign = "center";
      g.fillText(lengthText(length), x + pixels / 2, y - 7);
      this.drawAxes(g, height);
    }
    g.textAlign = "left";
    let y = 20;
    if (this.bar && this.look.mode !== "xray") {
      const { name, unit, range } = this.bar;
      const [low, high] = range;
      g.fillText(name + (unit ? ` [${unit}]` : ""), 12, y);
      y += 8;
      if (high > low) {
        const long = Math.min(220, width - 40);
        for (let i = 0; i < long; ++i) {
          const [r, gr, b] = viridis(i / (long - 1));
          g.fillStyle = `rgb(${255 * r},${255 * gr},${255 * b})`;
          g.fillRect(12 + i, y, 1.5, 12);
        }
        g.fillStyle = "#1b1f24";
        g.fillText(shortNumber(low), 12, y + 26);
        g.textAlign = "center";
        g.fillText(shortNumber((low + high) / 2), 12 + long / 2, y + 26);
        g.textAlign = "right";
        g.fillText(shortNumber(high), 12 + long, y + 26);
        g.textAlign = "left";
        y += 46;
      } else {
        g.fillText(shortNumber(low) + " everywhere", 12, y + 12);
        y += 32;
      }
    }
    if (this.look.mode === "xray") {
      g.fillText("X-ray: what is thick is dark", 12, y);
      y += 18;
    }
    if (this.longest > 0) {
      g.fillStyle = "#c1440e";
      g.fillText(`longest arrow ${shortNumber(this.longest)} N`, 12, y);
    }
  }

  private drawAxes(g: CanvasRenderingContext2D, height: number) {
    const at = [40, height - 40];
    (["x", "y", "z"] as const).forEach((name, i) => {
      const v = new THREE.Vector3().setComponent(i, 1).transformDirection(this.camera.matrixWorldInverse);
      const end = [at[0] + 26 * v.x, at[1] - 26 * v.y];
      g.beginPath();
      g.moveTo(at[0], at[1]);
      g.lineTo(end[0], end[1]);
      g.stroke();
      if (Math.hypot(v.x, v.y) > 0.2) {
        g.textAlign = "center";
        g.fillText(name, at[0] + 35 * v.x, at[1] - 35 * v.y + 4);
      }
    });
    g.textAlign = "left";
  }

  /** The body and triangle below a place of the canvas [pixels]. */
  pick(x: number, y: number): { body: Body; triangle: number; point: [number, number, number] } | null {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(this.normalised(x, y), this.camera);
    // An orthographic ray begins in the camera's plane; bodies may lie behind it.
    ray.ray.origin.addScaledVector(ray.ray.direction, -10 * this.size);
    ray.far = Infinity;
    const meshes = [...this.drawn.values()].filter((d) => d.mesh.visible).map((d) => d.mesh);
    for (const hit of ray.intersectObjects(meshes, false)) {
      const d = this.drawn.get(hit.object.name)!;
      if (d.body.kind !== "solid" || hit.faceIndex == null) continue;
      return { body: d.body, triangle: hit.faceIndex, point: hit.point.toArray() as [number, number, number] };
    }
    return null;
  }

  private normalised(x: number, y: number): THREE.Vector2 {
    return new THREE.Vector2((2 * x) / this.element.clientWidth - 1, 1 - (2 * y) / this.element.clientHeight);
  }

  /** Points of a body, as places of the canvas [pixels]. */
  project(points: Float32Array): Float32Array {
    const out = new Float32Array((2 * points.length) / 3);
    const p = new THREE.Vector3();
    for (let i = 0; i < points.length / 3; ++i) {
      p.set(points[3 * i], points[3 * i + 1], points[3 * i + 2]).project(this.camera);
      out[2 * i] = ((p.x + 1) / 2) * this.element.clientWidth;
      out[2 * i + 1] = ((1 - p.y) / 2) * this.element.clientHeight;
    }
    return out;
  }

  /** Marks triangles of a body; null: none. */
  mark(body: Body | null, triangles: number[] = []) {
    this.picked?.removeFromParent();
    this.picked?.geometry.dispose();
    this.picked = null;
    if (body && triangles.length > 0) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(body.points, 3));
      geometry.setIndex(triangles.flatMap((t) => [...body.triangles.subarray(3 * t, 3 * t + 3)]));
      this.picked = new THREE.Mesh(
        geometry,
        new THREE.MeshBasicMaterial({ color: 0xd81b60, side: THREE.DoubleSide, transparent: true, opacity: 0.75 }),
      );
      this.picked.renderOrder = 2;
      this.picked.frustumCulled = false;
      this.scene.add(this.picked);
    }
    this.draw();
  }

  /** Of the colours now; null: there are none. */
  seenRange(): [number, number] | null {
    return this.bar?.range ?? null;
  }

  /** What is seen, with its bars, as a picture. */
  picture(): HTMLCanvasElement {
    this.drawNow();
    const out = document.createElement("canvas");
    out.width = this.canvas.width;
    out.height = this.canvas.height;
    const g = out.getContext("2d")!;
    g.drawImage(this.canvas, 0, 0);
    g.drawImage(this.overlay, 0, 0);
    return out;
  }
}
