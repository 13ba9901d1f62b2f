// One connection to a server: requests that wait for their replies, and what comes unasked. proto/WIRE.md says in which
// order.
import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import {
  type ClientMessage,
  ClientMessageSchema,
  type Error as ErrorReply,
  Error_Code,
  type ServerMessage,
  ServerMessageSchema,
  type Welcome,
} from "../proto/pneuma/v1/session_pb.js";
import { type ErrorCode, PneumaError } from "./errors.js";
import { openSocket, type Socket } from "./socket.js";

export const protocolVersion = 1;
// The server pings every 15 s: two are missing.
const silenceMs = 40_000;
// What a server takes of who it has not welcomed.
const helloBytesMax = 4096;
// Of a part, at most: ids, lengths and the flag.
const partHeadBytes = 32;

type Message<T extends { case: unknown }> = Exclude<T, { case: undefined }>;
type Value<T, Case> = Extract<T, { case: Case }> extends { value: infer V } ? V : never;
/** A request's kind, the name of its field in ClientMessage. */
export type RequestKind = Message<ClientMessage["request"]>["case"];
export type Request = Message<NonNullable<MessageInitShape<typeof ClientMessageSchema>["request"]>>;
export type ReplyKind = Message<ServerMessage["message"]>["case"];
export type Reply<Kind extends ReplyKind> = Value<ServerMessage["message"], Kind>;
/** What comes unasked. */
export type Update = Message<ServerMessage["message"]>;

export interface ConnectionOptions {
  readonly token: string;
  readonly clientName: string;
  readonly connectTimeoutMs: number;
  readonly replyTimeoutMs: number;
  readonly openSocket?: (url: string) => Promise<Socket>;
  /** Called in the order of arrival, with the message as it was received. */
  readonly update: (message: Update, bytes: Uint8Array) => void;
  /** Called once when the connection has ended, with why. */
  readonly ended: (error: PneumaError) => void;
}

interface Waiting {
  settle(message: Update): void;
  reject(error: PneumaError): void;
  timer?: ReturnType<typeof setTimeout>;
}

function errorOf(reply: ErrorReply): PneumaError {
  const code = reply.code === Error_Code.CODE_UNSPECIFIED ? "INTERNAL" : (Error_Code[reply.code] ?? "INTERNAL");
  return new PneumaError(code as ErrorCode, reply.what, reply.where, reply.retryAfterS || undefined);
}

function bytesOf(requestId: bigint, request: Request): Uint8Array {
  return toBinary(ClientMessageSchema, create(ClientMessageSchema, { requestId, request }));
}

export class Connection {
  private readonly waiting = new Map<bigint, Waiting>();
  private nextId = 1n;
  private heardAt = Date.now();
  private readonly watch: ReturnType<typeof setInterval>;
  private error: PneumaError | undefined;
  welcome!: Welcome;

  private constructor(
    private readonly socket: Socket,
    private readonly options: ConnectionOptions,
  ) {
    this.watch = setInterval(() => {
      if (Date.now() - this.heardAt > silenceMs) this.end(new PneumaError("UNAVAILABLE", "the server has gone silent"));
    }, silenceMs / 4);
  }

  /** Connects and says hello. Throws PneumaError; `ended` is not called then. */
  static async open(url: string, options: ConnectionOptions): Promise<Connection> {
    const socket = await (options.openSocket ?? openSocket)(url);
    let timer: ReturnType<typeof setTimeout> | undefined;
    try {
      await new Promise<void>((resolve, reject) => {
        const fail = () => reject(new PneumaError("UNAVAILABLE", `cannot connect to ${url}`));
        socket.onopen = resolve;
        socket.onerror = fail;
        socket.onclose = fail;
        timer = setTimeout(fail, options.connectTimeoutMs);
      });
    } catch (error) {
      socket.close();
      throw error;
    } finally {
      clearTimeout(timer);
    }
    let isWelcome = false;
    const connection = new Connection(socket, {
      ...options,
      ended: (error) => {
        if (isWelcome) options.ended(error);
      },
    });
    socket.onerror = () => {}; // `close` follows; in `ws`, an error that nobody hears ends the program
    socket.onclose = () => connection.end(new PneumaError("UNAVAILABLE", "the connection broke"));
    socket.onmessage = ({ data }) => connection.take(data);
    try {
      const hello = { protocolVersion, token: options.token, clientName: options.clientName };
      connection.welcome = await connection.call({ case: "hello", value: hello }, "welcome");
      if (connection.error) throw connection.error; // it said goodbye in the same breath
      isWelcome = true;
      return connection;
    } catch (error) {
      connection.end(error as PneumaError);
      throw error;
    }
  }

  /**
   * Sends a request and waits for its reply.
   * @param accepted takes the reply before any message that comes after it, and also one that comes too late
   * @param timeoutMs of each of its parts, where it goes in parts; 0: as long as the connection lasts
   */
  async call<Kind extends ReplyKind>(
    request: Request,
    expected: Kind,
    accepted?: (reply: Reply<Kind>) => void,
    timeoutMs = this.options.replyTimeoutMs,
  ): Promise<Reply<Kind>> {
    if (this.error) throw this.error;
    const requestId = this.nextId++;
    const messages = this.cut(requestId, request);
    return new Promise((resolve, reject) => {
      const settle = (message: Update) => {
        if (message.case === "error") return reject(errorOf(message.value));
        if (message.case !== expected) {
          return reject(new PneumaError("MALFORMED", `a reply of the kind ${message.case}`, request.case));
        }
        const reply = message.value as Reply<Kind>;
        accepted?.(reply);
        resolve(reply);
      };
      const waiting: Waiting = { settle, reject };
      if (timeoutMs > 0) {
        const allMs = timeoutMs * messages.length;
        waiting.timer = setTimeout(() => {
          reject(new PneumaError("UNAVAILABLE", `no reply in ${allMs / 1000} s`, request.case));
        }, allMs);
      }
      this.waiting.set(requestId, waiting);
      for (const message of messages) this.socket.send(message);
    });
  }

  /** Ends the connection; what still waits is rejected with `error`. */
  end(error: PneumaError): void {
    if (this.error) return;
    this.error = error;
    clearInterval(this.watch);
    this.socket.onclose = null;
    this.socket.onmessage = null;
    this.socket.close();
    for (const { reject, timer } of this.waiting.values()) {
      clearTimeout(timer);
      reject(error);
    }
    this.waiting.clear();
    this.options.ended(error);
  }

  /** As the server takes it: whole, or in parts. Throws PneumaError where it takes it in neither way. */
  private cut(requestId: bigint, request: Request): Uint8Array[] {
    const whole = bytesOf(requestId, request);
    const { messageBytesMax, partsBytesMax } = this.welcome ?? { messageBytesMax: helloBytesMax, partsBytesMax: 0 };
    if (whole.length <= messageBytesMax) return [whole];
    const partBytes = messageBytesMax - partHeadBytes;
    if (whole.length > partsBytesMax || partBytes <= 0) {
      const bytesMax = Math.max(messageBytesMax, partsBytesMax);
      throw new PneumaError("LIMIT_EXCEEDED", `a request of ${whole.length} bytes; the server takes ${bytesMax}`);
    }
    const parts: Uint8Array[] = [];
    for (let begin = 0; begin < whole.length; begin += partBytes) {
      const end = begin + partBytes;
      const part = { data: whole.subarray(begin, end), last: end >= whole.length };
      parts.push(bytesOf(requestId, { case: "part", value: part }));
    }
    return parts;
  }

  private take(data: unknown): void {
    this.heardAt = Date.now();
    if (!(data instanceof ArrayBuffer)) return this.end(new PneumaError("MALFORMED", "a message of text"));
    const bytes = new Uint8Array(data);
    let message: ServerMessage;
    try {
      message = fromBinary(ServerMessageSchema, bytes);
    } catch {
      return this.end(new PneumaError("MALFORMED", "bytes that are no message"));
    }
    const update = message.message;
    if (update.case === undefined) return; // of a kind that a later server knows
    if (message.requestId !== 0n) {
      const waiting = this.waiting.get(message.requestId);
      this.waiting.delete(message.requestId);
      clearTimeout(waiting?.timer);
      waiting?.settle(update);
    } else if (update.case === "ping") {
      this.socket.send(bytesOf(this.nextId++, { case: "pong", value: { nonce: update.value.nonce } }));
    } else if (update.case === "goodbye") {
      const { reason } = update.value;
      this.end(reason ? errorOf(reason) : new PneumaError("UNAVAILABLE", "the server said goodbye"));
    } else {
      this.options.update(update, bytes);
    }
  }
}
