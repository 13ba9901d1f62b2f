// Small pictures of many worlds, drawn one after the other by one renderer: a browser has few WebGL contexts.
import { Box3, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import type { Frame } from "../src/index.js";
import { plain, WorldView } from "./world_view.js";

const width = 168;
const height = 105;

export class Thumbnails {
  private readonly renderer = new WebGLRenderer({ alpha: true, antialias: true });
  private readonly scene = new Scene();
  private readonly scale = Math.min(devicePixelRatio, 2);

  constructor() {
    this.renderer.setPixelRatio(this.scale);
    this.renderer.setSize(width, height, false);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.5, 1.6, 0.7);
    this.scene.add(new HemisphereLight(0xffffff, 0x8d8271, 1.8), sun);
  }

  /** Draws a world into a canvas, which gets its size by that. */
  paint(canvas: HTMLCanvasElement, world: WorldView, camera: PerspectiveCamera): void {
    if (canvas.width !== width * this.scale) {
      canvas.width = width * this.scale;
      canvas.height = height * this.scale;
    }
    this.scene.add(world.group);
    this.renderer.render(this.scene, camera);
    this.scene.remove(world.group);
    const context = canvas.getContext("2d")!;
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.renderer.domElement, 0, 0);
  }
}

/** A world in a canvas, as the frames come. */
export class Thumbnail {
  private readonly world = new WorldView();
  private readonly camera = new PerspectiveCamera(40, width / height, 0.01, 1000);
  private frame: Frame | undefined;
  /** What the camera looks at, with room to move in. */
  private readonly framed = new Box3();

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly thumbnails: Thumbnails,
  ) {}

  take(frame: Frame): void {
    this.frame = frame;
    this.world.update({ from: frame, to: frame, fraction: 1 });
    const box = this.world.box();
    if (!this.framed.containsBox(box)) this.frameAll(box);
    this.thumbnails.paint(this.canvas, this.world, this.camera);
  }

  show(dark: boolean): void {
    this.world.show({ ...plain, dark });
    if (this.frame) this.thumbnails.paint(this.canvas, this.world, this.camera);
  }

  /** Holds nothing any more; what was drawn last stays in the canvas. */
  clear(): void {
    this.frame = undefined;
    this.framed.makeEmpty();
    this.world.clear();
  }

  private frameAll(box: Box3): void {
    const centre = box.getCenter(new Vector3());
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, 0.1);
    this.framed.copy(box).expandByScalar(0.4 * radius);
    const far = (0.95 * radius) / Math.sin((this.camera.fov * Math.PI) / 360);
    this.camera.position.copy(new Vector3(0.45, 0.35, 1).setLength(far).add(centre));
    this.camera.near = far / 200;
    this.camera.far = 20 * far;
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(centre);
  }
}
