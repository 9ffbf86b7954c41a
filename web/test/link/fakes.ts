/** A clock that tests control, and sockets on which tests act as the tower. */

import type { Alert } from '../../src/link/alerts';
import type { Clock } from '../../src/link/clock';
import { encode } from '../../src/link/mavlink';
import type { SocketLike } from '../../src/link/live';
import type { MessageFields, MessageName } from '../../src/link/generated/mavlink.gen';
import type { Drone, HoldView } from '../../src/link/wire_types';

export class FakeClock implements Clock {
  #now = 1_000_000;
  #setAheadMs = 0;
  #timers: { dueMs: number; callback: () => void }[] = [];

  nowMs(): number {
    return this.#now + this.#setAheadMs;
  }

  /** The computer's clock is changed. */
  set(aheadMs: number): void {
    this.#setAheadMs += aheadMs;
  }

  /** With fractions, as in performance.now(). */
  monotonicMs(): number {
    return this.#now - 999_000 + 0.25;
  }

  after(delayMs: number, callback: () => void): () => void {
    const timer = { dueMs: this.#now + delayMs, callback };
    this.#timers.push(timer);
    return () => {
      this.#timers = this.#timers.filter((one) => one !== timer);
    };
  }

  /** Advances the time; due timers run in order, promises in between. */
  async pass(ms: number): Promise<void> {
    const end = this.#now + ms;
    for (;;) {
      const next = this.#timers.filter(({ dueMs }) => dueMs <= end).sort((a, b) => a.dueMs - b.dueMs)[0];
      if (!next) break;
      this.#timers = this.#timers.filter((one) => one !== next);
      this.#now = next.dueMs;
      next.callback();
      await settled();
    }
    this.#now = end;
    await settled();
  }

  get waiting(): number {
    return this.#timers.length;
  }
}

/** Lets resolved promises continue. */
export async function settled(): Promise<void> {
  for (let turn = 0; turn < 20; turn++) await Promise.resolve();
}

export class FakeSocket implements SocketLike {
  binaryType = '';
  bufferedAmount = 0;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason?: string }) => void) | null = null;
  readonly sent: (string | Uint8Array)[] = [];
  closed = false;

  send(data: string | Uint8Array<ArrayBuffer>): void {
    this.sent.push(data);
  }

  close(): void {
    this.closed = true;
  }

  /** The binary messages without their stamps. */
  get frames(): Uint8Array[] {
    return this.sent.filter((one) => typeof one !== 'string').map((one) => one.slice(8));
  }

  get texts(): unknown[] {
    return this.sent.filter((one) => typeof one === 'string').map((one): unknown => JSON.parse(one));
  }

  says(event: object): void {
    this.onmessage?.({ data: JSON.stringify(event) });
  }

  saysBytes(bytes: Uint8Array): void {
    this.onmessage?.({ data: bytes.slice().buffer });
  }
}

export const AUTOPILOT = { sysid: 7, compid: 1 };

export function fromAutopilot<N extends MessageName>(
  name: N,
  fields: Partial<MessageFields[N]>,
  from = AUTOPILOT,
): Uint8Array {
  return encode(name, fields, from, 0);
}

/** An ArduCopter heartbeat. */
export function heartbeat(customMode: number, armed = false, from = AUTOPILOT): Uint8Array {
  return fromAutopilot(
    'HEARTBEAT',
    {
      custom_mode: customMode,
      type: 2,
      autopilot: 3,
      base_mode: armed ? 209 : 81,
      system_status: 4,
      mavlink_version: 3,
    },
    from,
  );
}

export const A_DRONE: Drone = {
  id: 1,
  name: 'Heron',
  online: true,
  owners: [{ id: 5, name: 'olga' }],
  holder: null,
  epoch: 1,
  taken_from: null,
  autopilot_heard: true,
  agent_version: null,
  firmware: null,
  release: null,
  armed: false,
  airborne: false,
  airborne_since: null,
  last_heard: null,
  offered: false,
  assistant: null,
  may_watch: true,
  may_watch_video: true,
  lost_action: 'return',
  lost_action_s: 30,
  hold: null,
  profile: null,
  profile_chosen: 'auto',
  profile_why: '',
  other_systems: [],
  hears_agent: null,
  signing: 'off',
  restraint: null,
};

/** Stage two of a hold, confirmed. Without a holder, it returns in 24 s, by a tower with our clock. */
export const A_HOLD: HoldView = {
  open: true,
  stage: 'stay',
  mode: 'BRAKE',
  sticks: false,
  after_sticks: 'stays',
  waiting_for: '',
  lost: 'person',
  phase: 'counting',
  action: 'return',
  due_at: new Date(1_024_000).toISOString(),
  detail: '',
  as_of: new Date(1_000_000).toISOString(),
  stale: false,
};

/** An open alert of the tower. */
export const anAlert = (changes: Partial<Alert> = {}): Alert => ({
  id: 1,
  rule: 'battery-low',
  severity: 'warning',
  badge: 'Battery low',
  words: 'The battery of Heron is low: 28 %.',
  advice: 'Return.',
  rank: 9,
  drone_id: 1,
  other_id: null,
  opened_at: '2026-01-01T12:00:00Z',
  acknowledged_at: null,
  acknowledged_by: null,
  closed_at: null,
  closed_why: '',
  ...changes,
});
