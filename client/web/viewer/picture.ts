// The world in 3D: what a moment of its stream looks like, and what the pointer is over.
import {
  AmbientLight,
  BasicShadowMap,
  BufferGeometry,
  Color,
  DirectionalLight,
  GridHelper,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  Mesh,
  PCFSoftShadowMap,
  PerspectiveCamera,
  Plane,
  type Ray,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { View } from "./address.js";
import type { Field, Legend } from "./legend.js";
import type { Moment } from "./playback.js";
import type { SoftBodyView } from "./soft_body_view.js";
import { planeM } from "./solid_view.js";
import { schemes, type Shown, WorldView } from "./world_view.js";

const glowColour = 0x5a2412; // of what is selected

/** A soft body under the pointer. */
export interface Hit {
  readonly body: string;
  /** The vertex that is nearest to the point. */
  readonly vertex: number;
  readonly point: Vector3;
  readonly ray: Ray;
}

// The view follows what is further from its middle than this, of the radius of what was framed; so much of the rest with
// each picture.
const followPastPart = 0.4;
const followPart = 0.1;
// Pictures a second below which it is drawn with less, counted over such a time.
const picturesLeast = 24;
const countMs = 3000;
const gapMs = 500;

export class Picture {
  readonly orbit: OrbitControls;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(45, 1, 0.01, 1000);
  private readonly sun = new DirectionalLight(0xffffff, 2.2);
  private readonly grid = new GridHelper(planeM, 40, 0xffffff, 0xffffff);
  private readonly pull = new Line(new BufferGeometry(), new LineBasicMaterial({ depthTest: false }));
  private readonly raycaster = new Raycaster();
  private readonly world = new WorldView();
  private framed = { centre: new Vector3(), radius: 1 };
  private isFramed = false;
  private wanted: View | undefined;
  private part = 1;
  private lastMs = 0;
  private countedFromMs = 0;
  private counted = 0;

  /** Beside `covers`, which lie over parts of the canvas. Throws where there is no WebGL. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly covers: readonly HTMLElement[],
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.orbit = new OrbitControls(this.camera, canvas);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.bias = -0.002;
    this.sun.shadow.normalBias = 0.02;
    this.pull.visible = false;
    this.pull.frustumCulled = false;
    this.pull.renderOrder = 1;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.5;
    this.scene.add(new AmbientLight(0xffffff, 0.5), new HemisphereLight(0xffffff, 0x8d8271, 1), this.sun);
    this.scene.add(this.sun.target, this.grid, this.pull, this.world.group);
    this.resize();
    for (const part of [canvas, ...covers]) new ResizeObserver(() => this.resize()).observe(part);
  }

  private get bodies(): readonly SoftBodyView[] {
    return this.world.bodies;
  }

  /** What the colours say, as it is now. */
  tell(legend: Legend, field: Field): void {
    const { scale, since } = this.world;
    if (scale) legend.show(field, scale, since);
    else legend.hide();
  }

  get contactCount(): number {
    return this.world.contactCount;
  }

  show(shown: Shown): void {
    const scheme = shown.dark ? schemes.dark : schemes.light;
    this.scene.background = new Color(scheme.paper);
    this.grid.material.color.set(scheme.grid);
    this.pull.material.color.set(scheme.ink);
    this.world.show(shown);
  }

  /** Brings the scene to a moment. */
  update(moment: Moment): void {
    this.world.update(moment);
    if (this.isFramed) {
      if (this.orbit.enabled) this.follow();
      return;
    }
    this.frameAll();
    if (this.wanted) this.look(this.wanted);
  }

  draw(nowMs: number): void {
    this.lightenIfSlow(nowMs);
    this.orbit.update();
    this.renderer.render(this.scene, this.camera);
  }

  /** Where too few pictures are drawn, shadows get hard edges, and go where that does not do. */
  private lightenIfSlow(nowMs: number): void {
    const isGap = nowMs - this.lastMs > gapMs; // the page was not seen, or waited for a shader
    this.lastMs = nowMs;
    if (isGap || nowMs - this.countedFromMs > countMs) {
      if (!isGap && (1000 * this.counted) / countMs < picturesLeast) this.lighten();
      this.countedFromMs = nowMs;
      this.counted = 0;
    }
    ++this.counted;
  }

  private lighten(): void {
    const { shadowMap } = this.renderer;
    if (!shadowMap.enabled) return;
    if (shadowMap.type === PCFSoftShadowMap) shadowMap.type = BasicShadowMap;
    else shadowMap.enabled = false;
    this.scene.traverse((part) => {
      if (part instanceof Mesh) for (const material of [part.material].flat()) material.needsUpdate = true;
    });
  }

  /** Moves with bodies that leave what was framed, but not out of a room. */
  private follow(): void {
    if (this.world.hasRoom) return;
    const { centre, radius } = this.framed;
    const way = this.world.box().getCenter(new Vector3()).sub(centre);
    const past = way.length() - followPastPart * radius;
    if (past <= 0) return;
    way.setLength(followPart * past);
    for (const place of [
      this.camera.position,
      this.orbit.target,
      this.sun.position,
      this.sun.target.position,
      centre,
    ]) {
      place.add(way);
    }
  }

  /** Names of the bodies that are frozen. */
  get frozen(): Set<string> {
    return this.world.frozen;
  }

  /** Turns to another world: the next moment is looked at as a whole, or from where `view` says. */
  forget(view?: View): void {
    this.world.clear();
    this.isFramed = false;
    this.wanted = view;
  }

  /** Moves the camera so that all of the world is seen, and the light with it. */
  frameAll(): void {
    const box = this.world.box();
    const centre = box.getCenter(new Vector3());
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, 0.1);
    const part = this.freePart();
    const far = (1.05 * radius) / Math.sin((this.camera.fov * Math.PI) / 360) / part;
    this.camera.position.copy(new Vector3(0.45, 0.35, 1).setLength(far).add(centre));
    this.camera.near = far / 200;
    this.camera.far = 20 * far;
    this.camera.updateProjectionMatrix();
    this.orbit.target.copy(centre);

    this.grid.visible = !this.world.hasGround;
    this.grid.position.set(centre.x, box.min.y - 0.1 * radius, centre.z);
    this.sun.position.copy(centre).add(new Vector3(0.5, 1.6, 0.7).setLength(3 * radius));
    this.sun.target.position.copy(centre);
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -1.3 * radius;
    camera.right = camera.top = 1.3 * radius;
    camera.near = 0.1 * radius;
    camera.far = 6 * radius;
    camera.updateProjectionMatrix();
    this.framed = { centre, radius };
    this.isFramed = true;
  }

  get eye(): Vector3 {
    return this.camera.position.clone();
  }

  get view(): View {
    return { position: this.eye, target: this.orbit.target.clone() };
  }

  look({ position, target }: View): void {
    this.camera.position.copy(position);
    this.orbit.target.copy(target);
  }

  /** Lights up a body or solid; "": none. */
  highlight(name: string): void {
    for (const body of this.world.bodies) body.skin.material.emissive.set(body.name === name ? glowColour : 0);
    for (const solid of this.world.solids) solid?.mesh.material.emissive.set(solid.name === name ? glowColour : 0);
  }

  /** What is at a place of the window. */
  nameAt(x: number, y: number): string | undefined {
    const mesh = this.meshAt(this.rayAt(x, y))?.object;
    const body = this.world.bodies.find(({ skin }) => skin === mesh);
    return body?.name ?? this.world.solids.find((solid) => solid?.mesh === mesh)?.name;
  }

  /** The first point seen at a place of the window, by default in the middle of the view: as far as the view's target, where it is empty. */
  aim(x?: number, y?: number): Vector3 {
    const towards = this.orbit.target.clone().sub(this.camera.position);
    if (x === undefined || y === undefined) this.raycaster.set(this.camera.position, towards.clone().normalize());
    const ray = x === undefined || y === undefined ? this.raycaster.ray : this.rayAt(x, y);
    return this.meshAt(ray)?.point ?? ray.at(towards.length(), new Vector3());
  }

  /** What is seen, as a PNG. */
  snapshot(): Promise<Blob> {
    this.renderer.render(this.scene, this.camera); // a canvas is empty but in the turn in which it was drawn
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))));
    });
  }

  private meshAt(ray: Ray): { object: unknown; point: Vector3 } | undefined {
    this.raycaster.ray.copy(ray);
    for (const { skin } of this.world.bodies) skin.geometry.computeBoundingSphere();
    const solids = this.world.solids.flatMap((solid) => (solid ? [solid.mesh] : []));
    return this.raycaster.intersectObjects([...this.world.bodies.map(({ skin }) => skin), ...solids], false)[0];
  }

  /** The soft body at a place of the window. */
  pick(x: number, y: number): Hit | undefined {
    const ray = this.rayAt(x, y);
    for (const { skin } of this.bodies) skin.geometry.computeBoundingSphere();
    const [hit] = this.raycaster.intersectObjects(
      this.bodies.map(({ skin }) => skin),
      false,
    );
    const view = this.bodies.find(({ skin }) => skin === hit?.object);
    if (!hit?.face || !view) return undefined;
    const distance = (vertex: number) => hit.point.distanceTo(new Vector3(...view.vertex(vertex)));
    const { a, b, c } = hit.face;
    const vertex = [a, b, c].reduce((near, next) => (distance(next) < distance(near) ? next : near));
    return { body: view.name, vertex, point: hit.point, ray: ray.clone() };
  }

  /** Where the ray through a place of the window meets the plane through `point` that faces the camera. */
  drag(x: number, y: number, point: Vector3): Vector3 {
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), point);
    return this.rayAt(x, y).intersectPlane(plane, new Vector3()) ?? point.clone();
  }

  /** Draws a line from a vertex to where it is pulled; null: none. */
  showPull(pull: { body: string; vertex: number; target: Vector3 } | null): void {
    const view = this.bodies.find(({ name }) => name === pull?.body);
    this.pull.visible = pull !== null && view !== undefined;
    if (pull && view) this.pull.geometry.setFromPoints([new Vector3(...view.vertex(pull.vertex)), pull.target]);
  }

  private rayAt(x: number, y: number): Ray {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.orbit.update(); // the camera may have been moved since the last picture
    this.camera.updateMatrixWorld();
    this.raycaster.setFromCamera(new Vector2((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height), this.camera);
    return this.raycaster.ray;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / Math.max(clientHeight, 1);
    const free = this.free();
    const x = clientWidth / 2 - (free.left + free.width / 2);
    const y = clientHeight / 2 - (free.top + free.height / 2);
    this.camera.setViewOffset(clientWidth, clientHeight, x, y, clientWidth, clientHeight);
    // What was seen whole stays so.
    const part = this.freePart();
    if (this.isFramed) {
      const { position } = this.camera;
      position
        .sub(this.orbit.target)
        .multiplyScalar(this.part / part)
        .add(this.orbit.target);
    }
    this.part = part;
  }

  /** The size of the free part, of the canvas' height. */
  private freePart(): number {
    const { width, height } = this.free();
    return Math.max(Math.min(width, height), 1) / Math.max(this.canvas.clientHeight, 1);
  }

  /** What nothing lies over: beside what is narrow, between what is wide. In the middle of it is the middle of the view. */
  private free(): { left: number; top: number; width: number; height: number } {
    const { clientWidth, clientHeight } = this.canvas;
    let [left, right, top, bottom] = [0, clientWidth, 0, clientHeight];
    for (const cover of this.covers) {
      const rect = cover.getBoundingClientRect();
      if (rect.width * rect.height === 0) continue;
      if (rect.width < clientWidth / 2) {
        if (rect.left > clientWidth / 2) right = Math.min(right, rect.left);
        else left = Math.max(left, rect.right);
      } else if (rect.top > 0) bottom = Math.min(bottom, rect.top);
      else top = Math.max(top, rect.bottom);
    }
    return { left, top, width: right - left, height: Math.max(bottom - top, 1) };
  }
}
