// A subscription: what is in its world, and its frames.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import type {
  Frame as FrameMessage,
  Gap,
  Layout as LayoutMessage,
  Layout_Joint_End as JointEndMessage,
  Mechanics as MechanicsMessage,
  Scalars,
  Topology,
} from "../proto/pneuma/v1/frame_pb.js";
import {
  type Mesh_Triangles,
  QuaternionSchema,
  type Quaternion,
  type Shape,
  type Vec3,
  Vec3Schema,
} from "../proto/pneuma/v1/scene_pb.js";
import type { Applied, Subscribed, SubscribeSchema } from "../proto/pneuma/v1/session_pb.js";
import type { Triangles } from "./codec/mesh_order.js";
import type { Mechanics } from "./codec/simulated_motion.js";
import type { FrameDecoder } from "./decoder.js";
import { callUser, PneumaError } from "./errors.js";

function surfaceOf({ positions, indices }: Mesh_Triangles): SolidSurface {
  if (indices.some((index) => index >= positions.length)) {
    throw new PneumaError("MALFORMED", "a surface names a vertex that it does not have", "layout");
  }
  return {
    positions: Float32Array.from(positions.flatMap(({ x, y, z }) => [x, y, z])),
    indices: Uint32Array.from(indices),
  };
}

/** The fields of `Subscribe` but those that the library sets; proto/pneuma/v1/session.proto says what each is. */
export type SubscribeOptions = Omit<
  MessageInitShape<typeof SubscribeSchema>,
  "$typeName" | "world" | "knownTopologies"
>;

export interface Mesh extends Triangles {
  /** Of its content, in hexadecimal. */
  readonly hash: string;
  readonly vertexCount: number;
  /** Three a face, counter-clockwise seen from outside. */
  readonly indices: Uint32Array;
}

/** What a stream's frames speak of; a new one comes when something is added or removed. */
export interface Layout {
  readonly softBodies: readonly {
    readonly name: string;
    readonly mesh: Mesh;
    /** With `levelOfDetail` asked for: which of the whole mesh's vertices this one's are; empty: all. */
    readonly keptVertices: readonly number[];
  }[];
  /** Rigid bodies and colliders. */
  readonly solids: readonly {
    readonly name: string;
    readonly shape: Shape | undefined;
    readonly isDynamic: boolean;
    /** Of a shape that names a mesh: its triangles, in its own frame. */
    readonly surface?: SolidSurface | undefined;
  }[];
  /** Those whose soft bodies the stream holds. */
  readonly joints: readonly Joint[];
}

export interface SolidSurface {
  /** x y z of each vertex, in metres. */
  readonly positions: Float32Array;
  /** Three a face. */
  readonly indices: Uint32Array;
}

export interface Joint {
  readonly name: string;
  readonly first: JointEnd;
  readonly second: JointEnd;
  readonly isRope: boolean;
}

/** A point of a soft body, of a solid, or where both are undefined of the world. */
export interface JointEnd {
  /** Its place in the layout's `softBodies`. */
  readonly soft: number | undefined;
  readonly solid: number | undefined;
  /** Of the soft body's whole mesh, with their weights. */
  readonly vertices: readonly number[];
  readonly weights: readonly number[];
  /** In the solid's own frame, or the world's. */
  readonly point: Vec3;
}

export interface SolidPose {
  readonly position: Vec3; // m
  readonly orientation: Quaternion;
}

export interface Frame {
  readonly layout: Layout;
  readonly tick: number;
  readonly timeS: number;
  readonly isKey: boolean;
  /** Size of the message on the wire. */
  readonly bytes: number;
  /** By soft body of the layout: x y z of each vertex, in metres, within the stream's `maxErrorM` of its true place. */
  readonly positions: readonly Float64Array[];
  /** With `velocities` asked for: by soft body as the positions, in m/s. */
  readonly velocities: readonly Float64Array[] | undefined;
  /** By solid of the layout. */
  readonly poses: readonly SolidPose[];
  /** With `scalars` asked for: lists with one number a soft body. */
  readonly scalars: Scalars | undefined;
  /** With `contacts` asked for: the vertices that are held off something. */
  readonly contacts: readonly Contact[];
}

export interface Contact {
  /** The body that the vertex is of: its place in the layout's `softBodies`. */
  readonly soft: number;
  /** Of the whole mesh, whatever the level of detail. */
  readonly vertex: number;
  /** Its place in the layout; both undefined: a soft body that the stream does not hold. */
  readonly otherSoft: number | undefined;
  readonly otherSolid: number | undefined;
  /** Of length 1, out of the other. */
  readonly normal: Vec3;
}

/** What a frame leaves for those that build on it. */
interface Held {
  readonly tick: bigint;
  readonly timeS: number;
  readonly poses: readonly SolidPose[];
}
const layersMax = 3;

/** Where a stream's frames come from: a connection. */
export interface Feed {
  /** What came cannot be read. */
  failed(error: PneumaError): void;
  /** More comes than is decoded: nothing is wanted until `caughtUp`, and a key frame then. */
  behind(caughtUp: Promise<unknown>): void;
  /** The vertices have gone wrong: only a key frame is of use. */
  keyWanted(): void;
}

export interface StreamListener {
  /** Frames come in order; those of a Gap do not come. */
  frame(frame: Frame): void;
  /**
   * Frames of these ticks are left out, because this client read or decoded too slowly; a key frame follows. Where it decoded
   * too slowly, what was applied meanwhile is left out, too.
   */
  gap?(fromTick: number, toTick: number): void;
  /**
   * A frame left vertices that are not the server's, as its check tells. It is left out, and so are those up to the key
   * frame that was asked for.
   */
  fault?(error: PneumaError): void;
  /** With `commands` asked for: a change of the world was carried out. */
  applied?(applied: Applied): void;
  /** The stream is over: its world is gone, or it was closed. */
  ended?(error: PneumaError): void;
}

// As the server's own, which no sound stream is past: proto/WIRE.md, "Limits".
const meshVerticesMax = 65_536;
const meshIndicesMax = 3 * 262_144;
const worldVerticesMax = 262_144;

// Between two requests for a key frame of a stream. One that always decodes wrong is shown by its key frames alone.
const keyRequestIntervalMs = 1_000;

const maxErrorMDefault = 0.001; // of Subscribe.max_error_m

function hexadecimal(bytes: Uint8Array): string {
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** The meshes that a client holds, by their hash, over all its streams and connections. */
export class MeshStore {
  private readonly meshes = new Map<string, { mesh: Mesh; hash: Uint8Array }>();

  /** Throws PneumaError MALFORMED for what is no mesh. */
  add({ hash, vertexCount, indices }: Topology): void {
    if (vertexCount > meshVerticesMax || indices.length > meshIndicesMax) {
      throw new PneumaError("MALFORMED", "larger than any mesh may be", "topology");
    }
    if (indices.length % 3 !== 0 || indices.some((index) => index >= vertexCount)) {
      throw new PneumaError("MALFORMED", "indices that are no faces of its vertices", "topology.indices");
    }
    const name = hexadecimal(hash);
    this.meshes.set(name, { mesh: { hash: name, vertexCount, indices: Uint32Array.from(indices) }, hash });
  }

  get(hash: Uint8Array): Mesh {
    const held = this.meshes.get(hexadecimal(hash));
    if (!held) throw new PneumaError("MALFORMED", "a mesh that was never sent", "layout");
    return held.mesh;
  }

  hashes(): Uint8Array[] {
    return [...this.meshes.values()].map(({ hash }) => hash);
  }
}

function byBody(layout: Layout, all: Float64Array): Float64Array[] {
  let begin = 0;
  return layout.softBodies.map(({ mesh }) => {
    const end = begin + 3 * mesh.vertexCount;
    const own = all.subarray(begin, end);
    begin = end;
    return own;
  });
}

/** What makes two subscriptions of a world one stream: all but the wishes. proto/WIRE.md, "Streams". */
function kindOf(options: SubscribeOptions): string {
  const { rateHz, maxErrorM, bodies, levelOfDetail, velocities, scalars, contacts, timeLayers, simulated } = options;
  const marks = [velocities, scalars, contacts, timeLayers, simulated].map((mark) => mark ?? false);
  return JSON.stringify([
    rateHz ?? 0,
    maxErrorM || maxErrorMDefault,
    [...(bodies ?? [])].sort(),
    levelOfDetail ?? 0,
    marks,
  ]);
}

function mechanicsOf(message: MechanicsMessage): Mechanics {
  const { frameS, substeps, massesKg, restLengthsM, stiffnessesNM, dampingNSM, gas, gravityMS2, planes } = message;
  const listOf = (vector: Vec3 | undefined) => [vector?.x ?? 0, vector?.y ?? 0, vector?.z ?? 0];
  return {
    frameS,
    substeps,
    massesKg,
    restLengthsM,
    stiffnessesNM,
    dampingNSM,
    gas: {
      pressurePa: gas?.pressurePa ?? 0,
      volumeM3: gas?.volumeM3 ?? 1,
      exponent65536ths: gas?.exponent65536ths ?? 65536,
      outsidePa: gas?.outsidePa ?? 0,
    },
    gravityMS2: listOf(gravityMS2),
    planes: planes.map(({ normal, offsetM, restitution, friction }) => {
      return { normal: listOf(normal), offsetM, restitution, friction };
    }),
  };
}

const noLayout: Layout = { softBodies: [], solids: [], joints: [] };

/** Of Client.subscribe. It outlives a connection that is restored: its next frame is then a key frame. */
export class Stream {
  private layoutId = 0;
  private held: (Held | undefined)[] = [];
  private posesAtFirst: readonly SolidPose[] = [];
  private layout_ = noLayout;
  private info: Subscribed | undefined;
  private feed: Feed | undefined;
  /** What the decoder was begun with. */
  private begunWith = "";
  /** The first tick that was left out, since the last frame that was not. */
  private leftOutFrom: number | undefined;
  /** How many key frames came, and how many had come before the frame that was found wrong last. */
  private keys = 0;
  private wrongSinceKey: number | undefined;
  private keyWantedAtMs = -Infinity;
  private isOver_ = false;
  private told: Promise<unknown> = Promise.resolve();

  // In the decoder, which keeps places and velocities apart.
  private readonly placesKey: number;
  private readonly velocitiesKey: number;

  constructor(
    readonly world: string,
    readonly options: SubscribeOptions,
    readonly listener: StreamListener,
    ordinal: number,
    private readonly decoder: FrameDecoder,
    private readonly meshes: MeshStore,
  ) {
    this.placesKey = 2 * ordinal;
    this.velocitiesKey = 2 * ordinal + 1;
  }

  /** What the server has agreed to: rate, error bound. While the connection is lost, as it was before. */
  get subscribed(): Subscribed {
    if (!this.info) throw new PneumaError("FAILED_PRECONDITION", "not subscribed");
    return this.info;
  }

  get layout(): Layout {
    return this.layout_;
  }

  get isOver(): boolean {
    return this.isOver_;
  }

  /** Whether the server would take them for one; it may find others alike, as it rounds rates. */
  isLike(other: Stream): boolean {
    return this.world === other.world && kindOf(this.options) === kindOf(other.options);
  }

  /** It was accepted: the frames of `info.streamId` are its own. */
  begin(info: Subscribed, feed: Feed): void {
    this.info = info;
    this.feed = feed;
    this.held = [];
    ++this.keys;
  }

  setRate(rateHz: number): void {
    if (this.info) this.info.rateHz = rateHz;
  }

  takeLayout(message: LayoutMessage): void {
    const softBodies = message.softBodies.map(({ name, topologyHash, keptVertices }) => {
      return { name, mesh: this.meshes.get(topologyHash), keptVertices };
    });
    if (softBodies.reduce((sum, { mesh }) => sum + mesh.vertexCount, 0) > worldVerticesMax) {
      throw new PneumaError("MALFORMED", "more vertices than any world may hold", "layout");
    }
    const solids = message.solids.map(({ name, shape, dynamic, surface }) => {
      return { name, shape, isDynamic: dynamic, surface: surface && surfaceOf(surface) };
    });
    const endOf = (end: JointEndMessage | undefined): JointEnd => {
      const { body, vertices = [], weights = [], point } = end ?? {};
      const soft = body?.case === "soft" ? body.value : undefined;
      const solid = body?.case === "solid" ? body.value : undefined;
      if ((soft ?? -1) >= softBodies.length || (solid ?? -1) >= solids.length || vertices.length !== weights.length) {
        throw new PneumaError("MALFORMED", "a joint on nothing that was told", "layout");
      }
      return { soft, solid, vertices, weights, point: point ?? create(Vec3Schema) };
    };
    const joints = message.joints.map(({ name, first, second, rope }) => {
      return { name, first: endOf(first), second: endOf(second), isRope: rope };
    });
    this.layout_ = { softBodies, solids, joints };
    this.layoutId = message.layoutId;
    this.held = [];
    const nowhere = { position: create(Vec3Schema), orientation: create(QuaternionSchema, { w: 1 }) };
    this.posesAtFirst = solids.map(() => nowhere);
    const { gridStepM, velocityGridStepMS } = this.subscribed;
    const meshes = softBodies.map(({ mesh }) => mesh);
    const mechanics = message.softBodies.map((body) => body.mechanics && mechanicsOf(body.mechanics));
    // The same again, of a stream that begins anew: its key frame alone sets the decoder right.
    const begunWith = JSON.stringify([meshes.map(({ hash }) => hash), gridStepM, velocityGridStepMS, mechanics]);
    if (begunWith === this.begunWith) return;
    this.begunWith = begunWith;
    this.decoder.begin(this.placesKey, meshes, gridStepM, mechanics);
    if (this.options.velocities) this.decoder.begin(this.velocitiesKey, meshes, velocityGridStepMS);
  }

  takeFrame(message: FrameMessage, bytes: number): void {
    const { layoutId, tick, baseTick, payload, scalars, layer, check, velocitiesCheck } = message;
    const { feed } = this;
    if (baseTick === undefined) ++this.keys;
    if (this.wrongSinceKey === this.keys) return this.wantKey();
    const { keys } = this;
    if (this.decoder.isBehind(this.placesKey)) {
      this.leftOutFrom ??= Number(tick);
      return feed?.behind(this.told);
    }
    const isOfBase = baseTick !== undefined && layoutId === 0;
    if (!isOfBase && layoutId !== this.layoutId)
      throw new PneumaError("MALFORMED", "a frame of a layout that was not sent");
    const base = this.baseOf(message);
    const poses = this.posesOf(message, base);
    const contacts = this.contactsOf(message);
    const timeS = this.timeOf(message, base);
    this.held[layer] = { tick, timeS, poses };
    const layout = this.layout_;
    const isKey = base === undefined;
    this.tellLeftOut(Number(tick));
    const decoded = Promise.all([
      this.decoder.decode(this.placesKey, payload, base, layer, check),
      this.options.velocities
        ? this.decoder.decode(this.velocitiesKey, message.velocities, base, layer, velocitiesCheck)
        : undefined,
    ]).then(
      ([places, speeds]) =>
        () => {
          const positions = byBody(layout, places);
          const velocities = speeds && byBody(layout, speeds);
          this.listener.frame({
            layout,
            tick: Number(tick),
            timeS,
            isKey,
            bytes,
            positions,
            velocities,
            poses,
            scalars,
            contacts,
          });
        },
      (error) => () => {
        if (!(error instanceof PneumaError)) feed?.failed(new PneumaError("INTERNAL", String(error)));
        else if (error.code === "WRONG_STATE") this.takeFault(error, Number(tick), keys);
        else feed?.failed(error);
      },
    );
    this.tell(decoded);
  }

  takeGap({ fromTick, toTick }: Gap): void {
    this.tell(() => this.listener.gap?.(Number(fromTick), Number(toTick)));
  }

  takeApplied(applied: Applied): void {
    this.tell(() => this.listener.applied?.(applied));
  }

  end(error: PneumaError): void {
    if (this.isOver_) return;
    this.isOver_ = true;
    this.decoder.end(this.placesKey);
    if (this.options.velocities) this.decoder.end(this.velocitiesKey);
    callUser(() => this.listener.ended?.(error));
  }

  /** @param keys how many key frames had come when the frame did */
  private takeFault({ code, what, where }: PneumaError, tick: number, keys: number): void {
    if (this.wrongSinceKey === keys) return; // it was told, and this frame was under way
    this.wrongSinceKey = keys;
    if (keys === this.keys) this.wantKey();
    this.listener.fault?.(new PneumaError(code, `${what} (tick ${tick})`, where));
  }

  private wantKey(): void {
    const nowMs = performance.now();
    if (nowMs - this.keyWantedAtMs < keyRequestIntervalMs) return;
    this.keyWantedAtMs = nowMs;
    this.feed?.keyWanted();
  }

  private tellLeftOut(nextTick: number): void {
    const from = this.leftOutFrom;
    if (from === undefined) return;
    this.leftOutFrom = undefined;
    this.tell(() => this.listener.gap?.(from, Math.max(from, nextTick - 1)));
  }

  /** Calls the listener in the order of these calls, whenever what there is to tell is ready. */
  private tell(notice: (() => void) | Promise<() => void>): void {
    const turn = this.told.then(() => notice);
    void turn.then((notify) => {
      if (!this.isOver) callUser(notify);
    });
    this.told = turn;
  }

  /** The layer whose last frame this one builds on; undefined of a key frame. */
  private baseOf({ baseTick, layer }: FrameMessage): number | undefined {
    if (layer >= layersMax || (baseTick === undefined && layer > 0)) {
      throw new PneumaError("MALFORMED", `a frame of layer ${layer}, which it cannot be of`);
    }
    if (baseTick === undefined) return undefined;
    // Of a lower layer, or both are of the lowest.
    const base = this.held.slice(0, Math.max(layer, 1)).findIndex((held) => held?.tick === baseTick);
    if (base < 0) throw new PneumaError("MALFORMED", `a frame on top of tick ${baseTick}, which is not held`);
    return base;
  }

  private contactsOf({ contacts }: FrameMessage): readonly Contact[] {
    const { softBodies, solids } = this.layout_;
    return contacts.map(({ soft, vertex, other, normal }) => {
      const otherSoft = other.case === "otherSoft" ? other.value : undefined;
      const otherSolid = other.case === "otherSolid" ? other.value : undefined;
      if (Math.max(soft, otherSoft ?? 0) >= softBodies.length || (otherSolid ?? -1) >= solids.length) {
        throw new PneumaError("MALFORMED", "a contact of a body that there is not");
      }
      const { mesh, keptVertices } = softBodies[soft]!;
      // Of a mesh of which only some vertices are shown, the size is not known.
      if (vertex >= (keptVertices.length === 0 ? mesh.vertexCount : meshVerticesMax)) {
        throw new PneumaError("MALFORMED", `a contact of vertex ${vertex}, which there is not`);
      }
      const out = normal ?? create(Vec3Schema);
      if (![out.x, out.y, out.z].every(Number.isFinite)) {
        throw new PneumaError("MALFORMED", "a contact's normal that is not finite");
      }
      return { soft, vertex, otherSoft, otherSolid, normal: out };
    });
  }

  private timeOf({ tick, baseTick, timeS }: FrameMessage, base: number | undefined): number {
    if (timeS !== undefined || base === undefined) return timeS ?? 0;
    return this.held[base]!.timeS + Number(tick - baseTick!) * this.subscribed.tickS;
  }

  private posesOf({ poses }: FrameMessage, base: number | undefined): readonly SolidPose[] {
    const before = base === undefined ? this.posesAtFirst : this.held[base]!.poses;
    if (poses.length === 0) return before;
    const next = before.slice();
    for (const { solid, position, orientation } of poses) {
      if (solid >= next.length) throw new PneumaError("MALFORMED", `a pose of solid ${solid}, which there is not`);
      next[solid] = {
        position: position ?? create(Vec3Schema),
        orientation: orientation ?? create(QuaternionSchema, { w: 1 }),
      };
    }
    return next;
  }
}
