/**
 * One drone's telemetry: the newest of each message of its autopilot with its time of arrival, the track, and the
 * address. Gimbals, companion computers and other components do not count as the autopilot.
 */

import { MAV_AUTOPILOT, type MessageFields, type MessageName } from './generated/mavlink.gen';
import { distanceM } from './geometry';
import { decode, type Message } from './mavlink';
import { AUTOPILOT_COMPID, type Place } from './messages';

const TRACK_POINTS = 600;
const TRACK_STEP_M = 1;
/** Silence after which another system may be the drone's own (wire/own_system.py). */
const SILENT_MS = 5_000;

export interface Received<N extends MessageName> {
  readonly fields: MessageFields[N];
  readonly atMs: number;
}

export class Telemetry {
  readonly #newest = new Map<MessageName, Received<MessageName>>();
  readonly #listeners = new Set<(message: Message, nowMs: number) => void>();
  readonly #track: Place[] = [];
  /** MAVLink system id of the autopilot; null before its first heartbeat. */
  sysid: number | null = null;
  #heardAtMs = 0;

  /** Receives one frame of this drone; null if it cannot be decoded. */
  receive(frame: Uint8Array, nowMs: number): Message | null {
    const message = decode(frame);
    if (!message) return null;
    if (this.#isAutopilot(message, nowMs)) {
      this.#heardAtMs = nowMs;
      this.#newest.set(message.name, { fields: message.fields, atMs: nowMs });
      if (message.name === 'GLOBAL_POSITION_INT') this.#follow(message.fields);
    }
    for (const listener of [...this.#listeners]) listener(message, nowMs);
    return message;
  }

  newest<N extends MessageName>(name: N): Received<N> | null {
    return (this.#newest.get(name) as Received<N> | undefined) ?? null;
  }

  /** Names of the messages that its autopilot has sent. */
  get heard(): readonly MessageName[] {
    return [...this.#newest.keys()];
  }

  /** Its track, oldest first. */
  get track(): readonly Place[] {
    return this.#track;
  }

  isFromAutopilot(message: Message): boolean {
    return message.header.compid === AUTOPILOT_COMPID && message.header.sysid === this.sysid;
  }

  onMessage(listener: (message: Message, nowMs: number) => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  #isAutopilot(message: Message, nowMs: number): boolean {
    const { sysid, compid } = message.header;
    if (compid !== AUTOPILOT_COMPID) return false;
    // Agent and tower pass one system; a log of before them may hold several. A replay goes back in time, too.
    const silentMs = nowMs - this.#heardAtMs;
    const isFree = this.sysid === null || silentMs >= SILENT_MS || silentMs < 0;
    const isBeat = message.name === 'HEARTBEAT' && message.fields.autopilot !== MAV_AUTOPILOT.INVALID;
    if (isFree && isBeat) this.sysid = sysid;
    return sysid === this.sysid;
  }

  #follow(fields: MessageFields['GLOBAL_POSITION_INT']): void {
    if (fields.lat === 0 && fields.lon === 0) return; // no position yet
    const place = { latDeg: fields.lat / 1e7, lonDeg: fields.lon / 1e7 };
    const last = this.#track.at(-1);
    if (last && distanceM(last, place) < TRACK_STEP_M) return;
    this.#track.push(place);
    if (this.#track.length > TRACK_POINTS) this.#track.shift();
  }
}
