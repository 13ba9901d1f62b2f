// Small pictures of many worlds, drawn one after the other by one renderer: a browser has few WebGL contexts.
import { Box3, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import type { Frame } from "../src/index.js";
import { frame } from "./framing.js";
import { plain, WorldView } from "./world_view.js";

const widthPx = 168;
const heightPx = 105;

export class Thumbnails {
  private renderer: WebGLRenderer | undefined;
  private isRefused = false;
  private readonly scene = new Scene();
  private readonly scale = Math.min(devicePixelRatio, 2);

  constructor() {
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.5, 1.6, 0.7);
    this.scene.add(new HemisphereLight(0xffffff, 0x8d8271, 1.8), sun);
  }

  /** Draws a world into a canvas, which gets its size by that; nothing, where the browser has no more WebGL. */
  paint(canvas: HTMLCanvasElement, world: WorldView, camera: PerspectiveCamera): void {
    this.renderer ??= this.begin();
    if (!this.renderer) return;
    if (canvas.width !== widthPx * this.scale) {
      canvas.width = widthPx * this.scale;
      canvas.height = heightPx * this.scale;
    }
    this.scene.add(world.group);
    this.renderer.render(this.scene, camera);
    this.scene.remove(world.group);
    const context = canvas.getContext("2d")!;
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.renderer.domElement, 0, 0);
  }

  private begin(): WebGLRenderer | undefined {
    if (this.isRefused) return undefined;
    try {
      const renderer = new WebGLRenderer({ alpha: true, antialias: true });
      renderer.setPixelRatio(this.scale);
      renderer.setSize(widthPx, heightPx, false);
      return renderer;
    } catch {
      this.isRefused = true;
      return undefined;
    }
  }
}

/** A world in a canvas, as the frames come. */
export class Thumbnail {
  private readonly world = new WorldView(false);
  private readonly camera = new PerspectiveCamera(40, widthPx / heightPx, 0.01, 1000);
  private frame: Frame | undefined;
  /** What the camera looks at, with room to move in. */
  private readonly framed = new Box3();

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly thumbnails: Thumbnails,
  ) {}

  take(frame: Frame): void {
    this.frame = frame;
    this.world.update({ from: frame, to: frame, fraction: 1, resets: 0 });
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
    const { centre, radiusM } = frame(this.camera, box, { width: 0.9 * this.camera.aspect, height: 0.8 });
    this.framed.copy(box).expandByScalar(0.4 * radiusM);
    this.camera.lookAt(centre);
  }
}
