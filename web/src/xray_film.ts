// X-ray: depths of the surfaces of closed bodies, far ones less near ones, are the ways through them. They are added up
// in numbers with a fraction, each times its attenuation; the picture is white exp(-sum), as amontons.xray has it.

import * as THREE from "three";

const kWhite = 200 / 255; // where nothing is in the way

function pathMaterial(): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    side: THREE.DoubleSide,
    depthTest: false,
    depthWrite: false,
    transparent: true,
    blending: THREE.CustomBlending,
    blendEquation: THREE.AddEquation,
    blendSrc: THREE.OneFactor,
    blendDst: THREE.OneFactor,
    uniforms: { attenuation: { value: 1 } },
    vertexShader: `varying float depth; uniform float attenuation;
      void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); depth = -p.z * attenuation; gl_Position = projectionMatrix * p; }`,
    fragmentShader: `varying float depth;
      void main() { gl_FragColor = vec4(gl_FrontFacing ? -depth : depth, 0.0, 0.0, 1.0); }`,
  });
}

export class XrayFilm {
  readonly scene = new THREE.Scene(); // bodies that rays pass through, in one of the materials:
  readonly tissue = pathMaterial();
  readonly wires = pathMaterial();
  private target: THREE.WebGLRenderTarget | null = null;
  private readonly plate: THREE.Mesh<THREE.PlaneGeometry, THREE.ShaderMaterial>;
  private readonly plateScene = new THREE.Scene();

  constructor() {
    this.plate = new THREE.Mesh(
      new THREE.PlaneGeometry(2, 2),
      new THREE.ShaderMaterial({
        uniforms: { map: { value: null }, white: { value: kWhite } },
        depthTest: false,
        vertexShader: `varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }`,
        fragmentShader: `varying vec2 at; uniform sampler2D map; uniform float white;
          void main() { float t = white * exp(-max(0.0, texture2D(map, at).r)); gl_FragColor = vec4(vec3(t), 1.0); }`,
      }),
    );
    this.plate.frustumCulled = false;
    this.plateScene.add(this.plate);
  }

  /** @param wires, tissue  attenuations [1/m] */
  draw(renderer: THREE.WebGLRenderer, camera: THREE.Camera, wires: number, tissue: number) {
    const { width, height } = renderer.domElement;
    if (this.target?.width !== width || this.target.height !== height) {
      this.target?.dispose();
      this.target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, depthBuffer: false });
    }
    this.wires.uniforms.attenuation.value = wires;
    this.tissue.uniforms.attenuation.value = tissue;
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000);
    renderer.clear();
    renderer.render(this.scene, camera);
    renderer.setRenderTarget(null);
    renderer.setClearColor(0xffffff);
    this.plate.material.uniforms.map.value = this.target.texture;
    renderer.render(this.plateScene, camera);
  }
}
