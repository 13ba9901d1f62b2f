// What the pointer does to bodies: pulls them while it is held down, or pokes them. A touch without drawing is a click.
// Keys do the same to the body that is selected.
import type { Vector3 } from "three";
import { Client, type Grab, PneumaError } from "../src/index.js";
import type { Hit, Picture } from "./picture.js";

export type Tool = "pull" | "poke" | "throw";

/** What a poke changes the speed of a whole body by, in m/s. */
const pokeSpeedMS = 2;

/** The radius of a touch, as a share of the distance to the touched point: a patch as wide as a thumb. */
const thumbShare = 0.1;

// A click goes no further, however long it takes.
const clickPx = 5;

interface Pull {
  readonly hit: Hit;
  target: Vector3;
  grab: Grab | undefined;
  isOver: boolean;
}

export interface Hands {
  readonly client: Client;
  readonly world: string;
  readonly tool: Tool;
  /** Whether bodies may be pulled and poked. */
  readonly mayTouch: boolean;
  massKg(body: string): number;
  clicked(x: number, y: number): void;
  failed(error: PneumaError): void;
}

/** Listens to the pointer over the picture; `hands` tells whose they are at the moment, undefined: nobody's. */
export class Pointer {
  private pull: Pull | undefined;
  /** Of the pointer that is down: other fingers do not count. */
  private touch: { readonly id: number; readonly x: number; readonly y: number } | undefined;

  constructor(
    private readonly picture: Picture,
    canvas: HTMLCanvasElement,
    private readonly hands: () => Hands | undefined,
  ) {
    // Before the camera's own listener, which must not turn while a body is held.
    canvas.addEventListener("pointerdown", (event) => this.down(event, canvas), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => {
      if (!this.isTouch(event)) return;
      this.letGo();
      this.click(event);
    });
    canvas.addEventListener("pointercancel", (event) => {
      if (!this.isTouch(event)) return;
      this.letGo();
      this.touch = undefined;
    });
  }

  /** To be called with each picture: the line of a pull moves with its vertex. */
  draw(): void {
    const { pull } = this;
    const isShown = this.picture.showPull(
      pull ? { body: pull.hit.body, vertex: pull.hit.vertex, target: pull.target } : null,
    );
    if (pull && !isShown) this.letGo(); // the body is gone
  }

  /** By a key: takes hold of a body, or pokes it; lets go of what is held. */
  press(hit: Hit | undefined): void {
    const hands = this.hands();
    if (this.pull) this.letGo();
    else if (hands?.mayTouch && hit) this.touchAt(hands, hit);
  }

  /** Moves what is held; false: nothing is. */
  pullBy(way: Vector3): boolean {
    if (this.pull) this.pullTo(this.pull, this.pull.target.clone().add(way));
    return this.pull !== undefined;
  }

  letGo(): void {
    this.picture.orbit.enabled = true;
    const { pull } = this;
    this.pull = undefined;
    if (!pull) return;
    pull.isOver = true;
    // A grab may be over already, by a reset or with its body.
    pull.grab?.release().catch(() => {});
  }

  private down(event: PointerEvent, canvas: HTMLCanvasElement): void {
    const hands = this.hands();
    if (!hands || !event.isPrimary || event.button !== 0) return;
    this.letGo();
    this.touch = { id: event.pointerId, x: event.clientX, y: event.clientY };
    if (hands.tool === "throw" || !hands.mayTouch) return;
    const hit = this.picture.pick(event.clientX, event.clientY);
    if (!hit) return;
    this.picture.orbit.enabled = false;
    canvas.setPointerCapture(event.pointerId);
    this.touchAt(hands, hit);
  }

  private move(event: PointerEvent): void {
    if (!this.pull || !this.isTouch(event)) return;
    this.pullTo(this.pull, this.picture.drag(event.clientX, event.clientY, this.pull.hit.point));
  }

  private pullTo(pull: Pull, target: Vector3): void {
    pull.target = target;
    pull.grab?.moveTo(target).catch(() => this.letGo());
  }

  private touchAt(hands: Hands, hit: Hit): void {
    const isPull = hands.tool === "pull";
    void (isPull ? this.hold(hands, hit) : this.poke(hands, hit)).catch(hands.failed);
  }

  private isTouch({ pointerId }: PointerEvent): boolean {
    return pointerId === this.touch?.id;
  }

  private click({ clientX, clientY }: PointerEvent): void {
    const { touch } = this;
    if (!touch) return;
    this.touch = undefined;
    const way = Math.hypot(clientX - touch.x, clientY - touch.y);
    if (way <= clickPx) this.hands()?.clicked(clientX, clientY);
  }

  private async poke({ client, world, massKg }: Hands, { body, ray, point }: Hit): Promise<void> {
    const impulse = ray.direction.clone().multiplyScalar(pokeSpeedMS * massKg(body));
    const radiusM = thumbShare * ray.origin.distanceTo(point);
    const at = { case: "ray", value: { origin: ray.origin, direction: ray.direction, radiusM } } as const;
    await client.impulse(world, { body, at, impulse });
  }

  private async hold({ client, world }: Hands, hit: Hit): Promise<void> {
    const pull: Pull = { hit, target: hit.point, grab: undefined, isOver: false };
    this.pull = pull;
    try {
      const at = { case: "vertex", value: hit.vertex } as const;
      const vertex = { body: hit.body, at, target: hit.point };
      const radiusM = thumbShare * hit.ray.origin.distanceTo(hit.point);
      const grab = await client.grab(world, { ...vertex, radiusM }).catch((error: PneumaError) => {
        if (error.code !== "LIMIT_EXCEEDED") throw error;
        return client.grab(world, vertex); // of a fine mesh, a patch has too many vertices
      });
      if (pull.isOver) return await grab.release();
      pull.grab = grab;
      await grab.moveTo(pull.target);
    } catch (error) {
      if (this.pull === pull) this.letGo();
      throw error;
    }
  }
}
