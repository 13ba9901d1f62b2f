// What makes one scene of another while its world runs: the changes of one edit, and where each of them comes from.
import type { DescMessage } from "@bufbuild/protobuf";
import {
  ColliderChangeSchema,
  ColliderSchema,
  type Joint,
  JointSchema,
  MeshSchema,
  RigidBodyChangeSchema,
  RigidBodySchema,
  type Scene,
  SoftBodyChangeSchema,
  SoftBodySchema,
  Stepping_Precision,
  SteppingSchema,
} from "../src/index.js";
import { type Change, isLive } from "./inverse_edit.js";
import type { Path } from "./json_text.js";
import { meaningOfUnset } from "./unset.js";

type Fields = Readonly<Record<string, unknown>>;

interface Named {
  readonly name: string;
}

/** A change, and where the scene that it leads to has what it is about. */
export interface Placed {
  readonly change: Change;
  readonly at: Path;
}

export interface Difference {
  readonly changes: readonly Placed[];
  /** Bodies that are not changed but put in the place of those of their names. */
  readonly anew: readonly string[];
  /** What no edit can do. */
  readonly problems: readonly { readonly at: Path; readonly what: string }[];
}

// Messages of which a change sets the fields that it names; any other value is replaced as a whole.
const merged: ReadonlySet<string> = new Set(["springs", "gas", "volume", "surface", "drag", "collision"]);

// A soft body's lists, which its change has as messages.
const listed: ReadonlySet<string> = new Set(["pins", "pinBoundary", "vertexMassScale"]);

// A mesh is replaced under its bodies, and a body under its joints: those come after it.
const kinds = [
  { list: "meshes", field: "meshes", word: "Mesh", type: MeshSchema, change: undefined },
  { list: "softBodies", field: "soft_bodies", word: "SoftBody", type: SoftBodySchema, change: SoftBodyChangeSchema },
  {
    list: "rigidBodies",
    field: "rigid_bodies",
    word: "RigidBody",
    type: RigidBodySchema,
    change: RigidBodyChangeSchema,
  },
  { list: "colliders", field: "colliders", word: "Collider", type: ColliderSchema, change: ColliderChangeSchema },
  { list: "joints", field: "joints", word: "Joint", type: JointSchema, change: undefined },
] as const;
type Kind = (typeof kinds)[number];

/** @param isSame of two parts */
function alikeInParts(a: object, b: object, isSame: (a: unknown, b: unknown) => boolean): boolean {
  if (Array.isArray(a) && Array.isArray(b)) return a.length === b.length && a.every((item, i) => isSame(item, b[i]));
  const keys = Object.keys({ ...a, ...b }).filter((key) => !key.startsWith("$"));
  return keys.every((key) => isSame((a as Fields)[key], (b as Fields)[key]));
}

function alike(a: unknown, b: unknown): boolean {
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return a === b;
  return alikeInParts(a, b, alike);
}

/** Likewise of a vector, a rotation, air, a list: what is left out of them is zero. */
function alikeOrZero(a: unknown, b: unknown): boolean {
  if (typeof a === "object" && typeof b === "object" && a && b) return alikeInParts(a, b, alikeOrZero);
  return a === b || (isZero(a) && isZero(b));
}

/** Likewise of a field; no rotation is a rotation too. */
function alikeAs(key: string, a: unknown, b: unknown): boolean {
  const turned = (value: unknown) => (key === "orientation" && isZero(value) ? { w: 1 } : value);
  return alikeOrZero(turned(a), turned(b));
}

function isZero(value: unknown): boolean {
  if (typeof value !== "object" || value === null) return !value;
  return Object.entries(value).every(([key, part]) => key.startsWith("$") || isZero(part));
}

/** A list of a factor for each vertex; an empty one is all ones, as many as the other has. */
function factorsOf(list: unknown, other: unknown): unknown[] {
  const factors = (list ?? []) as unknown[];
  return factors.length > 0 ? factors : ((other ?? []) as unknown[]).map(() => 1);
}

function placedOf(kind: string, value: unknown, at: Path): Placed {
  return { change: { change: { case: kind, value } } as Change, at };
}

class Comparison {
  readonly problems: { at: Path; what: string }[] = [];
  /** By the kind's word. */
  readonly removals: Record<string, Placed[]> = {};
  readonly additions: Record<string, Placed[]> = {};
  readonly changes: Placed[] = [];
  readonly anew: string[] = [];
  private readonly begunAnew = new Set<string>(); // bodies and meshes, by list and name

  constructor(
    private readonly before: Scene,
    private readonly after: Scene,
  ) {}

  difference(): Difference {
    this.compareWorld();
    for (const kind of kinds) this.compareList(kind);
    const of = (from: Record<string, Placed[]>, ...words: Kind["word"][]) => words.flatMap((word) => from[word] ?? []);
    const isReplaced = ({ change: { change } }: Placed) => this.begunAnew.has(`meshes ${String(change?.value)}`);
    const goneMeshes = of(this.removals, "Mesh");
    const changes = [
      ...of(this.removals, "Joint", "SoftBody", "RigidBody", "Collider"),
      ...goneMeshes.filter(isReplaced),
      ...of(this.additions, "Mesh", "SoftBody", "RigidBody", "Collider"),
      ...this.changes,
      ...of(this.additions, "Joint"),
      ...goneMeshes.filter((gone) => !isReplaced(gone)), // once no shape is of it any more
    ];
    return { changes, anew: this.anew, problems: this.problems };
  }

  private compareWorld(): void {
    const { before, after } = this;
    if (before.name !== after.name) this.problem(["name"], "a world's scene keeps its name");
    if (!alikeOrZero(before.gravity, after.gravity)) {
      this.changes.push(placedOf("setGravity", after.gravity ?? {}, ["gravity"]));
    }
    if (!alikeOrZero(before.atmosphere, after.atmosphere)) {
      this.changes.push(placedOf("setAtmosphere", after.atmosphere ?? {}, ["atmosphere"]));
    }
    const precisionOf = (scene: Scene) => scene.stepping?.precision || Stepping_Precision.DOUBLE;
    const precision = precisionOf(before);
    if (precisionOf(after) !== precision) {
      this.problem(["stepping", "precision"], "a running world keeps its precision");
    }
    const [was, is] = [before, after].map(({ stepping }) => ({ ...stepping, precision }));
    const stepping = this.fields(SteppingSchema, was, is, ["stepping"]);
    if (Object.keys(stepping).length > 0) this.changes.push(placedOf("setStepping", stepping, ["stepping"]));
  }

  private compareList(kind: Kind): void {
    const { list, field, word } = kind;
    const [was, is] = [this.before[list], this.after[list]] as [readonly Named[], readonly Named[]];
    const before = new Map(was.map((thing) => [thing.name, thing]));
    const names = new Set<string>();
    for (const [i, thing] of is.entries()) {
      const { name } = thing;
      const at = [field, i];
      if (name === "") this.problem(at, "a name is missing here");
      else if (names.has(name)) this.problem([...at, "name"], `"${name}" is there twice`);
      names.add(name);
      const earlier = before.get(name);
      if (!earlier) put(this.additions, word, placedOf(`add${word}`, thing, at));
      else if (this.beginsAnew(kind, earlier, thing)) this.replace(kind, thing, at);
      else if (kind.change && !alike(earlier, thing)) this.change(kind, earlier, thing, at);
    }
    for (const { name } of was) {
      if (!names.has(name)) put(this.removals, word, placedOf(`remove${word}`, name, [field]));
    }
  }

  private beginsAnew({ type, change }: Kind, before: Named, after: Named): boolean {
    if (this.isOnReplaced(type, before) || this.isOnReplaced(type, after)) return true;
    if (!change) return !alike(before, after);
    const changeable = new Set(change.fields.map(({ localName }) => localName as string));
    const fixed = type.fields.filter(({ localName }) => !changeable.has(localName) && !listed.has(localName));
    const [was, is] = [before, after] as unknown as [Fields, Fields];
    return fixed.some(({ localName: key }) => !alikeAs(key, was[key], is[key]));
  }

  /** Whether it is made of a mesh, or holds a body, that is replaced. */
  private isOnReplaced(type: DescMessage, thing: Named): boolean {
    const has = (list: string, name: unknown) => this.begunAnew.has(`${list} ${String(name)}`);
    if (type === JointSchema) {
      const { first, second } = thing as Joint;
      const lists = { softBody: "softBodies", rigidBody: "rigidBodies", collider: "colliders" };
      return [first?.body, second?.body].some((body) => body?.case && has(lists[body.case], body.value));
    }
    const { mesh, shape } = thing as { mesh?: string; shape?: { shape?: { case?: string; value?: unknown } } };
    const ofShape = shape?.shape?.case === "mesh" ? shape.shape.value : undefined;
    return type !== MeshSchema && has("meshes", mesh ?? ofShape);
  }

  private replace({ list, word }: Kind, thing: Named, at: Path): void {
    this.begunAnew.add(`${list} ${thing.name}`);
    if (list === "softBodies" || list === "rigidBodies") this.anew.push(thing.name);
    put(this.removals, word, placedOf(`remove${word}`, thing.name, at));
    put(this.additions, word, placedOf(`add${word}`, thing, at));
  }

  private change(kind: Kind, before: Named, after: Named, at: Path): void {
    const fields = this.fields(kind.change!, before as unknown as Fields, after as unknown as Fields, at);
    if (kind.list === "softBodies")
      this.putLists(fields, before as Scene["softBodies"][0], after as Scene["softBodies"][0]);
    if (Object.keys(fields).length > 0) {
      this.changes.push(placedOf(`change${kind.word}`, { name: after.name, ...fields }, at));
    }
  }

  private putLists(
    fields: Record<string, unknown>,
    before: Scene["softBodies"][0],
    after: Scene["softBodies"][0],
  ): void {
    const { pins: vertices, pinBoundary: boundary, vertexMassScale: scale } = after;
    if (!alike(before.pins, vertices) || before.pinBoundary !== boundary) fields["pins"] = { vertices, boundary };
    if (!alike(before.vertexMassScale, scale)) fields["vertexMassScale"] = { scale };
    if (before.gas && !after.gas) fields["removeGas"] = true;
    if (before.gas && !after.gas) delete fields["gas"];
    if (!before.gas && after.gas) fields["gas"] = after.gas;
  }

  /** Those of `type` that have to be set to come from the one to the other. */
  private fields(
    type: DescMessage,
    before: object | undefined,
    after: object | undefined,
    at: Path,
  ): Record<string, unknown> {
    const set: Record<string, unknown> = {};
    for (const field of type.fields) {
      const { localName: key, name, fieldKind } = field;
      const [was, is] = [before, after].map((fields) => (fields as Fields | undefined)?.[key]);
      if (key === "name" || listed.has(key) || alike(was, is)) continue;
      const path = [...at, name];
      if (merged.has(key)) {
        if (key === "gas" && !is) continue;
        const inner = this.fields(field.message!, was as object, is as object, path);
        if (Object.keys(inner).length > 0) set[key] = key === "volume" ? { ...(is as object), ...inner } : inner;
      } else if (fieldKind === "list") {
        const factors = factorsOf(is, was);
        if (!alike(factors, factorsOf(was, is))) set[key] = factors;
      } else if (fieldKind === "message") {
        if (!alikeAs(key, was, is)) set[key] = is ?? {};
      } else {
        const meant = (value: unknown) =>
          value || (value !== undefined && fieldKind !== "enum") ? value : meaningOfUnset[key];
        if (meant(is) === undefined) this.problem(path, `a running world cannot forget ${name}; give it a value`);
        else if (meant(was) !== meant(is)) set[key] = meant(is);
      }
    }
    return set;
  }

  private problem(at: Path, what: string): void {
    this.problems.push({ at, what });
  }
}

function put(lists: Record<string, Placed[]>, key: string, item: Placed): void {
  (lists[key] ??= []).push(item);
}

export function difference(before: Scene, after: Scene): Difference {
  return new Comparison(before, after).difference();
}

/** Without what moves by itself. */
function atRest(scene: Scene): object {
  const softBodies = scene.softBodies.map((body) => {
    if (!isLive(body.gas)) return body;
    const { moles: _, temperatureK: __, ...gas } = body.gas!;
    return { ...body, gas };
  });
  const rigidBodies = scene.rigidBodies.map((body) => {
    const { position: _, orientation: __, velocity: ___, angularVelocity: ____, ...rest } = body;
    return rest;
  });
  const colliders = scene.colliders.map((collider) => {
    const { position: _, orientation: __, ...rest } = collider;
    return rest.velocity || rest.angularVelocity ? rest : collider;
  });
  return { ...scene, softBodies, rigidBodies, colliders };
}

/** Whether somebody changed the one into the other: where things have moved to does not count. */
export function isSame(a: Scene, b: Scene): boolean {
  return alike(atRest(a), atRest(b));
}
