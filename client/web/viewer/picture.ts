// The world in 3D: what a moment of its stream looks like, and what the pointer is over.
import {
  AmbientLight,
  BasicShadowMap,
  Box3,
  BufferGeometry,
  Color,
  DirectionalLight,
  Fog,
  GridHelper,
  HemisphereLight,
  type Intersection,
  Line,
  LineBasicMaterial,
  Mesh,
  PCFSoftShadowMap,
  PerspectiveCamera,
  Plane,
  Ray,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { View } from "./address.js";
import { Film } from "./film.js";
import { distanceFor, frame, type Framed, type Room } from "./framing.js";
import type { Field, Legend } from "./legend.js";
import type { Moment } from "./playback.js";
import { ShadowGauge, shadowQuality, type ShadowQuality } from "./shadow_quality.js";
import type { SoftBodyView } from "./soft_body_view.js";
import { recall, remember } from "./storage.js";
import { schemes, type Shown, WorldView } from "./world_view.js";

// Where there is no ground: a line each metre.
const gridM = 80;
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
// Of the free height: what bodies take of it, or the room that they are in. One that turns goes a half beyond.
const subjectPart = 2 / 3;
// Of what nothing lies over: some two thirds of the window, between the header and the line of time.
const widthPart = 0.9;
const heightPart = 0.85;
// The ground fades to the paper between these, in distances from the eye to what it looks at.
const fogBegin = 2;
const fogEnd = 8;
// Of the way to where a new body is in view, with each picture.
const glidePart = 0.12;
const followPart = 0.1;

const shadowsKey = "pneuma-shadows";

/** Whether a processor draws, in place of a graphics card. */
function drawsInSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const told = context.getExtension("WEBGL_debug_renderer_info");
  const name = told ? String(context.getParameter(told.UNMASKED_RENDERER_WEBGL)) : "";
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Picture {
  readonly orbit: OrbitControls;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(45, 1, 0.01, 1000);
  private readonly sun = new DirectionalLight(0xffffff, 2.2);
  private readonly rim = new DirectionalLight(0xfff4e6, 0.9); // from behind: it sets a body off from the next
  private readonly grid = new GridHelper(gridM, gridM, 0xffffff, 0xffffff);
  private readonly pull = new Line(new BufferGeometry(), new LineBasicMaterial({ depthTest: false }));
  private readonly raycaster = new Raycaster();
  private readonly world = new WorldView(true);
  private framed: Framed = { box: new Box3(), centre: new Vector3(), radiusM: 1 };
  private isFramed = false;
  private follows = true;
  private wanted: View | undefined;
  private readonly fog = new Fog(0xffffff);
  private toShow = ""; // a body that is to be brought into view once it is there
  private glide: View | undefined;
  private framedIn: Room = { width: 1, height: 1 };
  // As good as they were before the tab was loaded again: to find that out takes seconds.
  private readonly shadowGauge = new ShadowGauge(shadowQuality(recall("sessionStorage", shadowsKey)));
  private shadows: ShadowQuality = "soft";
  private readonly isSlow: boolean; // too slow for occlusion

  /** Beside `covers`, which lie over parts of the canvas. Throws where there is no WebGL. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly covers: readonly HTMLElement[],
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.isSlow = drawsInSoftware(this.renderer.getContext());
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
    this.scene.fog = this.fog;
    this.orbit.addEventListener("start", () => (this.glide = undefined));
    this.scene.add(new AmbientLight(0xffffff, 0.4), new HemisphereLight(0xffffff, 0x8d8271, 1), this.sun);
    this.scene.add(this.rim, this.rim.target);
    this.scene.add(this.sun.target, this.grid, this.pull, this.world.group);
    this.turnShadows(this.shadowGauge.quality);
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
    this.fog.color.set(scheme.paper);
    this.grid.material.color.set(scheme.grid);
    this.pull.material.color.set(scheme.ink);
    this.world.show(shown);
  }

  /** Brings the scene to a moment. */
  update(moment: Moment): void {
    this.world.update(moment);
    if (this.isFramed) {
      if (this.toShow !== "") this.bring(this.toShow);
      if (this.glide) this.glideOn(this.glide);
      else if (this.orbit.enabled && this.follows) this.follow();
      return;
    }
    this.frameAll();
    if (this.wanted) this.look(this.wanted);
    this.follows = !this.wanted; // a view that was asked for stays
  }

  draw(nowMs: number): void {
    this.shadowGauge.count(nowMs);
    const { quality } = this.shadowGauge;
    if (quality !== this.shadows) {
      this.turnShadows(quality);
      remember("sessionStorage", shadowsKey, quality);
    }
    this.orbit.update();
    const awayM = this.orbit.getDistance();
    this.fog.near = fogBegin * awayM;
    this.fog.far = fogEnd * awayM;
    this.world.occlude(this.camera);
    this.renderer.render(this.scene, this.camera);
  }

  /** Has a body that is about to come brought into view, where it is not. */
  bringIntoView(name: string): void {
    this.toShow = name;
  }

  private bring(name: string): void {
    const box = this.world.boxOf(name);
    if (!box) return;
    this.toShow = "";
    const centre = box.getCenter(new Vector3()).project(this.camera);
    const isSeen = Math.max(Math.abs(centre.x), Math.abs(centre.y)) < subjectPart && centre.z < 1;
    if (isSeen) return;
    // From where it is looked at now, as far away as all of it takes.
    const way = this.eye.sub(this.orbit.target).normalize();
    const camera = this.camera.clone();
    this.framedIn = this.room();
    this.framed = frame(camera, this.world.box().union(box), this.framedIn, way);
    this.glide = { position: camera.position.clone(), target: this.framed.centre.clone() };
    this.placeLight();
  }

  private glideOn({ position, target }: View): void {
    this.camera.position.lerp(position, glidePart);
    this.orbit.target.lerp(target, glidePart);
    if (this.camera.position.distanceTo(position) < 0.005 * this.framed.radiusM) this.glide = undefined;
  }

  /** Whether they are drawn; where pictures are too slow they are not. */
  get hasShadows(): boolean {
    return this.shadows !== "none";
  }

  private turnShadows(quality: ShadowQuality): void {
    this.shadows = quality;
    this.world.occlusion.isOn = quality === "soft" && !this.isSlow;
    const { shadowMap } = this.renderer;
    shadowMap.enabled = quality !== "none";
    shadowMap.type = quality === "soft" ? PCFSoftShadowMap : BasicShadowMap;
    this.scene.traverse((part) => {
      if (part instanceof Mesh) for (const material of [part.material].flat()) material.needsUpdate = true;
    });
  }

  /** Moves with bodies that leave what was framed, but not out of a room. */
  private follow(): void {
    if (this.world.hasRoom) return;
    const { centre, radiusM } = this.framed;
    const way = this.world.box().getCenter(new Vector3()).sub(centre);
    const past = way.length() - followPastPart * radiusM;
    if (past <= 0) return;
    way.setLength(followPart * past);
    for (const place of [
      this.camera.position,
      this.orbit.target,
      this.sun.position,
      this.sun.target.position,
      this.rim.position,
      this.rim.target.position,
      centre,
    ]) {
      place.add(way);
    }
  }

  /** Whether there is a world to look at: until then the camera is nowhere. */
  get isLooking(): boolean {
    return this.isFramed;
  }

  /** Names of the bodies that are frozen. */
  get frozen(): Set<string> {
    return this.world.frozen;
  }

  /** Turns to another world: the next moment is looked at as a whole, or from where `view` says. */
  forget(view?: View): void {
    this.world.clear();
    this.toShow = "";
    this.glide = undefined;
    this.isFramed = false;
    this.wanted = view;
  }

  /** Moves the camera so that all of the world is seen, and the light with it. */
  frameAll(): void {
    const box = this.world.box();
    this.framedIn = this.room();
    this.framed = frame(this.camera, box, this.framedIn);
    const { centre, radiusM } = this.framed;
    this.glide = undefined;
    this.orbit.target.copy(centre);

    this.grid.visible = !this.world.hasGround;
    this.grid.position.set(centre.x, box.min.y - 0.1 * radiusM, centre.z);
    this.placeLight();
    this.isFramed = true;
    this.follows = true;
  }

  /** What the world may take of the picture. */
  private room(): Room {
    const { width, height } = this.free();
    const wholePx = Math.max(this.canvas.clientHeight, 1);
    return { width: (widthPart * width) / wholePx, height: (heightPart * height) / wholePx };
  }

  private placeLight(): void {
    const { centre, radiusM } = this.framed;
    this.sun.position.copy(centre).add(new Vector3(0.5, 1.6, 0.7).setLength(3 * radiusM));
    this.sun.target.position.copy(centre);
    this.rim.position.copy(centre).add(new Vector3(-0.8, 0.7, -1));
    this.rim.target.position.copy(centre);
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -1.3 * radiusM;
    camera.right = camera.top = 1.3 * radiusM;
    camera.near = 0.1 * radiusM;
    camera.far = 6 * radiusM;
    camera.updateProjectionMatrix();
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

  /** What is seen beside the covers, as a PNG that it fills. */
  snapshot(): Promise<Blob> {
    const { camera } = this;
    const { width, height } = this.free();
    camera.zoom = Math.min(this.canvas.clientWidth / width, this.canvas.clientHeight / height);
    camera.clearViewOffset();
    this.renderer.render(this.scene, camera); // a canvas is empty but in the turn in which it was drawn
    const picture = new Promise<Blob>((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))));
    });
    camera.zoom = 1;
    this.lookBesideCovers();
    return picture;
  }

  /** What is seen from now on, as a film. Throws PneumaError UNSUPPORTED where the browser makes none. */
  film(): Film {
    return new Film(this.canvas);
  }

  private meshAt(ray: Ray): Intersection | undefined {
    const solids = this.world.solids.flatMap((solid) => (solid ? [solid.mesh] : []));
    return this.firstOn(ray, [...this.skinsOf(this.bodies), ...solids]);
  }

  private skinsOf(bodies: readonly SoftBodyView[]): Mesh[] {
    for (const { skin } of bodies) skin.geometry.computeBoundingSphere();
    return bodies.map(({ skin }) => skin);
  }

  private firstOn(ray: Ray, meshes: Mesh[]): Intersection | undefined {
    this.raycaster.ray.copy(ray);
    return this.raycaster.intersectObjects(meshes, false)[0];
  }

  /** The soft body at a place of the window. */
  pick(x: number, y: number): Hit | undefined {
    return this.hitAlong(this.rayAt(x, y), this.bodies);
  }

  /** Where this soft body's middle is seen; undefined: there is none of that name, or it has a hole there. */
  hitOn(name: string): Hit | undefined {
    const bodies = this.bodies.filter((body) => body.name === name);
    const [skin] = this.skinsOf(bodies);
    if (!skin) return undefined;
    const towards = skin.geometry.boundingSphere!.center.clone().sub(this.eye).normalize();
    return this.hitAlong(new Ray(this.eye, towards), bodies);
  }

  private hitAlong(ray: Ray, bodies: readonly SoftBodyView[]): Hit | undefined {
    const hit = this.firstOn(ray, this.skinsOf(bodies));
    const view = bodies.find(({ skin }) => skin === hit?.object);
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

  /** Draws a line from a vertex to where it is pulled; null: none. False: there is no such body. */
  showPull(pull: { body: string; vertex: number; target: Vector3 } | null): boolean {
    const view = this.bodies.find(({ name }) => name === pull?.body);
    this.pull.visible = pull !== null && view !== undefined;
    if (pull && view) this.pull.geometry.setFromPoints([new Vector3(...view.vertex(pull.vertex)), pull.target]);
    return this.pull.visible;
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
    this.lookBesideCovers();
    // What was seen whole stays so; a view that was asked for, too.
    if (this.isFramed && this.follows) this.fitAgain();
  }

  /** Has the middle of the view in the middle of the free part. */
  private lookBesideCovers(): void {
    const { clientWidth, clientHeight } = this.canvas;
    const { left, top, width, height } = this.free();
    const x = clientWidth / 2 - (left + width / 2);
    const y = clientHeight / 2 - (top + height / 2);
    this.camera.setViewOffset(clientWidth, clientHeight, x, y, clientWidth, clientHeight);
  }

  /** Goes nearer or away by as much as the room for what is framed has changed. */
  private fitAgain(): void {
    const offset = this.eye.sub(this.orbit.target);
    const way = offset.clone().normalize();
    const distanceIn = (room: Room) => distanceFor(this.framed.box, way, this.camera.fov, room);
    const room = this.room();
    offset.multiplyScalar(distanceIn(room) / distanceIn(this.framedIn));
    this.camera.position.copy(this.orbit.target).add(offset);
    this.framedIn = room;
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
    return { left, top, width: Math.max(right - left, 1), height: Math.max(bottom - top, 1) };
  }
}
