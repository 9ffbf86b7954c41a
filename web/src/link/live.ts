/**
 * The one WebSocket to the tower: opens, reconnects with back-off, reports its state, and renews subscriptions. It
 * queues nothing while it is down: delayed flight commands, carried out after a reconnection, have flown vehicles away.
 */

import { backoffMs } from './backoff';
import type { Clock } from './clock';
import { LiveMove } from './live_move';
import { focusText, pongText, viewportText, watchText, type MapBounds } from './messages';
import { personFixText, type Located } from './person_fix';
import { Store, type Readable } from './store';
import { stamped } from './tagged_frames';
import { readTowerEvent, type TowerEvent } from './wire_types';

export const SUBPROTOCOL = 'tower.v1';
export const CLOSE_SIGNED_OUT = 4401;

/** The tower sends `link` each second for each online drone: with one online, silence means a dead socket. */
const SILENCE_LIMIT_MS = 6_000;
/** While the tower pings (twice a second, to a user who flies) silence shows sooner. */
const PINGED_SILENCE_LIMIT_MS = 3_000;
const WELCOME_LIMIT_MS = 10_000;
/** Where another tower takes over, a wrong alarm costs little, and a frozen tower must be left within 3 s. */
const WITH_OTHERS = { silenceMs: 2_200, pingedSilenceMs: 1_500, welcomeMs: 2_000, firstRetryMs: 200 } as const;
/** About four stick messages. A message behind a longer queue would fly the drone late. */
const FRESH_LIMIT_BYTES = 200;

export type LivePhase = 'stopped' | 'connecting' | 'open' | 'waiting' | 'signed-out';

/** The result for a message that must not wait. */
export type Sending = 'sent' | 'skipped' | 'down';

export interface LiveState {
  readonly phase: LivePhase;
  /** Failed attempts since the last open connection. */
  readonly failures: number;
  /** When the next attempt begins, on the link clock; null if none is planned. */
  readonly retryAtMs: number | null;
  /** For `signed-out`: the tower's reason, for people. */
  readonly why: string;
}

/** The part of WebSocket in use; tests bring their own. */
export interface SocketLike {
  binaryType: string;
  /** Bytes passed to `send` that have not left the browser. */
  readonly bufferedAmount: number;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number; reason?: string }) => void) | null;
  send(data: string | Uint8Array<ArrayBuffer>): void;
  close(): void;
}

export interface LiveOptions {
  readonly clock: Clock;
  readonly openSocket: () => SocketLike;
  readonly onEvent: (event: TowerEvent) => void;
  readonly onFrames: (message: Uint8Array) => void;
  /** 0..1; spreads the reconnections of many browsers after a restart of the tower. */
  readonly random?: () => number;
}

export function liveUrl(location: { protocol: string; host: string }): string {
  return `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/api/v1/live`;
}

export class Live {
  readonly #options: LiveOptions;
  readonly #state = new Store<LiveState>({ phase: 'stopped', failures: 0, retryAtMs: null, why: '' });
  #socket: SocketLike | null = null;
  #cancelTimer: () => void = () => undefined;
  #rateHz: number | null = null;
  #focus: number | null = null;
  #shown: MapBounds | null = null;
  #expectsTraffic = false;
  #heardAtMs: number | null = null;
  #pingedAtMs = -Infinity;
  #isMoving = false;
  #hasOtherTowers = false;
  readonly #move: LiveMove;

  constructor(options: LiveOptions) {
    this.#options = options;
    const { clock, openSocket } = options;
    this.#move = new LiveMove({ clock, openSocket, onWelcome: (socket, welcome) => this.#goOn(socket, welcome) });
  }

  get state(): Readable<LiveState> {
    return this.#state;
  }

  /** When the last message from the tower arrived; null before the first. */
  get heardAtMs(): number | null {
    return this.#heardAtMs;
  }

  start(): void {
    const { phase } = this.#state.get();
    if (phase !== 'stopped' && phase !== 'signed-out') return;
    this.#heardAtMs = null;
    this.#connect(0);
  }

  stop(): void {
    this.#drop();
    this.#state.set({ phase: 'stopped', failures: 0, retryAtMs: null, why: '' });
  }

  /** Another session is about to replace ours: until `moved`, the end of the old one is no sign-out. */
  move(): void {
    this.#isMoving = true;
  }

  /** `isNew`: a new session exists, and the connection moves to it. Otherwise nothing changes. */
  moved(isNew: boolean): void {
    this.#isMoving = false;
    if (isNew || (this.#state.get().phase === 'connecting' && !this.#socket)) this.#connect(0);
  }

  /** The network is reported to be back: skips the rest of the back-off. */
  retryNow(): void {
    const { phase, failures } = this.#state.get();
    if (phase === 'waiting') this.#connect(failures);
  }

  watch(rateHz: number): void {
    this.#rateHz = rateHz;
    if (this.#isOpen()) this.#socket?.send(watchText(rateHz));
  }

  focus(droneId: number | null): void {
    this.#focus = droneId;
    if (this.#isOpen()) this.#socket?.send(focusText(droneId));
  }

  /** The area that the map shows: the tower sends drones outside it only once a second. Null without a map. */
  viewport(shown: MapBounds | null): void {
    if (JSON.stringify(shown) === JSON.stringify(this.#shown)) return;
    this.#shown = shown;
    if (this.#isOpen()) this.#socket?.send(viewportText(shown));
  }

  /**
   * Reports the position of the person at this browser, for the drone that follows them. Skipped rather than queued,
   * because it ages.
   */
  reportPlace(droneId: number, located: Located): void {
    if (!this.#isOpen() || !this.#socket || this.#socket.bufferedAmount > FRESH_LIMIT_BYTES) return;
    this.#socket.send(personFixText(droneId, located, Date.now(), this.#options.clock.monotonicMs()));
  }

  /** Whether silence is suspicious: at least one drone is online. */
  expectTraffic(expected: boolean): void {
    this.#expectsTraffic = expected;
    if (this.#isOpen()) this.#watchSilence();
  }

  /** Returns false without an open connection: the frames are lost, and the caller reports it. */
  send(message: Uint8Array<ArrayBuffer>): boolean {
    if (!this.#isOpen() || !this.#socket) return false;
    this.#socket.send(stamped(message, this.#options.clock.monotonicMs()));
    return true;
  }

  /** For data that is worthless when late (sticks): skipped while earlier messages are still queued. */
  sendFresh(message: Uint8Array<ArrayBuffer>): Sending {
    if (!this.#isOpen() || !this.#socket) return 'down';
    if (this.#socket.bufferedAmount > FRESH_LIMIT_BYTES) return 'skipped';
    return this.send(message) ? 'sent' : 'down';
  }

  #isOpen(): boolean {
    return this.#state.get().phase === 'open';
  }

  #connect(failures: number): void {
    this.#drop();
    this.#state.set({ phase: 'connecting', failures, retryAtMs: null, why: '' });
    let socket: SocketLike;
    try {
      socket = this.#options.openSocket();
    } catch {
      this.#lost(0);
      return;
    }
    this.#use(socket);
    this.#after(this.#hasOtherTowers ? WITH_OTHERS.welcomeMs : WELCOME_LIMIT_MS, () => this.#lost(0));
  }

  #use(socket: SocketLike): void {
    this.#socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => this.#received(data);
    socket.onclose = ({ code, reason }) => this.#lost(code, reason);
  }

  /** Another tower has welcomed this page: it has the page from here on. */
  #goOn(socket: SocketLike, welcome: string): void {
    const former = this.#socket;
    if (former) former.onmessage = former.onclose = null;
    this.#use(socket);
    former?.close();
    this.#received(welcome);
  }

  #received(data: unknown): void {
    if (typeof data === 'string') {
      const event = readTowerEvent(data);
      if (event?.type === 'welcome') {
        this.#hasOtherTowers = event.other_towers === true;
        this.#opened();
      }
      if (event?.type === 'leave_tower' && this.#isOpen()) this.#move.begin();
      // Answered first, before any other processing: the tower measures the round trip with it.
      if (event?.type === 'ping' && this.#isOpen()) {
        this.#socket?.send(pongText(event.sequence));
        this.#pingedAtMs = this.#options.clock.nowMs();
      }
      if (this.#isOpen()) this.#watchSilence();
      if (event && event.type !== 'ping' && event.type !== 'leave_tower') this.#options.onEvent(event);
    } else if (data instanceof ArrayBuffer && this.#isOpen()) {
      this.#watchSilence();
      this.#options.onFrames(new Uint8Array(data));
    }
  }

  /** Only a welcome opens the connection: before it the sign-in is not confirmed. */
  #opened(): void {
    this.#cancelTimer();
    this.#state.set({ phase: 'open', failures: 0, retryAtMs: null, why: '' });
    if (this.#rateHz !== null) this.#socket?.send(watchText(this.#rateHz));
    if (this.#focus !== null) this.#socket?.send(focusText(this.#focus));
    if (this.#shown !== null) this.#socket?.send(viewportText(this.#shown));
  }

  #watchSilence(): void {
    this.#cancelTimer();
    this.#heardAtMs = this.#options.clock.nowMs();
    const isPinged = this.#heardAtMs - this.#pingedAtMs < PINGED_SILENCE_LIMIT_MS;
    const [silenceMs, pingedMs] = this.#hasOtherTowers
      ? [WITH_OTHERS.silenceMs, WITH_OTHERS.pingedSilenceMs]
      : [SILENCE_LIMIT_MS, PINGED_SILENCE_LIMIT_MS];
    const limitMs = isPinged ? pingedMs : silenceMs;
    if (this.#expectsTraffic) this.#after(limitMs, () => this.#lost(0));
  }

  #lost(code: number, why = ''): void {
    const failures = this.#state.get().failures + 1;
    this.#drop();
    if (code === CLOSE_SIGNED_OUT && this.#isMoving) {
      this.#state.set({ phase: 'connecting', failures: 0, retryAtMs: null, why: '' });
      return;
    }
    if (code === CLOSE_SIGNED_OUT) {
      this.#state.set({ phase: 'signed-out', failures: 0, retryAtMs: null, why });
      return;
    }
    const isFirst = failures === 1 && this.#hasOtherTowers;
    const delayMs = isFirst
      ? WITH_OTHERS.firstRetryMs * (this.#options.random ?? Math.random)()
      : backoffMs(failures, this.#options.random);
    this.#after(delayMs, () => this.#connect(failures));
    this.#state.set({ phase: 'waiting', failures, retryAtMs: this.#options.clock.nowMs() + delayMs, why: '' });
  }

  #drop(): void {
    this.#cancelTimer();
    this.#move.stop();
    const socket = this.#socket;
    this.#socket = null;
    if (!socket) return;
    socket.onmessage = null;
    socket.onclose = null;
    socket.close();
  }

  #after(delayMs: number, callback: () => void): void {
    this.#cancelTimer();
    this.#cancelTimer = this.#options.clock.after(delayMs, callback);
  }
}

export function openBrowserSocket(): SocketLike {
  return new WebSocket(liveUrl(window.location), SUBPROTOCOL) as SocketLike;
}
