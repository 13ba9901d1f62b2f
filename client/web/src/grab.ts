// A vertex that is held, and moved.
import type { Grabbed } from "../proto/pneuma/v1/session_pb.js";
import type { Point } from "./client.js";
import type { Connection } from "./connection.js";

// So that moves alone do not use up the requests a second that a server takes.
const moveIntervalMs = 25;

/** A vertex that is held. Over when it is released, its body is gone, the world is reset, or the connection ends. */
export class Grab {
  private target: Point | undefined;
  private isMoving = false;

  constructor(
    private readonly connection: Connection,
    private readonly world: string,
    /** What was grabbed, and at which tick. */
    readonly grabbed: Grabbed,
  ) {}

  /**
   * Moves the point that it is held to. May be called as often as the pointer moves: while one target is under way the
   * newest waits, those between are left out. Rejects when the grab is over.
   */
  async moveTo(target: Point): Promise<void> {
    this.target = target;
    if (this.isMoving) return;
    this.isMoving = true;
    try {
      while (this.target) {
        const next: Point = this.target;
        this.target = undefined;
        const { grabId } = this.grabbed;
        const pause = new Promise((resolve) => setTimeout(resolve, moveIntervalMs));
        await this.connection.call({ case: "moveGrab", value: { world: this.world, grabId, target: next } }, "done");
        await pause;
      }
    } finally {
      this.isMoving = false;
    }
  }

  async release(): Promise<void> {
    this.target = undefined;
    const { grabId } = this.grabbed;
    await this.connection.call({ case: "releaseGrab", value: { world: this.world, grabId } }, "done");
  }
}
