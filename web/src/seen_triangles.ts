// Which triangles are seen: by a picture in which each has a colour of its own.

import * as THREE from "three";

export interface Part {
  geometry: THREE.BufferGeometry;
  counted: boolean; // its triangles are requested; others only hide them
  clippingPlanes: THREE.Plane[] | null;
}

const kVertex = `attribute vec4 number; varying vec4 colour;
  #include <clipping_planes_pars_vertex>
  void main() { colour = number; vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    #include <clipping_planes_vertex>
    gl_Position = projectionMatrix * mvPosition; }`;
const kFragment = `varying vec4 colour;
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    gl_FragColor = colour; }`;

/** Numbers of the triangles of the counted part of which a point is seen. */
export function seenTriangles(renderer: THREE.WebGLRenderer, camera: THREE.Camera, parts: Part[]): Set<number> {
  const { width, height } = renderer.domElement;
  const scene = new THREE.Scene();
  const left: THREE.BufferGeometry[] = [];
  for (const part of parts) {
    const geometry = part.geometry.toNonIndexed();
    const count = geometry.attributes.position.count;
    const colours = new Uint8Array(4 * count);
    for (let i = 0; part.counted && i < count; ++i) {
      const number = 1 + Math.floor(i / 3);
      colours.set([number & 255, (number >> 8) & 255, (number >> 16) & 255, 255], 4 * i);
    }
    geometry.setAttribute("number", new THREE.BufferAttribute(colours, 4, true));
    const material = new THREE.ShaderMaterial({
      side: THREE.DoubleSide,
      clipping: true,
      clippingPlanes: part.clippingPlanes,
      vertexShader: kVertex,
      fragmentShader: kFragment,
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    scene.add(mesh);
    left.push(geometry);
  }
  const target = new THREE.WebGLRenderTarget(width, height);
  renderer.setRenderTarget(target);
  renderer.setClearColor(0x000000, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const pixels = new Uint8Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  renderer.setRenderTarget(null);
  renderer.setClearColor(0xffffff, 1);
  target.dispose();
  for (const g of left) g.dispose();
  const seen = new Set<number>();
  for (let i = 0; i < pixels.length; i += 4) {
    const number = pixels[i] + 256 * pixels[i + 1] + 65536 * pixels[i + 2];
    if (number > 0) seen.add(number - 1);
  }
  return seen;
}
