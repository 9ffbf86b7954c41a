/**
 * Flying by hand: a stream of MANUAL_CONTROL at 50 Hz from a source of axes. It begins only with centred sticks. If it
 * ends while the controls are ours, it ends with a hold. Nothing is queued: a message that cannot leave at once is
 * skipped.
 */

import { t } from '../languages/text';
import type { Clock } from './clock';
import type { Sending } from './live';
import type { MessageFields } from './generated/mavlink.gen';
import { Store, type Readable } from './store';
import { CENTRED, offCentre, type Axes, type AxesSource } from './sticks';

export const BEAT_MS = 20;
/** How long they must be centred: a stick that is moved passes through its middle. */
export const CENTRED_MS = 300;
/** Sticks that stay uncentred this long end the attempt. */
export const CENTRING_LIMIT_MS = 30_000;

export type ManualPhase = 'off' | 'centring' | 'flying';

export interface ManualState {
  readonly phase: ManualPhase;
  readonly source: string;
  readonly axes: Axes;
  /** The axes still to be centred before the stream begins. */
  readonly offCentre: readonly (keyof Axes)[];
  readonly sent: number;
  readonly skipped: number;
  /** Why it ended; empty while it has not. */
  readonly ended: string;
}

export interface ManualOptions {
  readonly clock: Clock;
  readonly send: (axes: Axes) => Sending;
  /** Stop and stay: the final command when the pilot's input is gone. */
  readonly hold: () => void;
}

const OFF: ManualState = {
  phase: 'off',
  source: '',
  axes: CENTRED,
  offCentre: [],
  sent: 0,
  skipped: 0,
  ended: '',
};

export class Manual {
  readonly #options: ManualOptions;
  readonly #state = new Store<ManualState>(OFF);
  #source: AxesSource | null = null;
  #cancelBeat: () => void = () => undefined;
  #begunMs = 0;
  #centredSinceMs = Infinity;
  #onBegun: () => void = () => undefined;

  constructor(options: ManualOptions) {
    this.#options = options;
  }

  get state(): Readable<ManualState> {
    return this.#state;
  }

  /** Streams once the sticks have been centred for a moment, and then calls `onBegun`. */
  start(source: AxesSource, onBegun: () => void = () => undefined): void {
    this.#cancelBeat();
    this.#source = source;
    this.#onBegun = onBegun;
    this.#begunMs = this.#options.clock.monotonicMs();
    this.#centredSinceMs = Infinity;
    this.#state.set({ ...OFF, phase: 'centring', source: source.name });
    this.#beat(this.#options.clock.monotonicMs());
  }

  /** With a hold, unless the controls (or the connection) are gone anyway. */
  stop(why: string, { holds }: { holds: boolean }): void {
    const { phase } = this.#state.get();
    if (phase === 'off') return;
    this.#cancelBeat();
    this.#source = null;
    this.#state.update((state) => ({ ...state, phase: 'off', axes: CENTRED, offCentre: [], ended: why }));
    if (holds && phase === 'flying') this.#options.hold();
  }

  #beat(dueMs: number): void {
    const { clock } = this.#options;
    const axes = this.#read();
    if (!axes) return this.stop(t('{source} is gone', { source: this.#state.get().source }), { holds: true });
    if (this.#state.get().phase === 'centring') this.#centring(axes);
    if (this.#state.get().phase === 'flying') this.#send(axes);
    if (this.#state.get().phase === 'off') return;
    // Counts from the due time, so that the rate does not drift; skips missed messages.
    const now = clock.monotonicMs();
    const nextMs = Math.max(dueMs + BEAT_MS, now);
    this.#cancelBeat = clock.after(nextMs - now, () => this.#beat(nextMs));
  }

  /** A source that throws counts as gone: otherwise the loop would end while the page still shows manual flight. */
  #read(): Axes | null {
    try {
      return this.#source?.read(this.#options.clock.monotonicMs()) ?? null;
    } catch {
      return null;
    }
  }

  #centring(axes: Axes): void {
    const off = offCentre(axes);
    const nowMs = this.#options.clock.monotonicMs();
    this.#centredSinceMs = off.length > 0 ? Infinity : Math.min(this.#centredSinceMs, nowMs);
    if (nowMs - this.#centredSinceMs < CENTRED_MS) {
      if (nowMs - this.#begunMs > CENTRING_LIMIT_MS) {
        return this.stop(t('the sticks were not centred'), { holds: false });
      }
      this.#state.update((state) => ({ ...state, axes, offCentre: off }));
      return;
    }
    this.#state.update((state) => ({ ...state, phase: 'flying', axes, offCentre: [] }));
    this.#onBegun();
  }

  #send(axes: Axes): void {
    const sending = this.#options.send(axes);
    if (sending === 'down') return this.stop(t('the connection to the tower is lost'), { holds: false });
    const { sent, skipped } = this.#state.get();
    const counts = sending === 'sent' ? { sent: sent + 1 } : { skipped: skipped + 1 };
    this.#state.update((state) => ({ ...state, axes, ...counts }));
  }
}

/** x pitch, y roll, r yaw: -1000..1000; z throttle: 0..1000 with 500 the middle. */
export function manualControlFields(axes: Axes, sysid: number): Partial<MessageFields['MANUAL_CONTROL']> {
  const full = (value: number): number => Math.round(Math.max(-1, Math.min(1, value)) * 1000);
  return {
    target: sysid,
    x: full(axes.pitch),
    y: full(axes.roll),
    z: Math.round(500 + full(axes.throttle) / 2),
    r: full(axes.yaw),
  };
}
