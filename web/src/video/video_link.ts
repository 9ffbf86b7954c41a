/**
 * The WebSocket of one drone's video: opens, reconnects with back-off as the live link does, queries the tower's clock,
 * and reports what was decoded. Independent of pictures. It runs in the worker, so that no picture and no answer waits
 * for the page.
 */

import { backoffMs } from '../link/backoff';
import type { Clock } from '../link/clock';
import type { SocketLike } from '../link/live';
import { GotCadence, type Done, type Got } from './got_cadence';
import { TowerClock } from './tower_clock';
import { readUnit, type Unit } from './unit';
import { TOWER_STATES, type CodecName, type QualityName, type TowerState } from './video_types';

export const SUBPROTOCOL = 'tower-video.v1';

/** The tower refused. That changes when a user gives the view back, or signs in again: no hurry. */
const REFUSED_RETRY_MS = 5_000;
/** The tower answers each clock request, so silence means a dead socket. */
const SILENCE_LIMIT_MS = 6_000;
const CLOCK_FIRST_MS = 100;
const CLOCK_FIRST_QUESTIONS = 5;
const CLOCK_EVERY_MS = 2_000;
/** Interval while pictures arrive, which prove just as well that the connection is alive. */
const CLOCK_AT_LAST_MS = 10_000;

const REFUSALS = new Set([4400, 4401, 4403, 4404, 4430]);

export type LinkPhase = 'stopped' | 'connecting' | 'open' | 'waiting' | 'refused';

export interface LinkState {
  readonly phase: LinkPhase;
  readonly failures: number;
  /** By the link's clock; null if no attempt is planned. */
  readonly retryAtMs: number | null;
  /** For `refused`: the tower's reason, for people. */
  readonly why: string;
}

export interface TowerSays {
  readonly state: TowerState;
  readonly words: string;
  readonly codecs: readonly CodecName[];
}

export interface StreamRequest {
  readonly quality: QualityName;
  readonly codec: CodecName;
  /** Preferred codec if the drone has it: the tower knows that before we do. */
  readonly rather?: CodecName;
}

export interface VideoLinkOptions {
  readonly clock: Clock;
  readonly openSocket: (request: StreamRequest) => SocketLike;
  readonly onLink: (state: LinkState) => void;
  readonly onTower: (says: TowerSays) => void;
  readonly onUnit: (unit: Unit, bytes: number) => void;
  readonly onSkipped: (count: number) => void;
  /** 0..1; spreads the reconnections of many browsers after a restart of the tower. */
  readonly random?: () => number;
}

export function videoUrl(page: { protocol: string; host: string }, droneId: number, request: StreamRequest): string {
  const scheme = page.protocol === 'https:' ? 'wss' : 'ws';
  const codecs = request.rather ? `${request.rather},${request.codec}` : request.codec;
  return `${scheme}://${page.host}/api/v1/drones/${droneId}/video?quality=${request.quality}&codec=${codecs}`;
}

export class VideoLink {
  readonly #options: VideoLinkOptions;
  readonly clock = new TowerClock();
  #request: StreamRequest;
  #state: LinkState = { phase: 'stopped', failures: 0, retryAtMs: null, why: '' };
  #socket: SocketLike | null = null;
  #cancelTimer: () => void = () => undefined;
  #cancelQuestion: () => void = () => undefined;
  #askedAtMs = -Infinity;
  #unitAtMs = -Infinity;
  #cadence = new GotCadence();
  #looksAtMs = Infinity;
  #cancelLook: () => void = () => undefined;

  constructor(request: StreamRequest, options: VideoLinkOptions) {
    this.#request = request;
    this.#options = options;
  }

  get request(): StreamRequest {
    return this.#request;
  }

  start(): void {
    if (this.#state.phase === 'stopped') this.#connect(0);
  }

  stop(): void {
    this.#drop();
    this.#become({ phase: 'stopped', failures: 0, retryAtMs: null, why: '' });
  }

  /** Requests another stream over the same connection. */
  want(request: StreamRequest): void {
    const isOther = request.quality !== this.#request.quality || request.codec !== this.#request.codec;
    this.#request = request;
    if (isOther) this.#say({ type: 'want', quality: request.quality, codec: request.codec });
  }

  /** All units up to this one were decoded or are not needed. GotCadence decides when to report it to the tower. */
  got(done: Done): void {
    if (this.#state.phase !== 'open') return;
    this.#sayGot(this.#cadence.done(done, this.#options.clock.monotonicMs()));
  }

  #sayGot(got: Got | null): void {
    if (got) this.#say({ type: 'got', ...got });
    const lookAtMs = this.#cadence.lookAtMs;
    if (lookAtMs >= this.#looksAtMs) return;
    this.#looksAtMs = lookAtMs;
    this.#cancelLook();
    this.#cancelLook = this.#options.clock.after(lookAtMs - this.#options.clock.monotonicMs(), () => {
      this.#looksAtMs = Infinity;
      this.#sayGot(this.#cadence.look(this.#options.clock.monotonicMs()));
    });
  }

  #forgetGot(): void {
    this.#cancelLook();
    this.#looksAtMs = Infinity;
    this.#cadence = new GotCadence();
  }

  #say(message: object): void {
    if (this.#state.phase === 'open') this.#socket?.send(JSON.stringify(message));
  }

  #connect(failures: number): void {
    this.#drop();
    this.clock.forget();
    this.#become({ phase: 'connecting', failures, retryAtMs: null, why: '' });
    let socket: SocketLike;
    try {
      socket = this.#options.openSocket(this.#request);
    } catch {
      this.#lost(0);
      return;
    }
    const asked = this.#request;
    this.#socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => this.#received(data, asked);
    socket.onclose = ({ code, reason }) => this.#lost(code, reason);
    this.#watchSilence();
  }

  #received(data: unknown, asked: StreamRequest): void {
    if (this.#state.phase !== 'open') this.#opened(asked);
    this.#watchSilence();
    if (data instanceof ArrayBuffer) {
      const unit = readUnit(data);
      if (!unit) return;
      this.#unitAtMs = this.#options.clock.monotonicMs();
      this.#cadence.came(unit.sequence, this.#unitAtMs);
      this.#options.onUnit(unit, data.byteLength);
    } else if (typeof data === 'string') {
      this.#reported(data);
    }
  }

  /** Called at the tower's first message: before it, access is not confirmed. */
  #opened(asked: StreamRequest): void {
    this.#become({ phase: 'open', failures: 0, retryAtMs: null, why: '' });
    const { quality, codec } = this.#request;
    if (quality !== asked.quality || codec !== asked.codec) this.#say({ type: 'want', quality, codec });
    this.#askTime(1);
  }

  #reported(text: string): void {
    let said: Record<string, unknown>;
    try {
      said = (JSON.parse(text) as Record<string, unknown> | null) ?? {};
    } catch {
      return;
    }
    if (said['type'] === 'clock') {
      const { sent, tower_us } = said;
      if (typeof sent === 'number' && typeof tower_us === 'number') {
        this.clock.answered(sent, this.#options.clock.monotonicMs(), tower_us);
      }
    } else if (said['type'] === 'skipped' && typeof said['count'] === 'number') {
      this.#options.onSkipped(said['count']);
    } else if (said['type'] === 'state') {
      const state = TOWER_STATES.find((one) => one === said['state']);
      const codecs = Array.isArray(said['codecs']) ? said['codecs'] : [];
      const known = codecs.filter((one): one is CodecName => one === 'mpeg1' || one === 'h264');
      const words = typeof said['words'] === 'string' ? said['words'] : '';
      if (state) this.#options.onTower({ state, words, codecs: known });
    }
  }

  #askTime(asked: number): void {
    const nowMs = this.#options.clock.monotonicMs();
    const isQuiet = nowMs - this.#unitAtMs >= CLOCK_EVERY_MS;
    if (asked <= CLOCK_FIRST_QUESTIONS || isQuiet || nowMs - this.#askedAtMs >= CLOCK_AT_LAST_MS) {
      this.#askedAtMs = nowMs;
      this.#say({ type: 'clock', sent: nowMs });
    }
    const delayMs = asked < CLOCK_FIRST_QUESTIONS ? CLOCK_FIRST_MS : CLOCK_EVERY_MS;
    this.#cancelQuestion = this.#options.clock.after(delayMs, () => this.#askTime(asked + 1));
  }

  #watchSilence(): void {
    this.#after(SILENCE_LIMIT_MS, () => this.#lost(0));
  }

  #lost(code: number, why = ''): void {
    const failures = this.#state.failures + 1;
    this.#drop();
    const isRefused = REFUSALS.has(code);
    const delayMs = isRefused ? REFUSED_RETRY_MS : backoffMs(failures, this.#options.random);
    this.#after(delayMs, () => this.#connect(failures));
    const retryAtMs = this.#options.clock.nowMs() + delayMs;
    this.#become({ phase: isRefused ? 'refused' : 'waiting', failures, retryAtMs, why });
  }

  #become(state: LinkState): void {
    this.#state = state;
    this.#options.onLink(state);
  }

  #drop(): void {
    this.#cancelTimer();
    this.#cancelQuestion();
    this.#forgetGot();
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
