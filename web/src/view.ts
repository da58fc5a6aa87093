// One view of an instant: bodies by mode and colour, arrows of contact forces, scale bar, colour bar.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Body, Field, Instant } from "./frames";
import type { BodyAppearance, Appearance, Mode } from "./appearance";
import { ArrowMeshes, arrowsOf, arrowWords } from "./arrows";
import { seenTriangles } from "./seen_triangles";
import { XrayFilm } from "./xray_film";
import { kPlain, shortNumber, viridis } from "./colours";
import { fewerTriangles, kSides, outwards, sharpEdges, tube } from "./shapes";
import { drawAxes, drawBar, drawCross, drawHand, drawMeasure, drawOutline, drawScale, label } from "./overlay";
import { CutFaces } from "./cut_faces";
import type { Health } from "./state";

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
  few: THREE.BufferGeometry | null; // of fewer triangles between the same points
  triangles: Uint32Array;
  seen: unknown[]; // what its points and colours were made of
}

/** Colours as the light of the screen is added up. */
const linear = (c: readonly number[]) => c.map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
const kMap = Array.from({ length: 1024 }, (_, i) => linear(viridis(i / 1023)));
const kLinearPlain = kPlain.map(linear);
const kWire = linear([0.16, 0.2, 0.28]);

/** A place of a body: it moves with it. */
export interface Place {
  name: string;
  triangle: number;
  weights: [number, number, number];
}

const kTissue = 1.2; // attenuation of a solid or vessel as thick as a third of the scene
const kInk = "#1b1f24";
const kSlow = 40; // of a drawing [ms]: from then on fewer points and triangles are drawn while things move
const kFew = 4000; // triangles of a body then

export class View {
  readonly canvas = document.createElement("canvas");
  readonly overlay = document.createElement("canvas");
  readonly element = document.createElement("div");
  readonly camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1000, 1000);
  onCamera: (() => void) | null = null;
  partner: View | null = null; // compared with this one: the same colours and arrows mean the same
  frames = 0;
  still = false; // nothing is drawn: for measurements
  hurried = false; // things move: where drawing is slow, fewer points are drawn
  attenuation = 2000; // of wires in an X-ray picture [1/m], as amontons.xray has it
  tissue = true; // vessels and solids are in it, too
  cross: [number, number] | null = null; // led by keys [pixels]
  outline: [number, number][] = []; // of a lasso [pixels]
  measure: [number, number, number][] = []; // places between which a distance is measured [m]
  hand: Health | null = null; // of a run in the hand
  cost = 0; // of a drawing, until the browser is ready for the next one [ms]
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly controls: OrbitControls;
  private readonly drawn = new Map<string, Drawn>();
  private readonly light = new THREE.DirectionalLight(0xffffff, 1.3);
  private picked: THREE.Mesh | null = null;
  private instant: Instant | null = null;
  private waiting = false;
  private centre = new THREE.Vector3();
  private size = 1;
  private box = new THREE.Box3();
  private longest = 0;
  private arrowText: string[] = [];
  private bar: { name: string; unit: string; range: [number, number] } | null = null;

  private coarse = false; // drawn with fewer points
  private readonly software: boolean; // there is no GPU
  private readonly film = new XrayFilm();
  private readonly arrows = new ArrowMeshes(this.scene);
  private readonly cutPlane = new THREE.Plane(new THREE.Vector3(1, 0, 0), 0);
  private readonly cutFaces: CutFaces;
  private waitingForDrawing: (() => void)[] = [];

  constructor(
    label: string,
    public appearance: Appearance,
  ) {
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
      stencil: true, // for the faces of a cut
    });
    this.renderer.localClippingEnabled = true;
    const gl = this.renderer.getContext();
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    this.software = /swiftshader|llvmpipe|softpipe|software/i.test(name);
    this.cutFaces = new CutFaces(this.scene, this.cutPlane);
    this.renderer.setClearColor(0xffffff);
    this.renderer.autoClear = false;
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b0b8, 1.7), this.light);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => {
      this.draw();
      this.onCamera?.();
    });
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

  /** After a change of the appearance. */
  restyle() {
    this.update();
    this.draw();
  }

  fit() {
    const box = this.box.makeEmpty();
    for (const b of this.instant?.bodies ?? [])
      if (this.appearanceOf(b.name).shown)
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
    this.viewFrom(new THREE.Vector3(...kPresets[preset]).normalize());
  }

  private viewFrom(way: THREE.Vector3) {
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

  /** The camera of a C-arm: angles around z and towards it [degree]; both 0: along +y. */
  turnTo(around: number, tilt: number) {
    const a = (around * Math.PI) / 180;
    const b = (tilt * Math.PI) / 180;
    this.viewFrom(new THREE.Vector3(Math.sin(a) * Math.cos(b), -Math.cos(a) * Math.cos(b), Math.sin(b)));
  }

  set interactive(on: boolean) {
    this.controls.enabled = on;
  }

  private appearanceOf(name: string): BodyAppearance {
    return this.appearance.bodies.get(name) ?? { shown: true, mode: "" };
  }

  private modeOf(name: string): Mode {
    return this.appearance.mode === "xray" ? "xray" : this.appearanceOf(name).mode || this.appearance.mode;
  }

  private update() {
    const now = this.instant;
    const there = new Set(now?.bodies.map((b) => b.name));
    for (const [name, d] of this.drawn)
      if (!there.has(name)) {
        this.free(d);
        this.drawn.delete(name);
      }
    this.bar = null;
    if (!now) return;
    const range = this.fieldRange(now);
    this.updateCut(now);
    now.bodies.forEach((b, i) => this.updateBody(b, i, range));
    this.updateArrows(now);
  }

  /** Where the cut is [m]; null: there is none. */
  cutPlace(): number | null {
    return this.isCut() ? -this.cutPlane.constant * this.cutPlane.normal.dot(this.cutAxis()) : null;
  }

  /** Whether a place is not cut away. */
  private isLeft(at: [number, number, number]): boolean {
    return !this.isCut() || this.cutPlane.distanceToPoint(new THREE.Vector3(...at)) > -1e-6 * this.size;
  }

  /** Whether a cut across an axis is seen where what lies above it is kept. */
  seesCutAbove(axis: "x" | "y" | "z"): boolean {
    return this.camera.position.clone().sub(this.controls.target)[axis] < 0;
  }

  private isCut(): boolean {
    return this.appearance.cut.axis !== "" && this.appearance.mode !== "xray";
  }

  private cutAxis(): THREE.Vector3 {
    return new THREE.Vector3().setComponent(Math.max(0, "xyz".indexOf(this.appearance.cut.axis || "x")), 1);
  }

  private updateCut(now: Instant) {
    const { cut } = this.appearance;
    if (!this.isCut()) return;
    const k = "xyz".indexOf(cut.axis);
    let low = Infinity;
    let high = -Infinity;
    for (const b of now.bodies) {
      if (!this.appearanceOf(b.name).shown) continue;
      for (let i = k; i < b.points.length; i += 3) {
        low = Math.min(low, b.points[i]);
        high = Math.max(high, b.points[i]);
      }
    }
    const at = low + cut.share * (high - low);
    // What lies below is kept, or what lies above.
    this.cutPlane.normal.copy(this.cutAxis()).multiplyScalar(cut.flip ? 1 : -1);
    this.cutPlane.constant = cut.flip ? -at : at;
  }

  private fieldOf(b: Body): Field | undefined {
    return this.appearance.field ? b.fields.find((f) => f.name === this.appearance.field) : undefined;
  }

  private fieldRange(now: Instant): [number, number] | null {
    let low = Infinity;
    let high = -Infinity;
    let unit = "";
    for (const b of [...now.bodies, ...(this.partner?.instant?.bodies ?? [])]) {
      const field = this.appearanceOf(b.name).shown ? this.fieldOf(b) : undefined;
      if (!field) continue;
      unit = field.unit;
      for (const v of field.values) {
        if (v < low) low = v;
        if (v > high) high = v;
      }
    }
    if (!(low <= high)) return null;
    if (low > 0 && low < 0.5 * high) low = 0; // sizes begin at nothing
    let range: [number, number] = this.appearance.range ?? [low, high];
    // A spread that is all round-off has no colours.
    const flat = !(range[1] - range[0] > 1e-6 * Math.max(Math.abs(range[0]), Math.abs(range[1])));
    this.bar = { name: this.appearance.field, unit, range };
    return flat ? null : range;
  }

  private free(d: Drawn) {
    d.mesh.removeFromParent();
    d.edges.removeFromParent();
    d.geometry.dispose();
    d.few?.dispose();
    this.cutFaces.remove(d.body.name);
  }

  /** Where drawing is slow and things move, bodies of many triangles are drawn with fewer. */
  private chooseTriangles(few: boolean) {
    for (const d of this.drawn.values()) {
      const many = d.body.kind !== "wire" && d.geometry.index!.count > 6 * kFew;
      if (few && many && !d.few) {
        d.few = new THREE.BufferGeometry();
        d.few.setIndex(
          new THREE.BufferAttribute(fewerTriangles(d.body.points, d.geometry.index!.array as Uint32Array, kFew), 1),
        );
      }
      if (few && d.few) d.few.attributes = d.geometry.attributes;
      d.mesh.geometry = few && d.few ? d.few : d.geometry;
    }
  }

  private updateBody(b: Body, index: number, range: [number, number] | null) {
    let points = b.points;
    let triangles = b.triangles;
    const xray = this.appearance.mode === "xray"; // where a wire is as thick as it is
    if (b.kind === "wire") ({ points, triangles } = tube(b.points, b.radius, xray ? 0 : 0.002 * this.size));
    let d = this.drawn.get(b.name);
    const same = d && d.triangles.length === triangles.length && d.geometry.attributes.position.count === points.length / 3;
    if (!d || !same || (b.kind !== "wire" && d.triangles !== b.triangles)) {
      if (d) this.free(d);
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
      d = { edges, body: b, mesh, geometry, few: null, triangles: b.kind === "wire" ? triangles : b.triangles, seen: [] };
      this.drawn.set(b.name, d);
    }
    d.body = b;
    const smooth = b.kind === "wire" || b.kind === "wall";
    const field = range ? this.fieldOf(b) : undefined;
    const plain = b.kind === "wire" ? kWire : kLinearPlain[index % kPlain.length];
    // What stands still is not sent to the screen's memory again: a vessel is most of a scene.
    const seen = [b.points, b.radius, this.size, xray, smooth, plain, field?.values, ...(field ? range! : [])];
    if (seen.length !== d.seen.length || seen.some((x, i) => x !== d.seen[i])) {
      d.seen = seen;
      (d.geometry.attributes.position.array as Float32Array).set(points);
      d.geometry.attributes.position.needsUpdate = true;
      if (smooth) d.geometry.computeVertexNormals();
      this.paint(d, field, range, plain);
    }
    const mode = this.modeOf(b.name);
    const parent = mode === "xray" ? this.film.scene : this.scene;
    // A colour that means a number is that of the bar, whatever light falls on it.
    const lit = !field;
    const clippingPlanes = this.isCut() && b.kind !== "wire" ? [this.cutPlane] : null;
    const key = mode + smooth + b.kind + lit + (clippingPlanes !== null);
    if (d.mesh.userData.key !== key) {
      d.mesh.userData.key = key;
      if (d.mesh.material !== this.film.tissue && d.mesh.material !== this.film.wires) d.mesh.material.dispose();
      d.mesh.material =
        mode === "xray"
          ? b.kind === "wire"
            ? this.film.wires
            : this.film.tissue
          : new (lit ? THREE.MeshLambertMaterial : THREE.MeshBasicMaterial)({
              vertexColors: true,
              side: THREE.DoubleSide,
              ...(lit ? { flatShading: !smooth } : {}),
              wireframe: mode === "wire",
              transparent: mode === "transparent" || (b.kind === "wall" && mode === "normal"),
              opacity: mode === "transparent" ? 0.35 : b.kind === "wall" && mode === "normal" ? 0.25 : 1,
              depthWrite: mode === "wire" || (mode === "normal" && b.kind !== "wall"),
              forceSinglePass: b.kind === "wall", // its far side and its near one are of one colour
              clippingPlanes,
              polygonOffset: true,
              polygonOffsetFactor: 1,
              polygonOffsetUnits: 1,
            });
      d.mesh.renderOrder = mode === "transparent" || b.kind === "wall" ? 1 : 0;
      (d.edges.material as THREE.Material).clippingPlanes = clippingPlanes;
      (d.edges.material as THREE.Material).needsUpdate = true;
    }
    if (d.mesh.parent !== parent) parent.add(d.mesh);
    d.mesh.visible = this.appearanceOf(b.name).shown;
    d.edges.visible = d.mesh.visible && mode !== "xray" && mode !== "wire";
    const full = (b.kind === "solid" || b.kind === "rigid") && mode === "normal" && d.mesh.visible;
    if (clippingPlanes && full) this.cutFaces.show(b.name, d.geometry, this.size, plain);
    else this.cutFaces.hide(b.name);
  }

  private paint(d: Drawn, field: Field | undefined, range: [number, number] | null, plain: readonly number[]) {
    const colours = d.geometry.attributes.color.array as Float32Array;
    const wire = d.body.kind === "wire";
    for (let i = 0; i < colours.length / 3; ++i) {
      const at = wire ? Math.min((field?.values.length ?? 1) - 1, Math.floor(i / kSides)) : i;
      const x = field ? (field.values[at] - range![0]) / (range![1] - range![0]) : 0;
      const c = field ? kMap[Math.round(1023 * Math.min(1, Math.max(0, x)))] : plain;
      colours[3 * i] = c[0];
      colours[3 * i + 1] = c[1];
      colours[3 * i + 2] = c[2];
    }
    d.geometry.attributes.color.needsUpdate = true;
  }

  private updateArrows(now: Instant) {
    const { arrows } = this.appearance;
    const own = arrowsOf(now, arrows).filter((a) => this.isLeft(a.at));
    const all = this.partner?.instant ? [own, arrowsOf(this.partner.instant, arrows)] : [own];
    let largest = 0;
    for (const list of all) for (const a of list) largest = Math.max(largest, a.size);
    this.longest = arrows.shown && this.appearance.mode !== "xray" ? largest : 0;
    this.arrows.show(this.longest > 0 ? own : [], 0.16 * this.size, largest);
    this.arrowText = this.longest > 0 ? arrowWords(now, arrows, this.longest) : [];
  }

  /** When the requested frame is on the screen. */
  afterDrawing(): Promise<void> {
    if (!this.waiting) return Promise.resolve();
    return new Promise((done) => this.waitingForDrawing.push(done));
  }

  draw() {
    if (this.waiting || this.still) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.drawNow();
      for (const done of this.waitingForDrawing.splice(0)) done();
    });
  }

  /** @param exact  with all points, however long it takes */
  drawNow(exact = false) {
    const width = Math.max(1, this.element.clientWidth);
    const height = Math.max(1, this.element.clientHeight);
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    // Once slow, with fewer points until things stand still: sizes that change cost more than they save.
    this.coarse = this.hurried && !exact && (this.coarse || this.cost > kSlow);
    const few = this.coarse || (this.software && this.hurried && !exact);
    this.chooseTriangles(few);
    this.arrows.through = !few;
    const fine = this.coarse ? 0.5 * ratio : ratio;
    if (this.canvas.width !== Math.floor(width * fine) || this.canvas.height !== Math.floor(height * fine)) {
      this.renderer.setPixelRatio(fine);
      this.renderer.setSize(width, height, false);
    }
    if (this.overlay.width !== Math.floor(width * ratio) || this.overlay.height !== Math.floor(height * ratio)) {
      this.overlay.width = Math.floor(width * ratio);
      this.overlay.height = Math.floor(height * ratio);
    }
    this.setBounds();
    this.camera.updateProjectionMatrix();
    this.light.position.copy(this.camera.position).sub(this.controls.target).normalize();
    this.light.position.add(new THREE.Vector3(0.3, 0.2, 0.6));
    this.renderer.setRenderTarget(null);
    this.renderer.clear();
    if (this.appearance.mode === "xray")
      this.film.draw(this.renderer, this.camera, this.attenuation, this.tissue ? kTissue / (0.35 * this.size) : 0);
    else this.renderer.render(this.scene, this.camera);
    this.drawOverlay(width, height, ratio);
    ++this.frames;
    const begun = performance.now();
    requestAnimationFrame(() => (this.cost = 0.5 * (this.cost + performance.now() - begun)));
  }

  /** Scale bar, colour bar, axes and what the arrows mean; the same in every picture that leaves the page. */
  private drawOverlay(width: number, height: number, ratio: number) {
    const g = this.overlay.getContext("2d", { willReadFrequently: true })!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = "12px system-ui, sans-serif";
    g.fillStyle = g.strokeStyle = kInk;
    g.lineWidth = 1.5;
    const metre = height / ((this.camera.top - this.camera.bottom) / this.camera.zoom); // pixels
    if (this.instant && this.instant.bodies.length > 0) {
      drawScale(g, width, height, metre);
      drawAxes(g, height, this.camera.matrixWorldInverse);
    }
    g.textAlign = "left";
    let y = 20;
    const xray = this.appearance.mode === "xray";
    if (this.bar && !xray) y = drawBar(g, y, width, this.bar);
    if (xray) {
      g.fillText(`X-ray: wires ${shortNumber(this.attenuation)} 1/m`, 12, y);
      if (this.tissue) g.fillText(`vessels and solids ${shortNumber(kTissue / (0.35 * this.size))} 1/m`, 12, (y += 16));
      y += 18;
    }
    g.fillStyle = "#a8380b";
    for (const line of this.arrowText) {
      label(g, line, 12, y);
      y += 16;
    }
    const cut = this.cutPlace();
    g.fillStyle = kInk;
    if (cut !== null) label(g, `cut at ${this.appearance.cut.axis} = ${shortNumber(cut)} m`, 12, y);
    const onScreen = (p: readonly number[]) => {
      const [x, v] = this.project(Float32Array.from(p));
      return [x, v] as [number, number];
    };
    if (this.hand) drawHand(g, this.hand, onScreen, metre);
    if (this.measure.length > 0) drawMeasure(g, this.measure, this.measure.map(onScreen));
    if (this.outline.length > 0) drawOutline(g, this.outline);
    if (this.cross && document.activeElement === this.canvas) drawCross(g, this.cross);
  }

  /** What is below a place of the canvas [pixels]. @param solid  solids alone count; the others are transparent to the ray */
  pick(x: number, y: number, solid: boolean): ({ body: Body; point: [number, number, number] } & Place) | null {
    for (const d of this.drawn.values()) d.mesh.geometry = d.geometry;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(this.normalised(x, y), this.camera);
    // An orthographic ray begins in the camera's plane; bodies may lie behind it.
    ray.ray.origin.addScaledVector(ray.ray.direction, -10 * this.size);
    ray.far = Infinity;
    const meshes = [...this.drawn.values()].filter((d) => d.mesh.visible).map((d) => d.mesh);
    for (const hit of ray.intersectObjects(meshes, false)) {
      const d = this.drawn.get(hit.object.name)!;
      if ((solid && d.body.kind !== "solid") || hit.faceIndex == null) continue;
      if (this.isCut() && d.body.kind !== "wire" && this.cutPlane.distanceToPoint(hit.point) < 0) continue;
      const weights = new THREE.Vector3();
      THREE.Triangle.getBarycoord(hit.point, ...this.cornersOf(d, hit.faceIndex), weights);
      return {
        body: d.body,
        name: d.body.name,
        triangle: hit.faceIndex,
        weights: weights.toArray() as [number, number, number],
        point: hit.point.toArray() as [number, number, number],
      };
    }
    return null;
  }

  private cornersOf(d: Drawn, triangle: number): [THREE.Vector3, THREE.Vector3, THREE.Vector3] {
    const position = d.geometry.attributes.position;
    const index = d.geometry.index!;
    return [0, 1, 2].map((k) => new THREE.Vector3().fromBufferAttribute(position, index.getX(3 * triangle + k))) as [
      THREE.Vector3,
      THREE.Vector3,
      THREE.Vector3,
    ];
  }

  /** Where a place of a body is in this instant [m]; null: the body is not there. */
  placeNow(p: Place): [number, number, number] | null {
    const d = this.drawn.get(p.name);
    if (!d || 3 * p.triangle + 2 >= d.geometry.index!.count) return null;
    const at = new THREE.Vector3();
    this.cornersOf(d, p.triangle).forEach((c, k) => at.addScaledVector(c, p.weights[k]));
    return at.toArray() as [number, number, number];
  }

  bodyNamed(name: string): Body | undefined {
    return this.drawn.get(name)?.body;
  }

  /** Triangles of a body of which a point is seen. */
  seenTriangles(name: string): Set<number> {
    const parts = [...this.drawn.values()]
      .filter((d) => d.mesh.visible)
      .map((d) => ({
        geometry: d.geometry,
        counted: d.body.name === name,
        clippingPlanes: this.isCut() && d.body.kind !== "wire" ? [this.cutPlane] : null,
      }));
    return seenTriangles(this.renderer, this.camera, parts);
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

  /** Marks triangles of a body, as it is now; null: none. */
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
    this.drawNow(true);
    const out = document.createElement("canvas");
    out.width = this.canvas.width;
    out.height = this.canvas.height;
    const g = out.getContext("2d")!;
    g.drawImage(this.canvas, 0, 0);
    g.drawImage(this.overlay, 0, 0);
    return out;
  }
}
