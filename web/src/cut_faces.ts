// Faces of a cut: where a plane cuts a closed surface, the inside is shown full and not hollow.
//
// The surface's back sides add one to the stencil of each point, its front sides take one away; what is left is seen
// through the cut, and the plane is drawn there. One body after the other, each with a plane of its own.

import * as THREE from "three";

interface Cut {
  group: THREE.Group;
  plane: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>;
}

export class CutFaces {
  private readonly cuts = new Map<string, Cut>();

  constructor(
    private readonly scene: THREE.Scene,
    private readonly plane: THREE.Plane,
  ) {}

  private sides(geometry: THREE.BufferGeometry, side: THREE.Side, change: THREE.StencilOp, order: number): THREE.Mesh {
    const mesh = new THREE.Mesh(
      geometry,
      new THREE.MeshBasicMaterial({
        side,
        depthWrite: false,
        depthTest: false,
        colorWrite: false,
        clippingPlanes: [this.plane],
        stencilWrite: true,
        stencilFunc: THREE.AlwaysStencilFunc,
        stencilFail: change,
        stencilZFail: change,
        stencilZPass: change,
      }),
    );
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    return mesh;
  }

  private make(name: string, geometry: THREE.BufferGeometry, colour: readonly number[]): Cut {
    const order = 0.1 + 0.01 * this.cuts.size;
    const group = new THREE.Group();
    const plane = new THREE.Mesh(
      new THREE.PlaneGeometry(1, 1),
      new THREE.MeshBasicMaterial({
        color: new THREE.Color(...(colour.map((c) => 0.75 * c) as [number, number, number])),
        side: THREE.DoubleSide,
        stencilWrite: true,
        stencilRef: 0,
        stencilFunc: THREE.NotEqualStencilFunc,
        stencilFail: THREE.ReplaceStencilOp,
        stencilZFail: THREE.ReplaceStencilOp,
        stencilZPass: THREE.ReplaceStencilOp,
      }),
    );
    plane.frustumCulled = false;
    plane.renderOrder = order + 0.002;
    plane.onAfterRender = (renderer) => renderer.clearStencil();
    group.add(
      this.sides(geometry, THREE.BackSide, THREE.IncrementWrapStencilOp, order),
      this.sides(geometry, THREE.FrontSide, THREE.DecrementWrapStencilOp, order + 0.001),
      plane,
    );
    this.scene.add(group);
    const cut = { group, plane };
    this.cuts.set(name, cut);
    return cut;
  }

  /** @param size  of the scene [m]; the plane reaches beyond it */
  show(name: string, geometry: THREE.BufferGeometry, size: number, colour: readonly number[]) {
    const cut = this.cuts.get(name) ?? this.make(name, geometry, colour);
    cut.group.visible = true;
    geometry.computeBoundingBox();
    const middle = geometry.boundingBox!.getCenter(new THREE.Vector3());
    this.plane.projectPoint(middle, cut.plane.position);
    cut.plane.lookAt(cut.plane.position.clone().add(this.plane.normal));
    cut.plane.scale.set(4 * size, 4 * size, 1);
  }

  hide(name: string) {
    const cut = this.cuts.get(name);
    if (cut) cut.group.visible = false;
  }

  /** Before its geometry is freed. */
  remove(name: string) {
    const cut = this.cuts.get(name);
    if (!cut) return;
    cut.group.removeFromParent();
    cut.plane.geometry.dispose();
    this.cuts.delete(name);
  }
}
