// Small pictures of many worlds, drawn one after the other by one renderer: a browser has few WebGL contexts.
import { DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import type { Frame } from "../src/index.js";
import { frame } from "./framing.js";
import { plain, WorldView } from "./world_view.js";

const widthPx = 168;
const heightPx = 105;
const room = { width: (0.9 * widthPx) / heightPx, height: 0.8 };

export class Thumbnails {
  private renderer: WebGLRenderer | undefined;
  private isRefused = false;
  private readonly scene = new Scene();
  private readonly world = new WorldView(false);
  private readonly camera = new PerspectiveCamera(40, widthPx / heightPx, 0.01, 1000);
  private readonly scale = Math.min(devicePixelRatio, 2);

  constructor() {
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.5, 1.6, 0.7);
    this.scene.add(new HemisphereLight(0xffffff, 0x8d8271, 1.8), sun, this.world.group);
  }

  /** Draws a frame into a canvas, which gets its size by that; nothing, where the browser has no more WebGL. */
  paint(canvas: HTMLCanvasElement, shown: Frame, dark: boolean): void {
    this.renderer ??= this.begin();
    if (!this.renderer) return;
    if (canvas.width !== widthPx * this.scale) {
      canvas.width = widthPx * this.scale;
      canvas.height = heightPx * this.scale;
    }
    this.world.show({ ...plain, dark });
    this.world.update({ from: shown, to: shown, fraction: 1, resets: 0 });
    this.camera.lookAt(frame(this.camera, this.world.box(), room).centre);
    this.renderer.render(this.scene, this.camera);
    this.world.clear();
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
