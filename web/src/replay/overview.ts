/** What a whole flight looks like from far: its way, its modes, and what the autopilot said. Read once, in order. */

import { definitionOf } from '../frames/definitions';
import { fieldReader, type FieldReader } from '../frames/field_series';
import type { FrameLog } from '../frames/frame_log';
import { distanceM } from '../link/geometry';
import { decode } from '../link/mavlink';
import { MAV_AUTOPILOT } from '../link/generated/mavlink.gen';
import { AUTOPILOT_COMPID } from '../link/messages';
import { StatusTextAssembler } from '../link/status_texts';

export interface TrackPoint {
  readonly atMs: number;
  readonly latDeg: number;
  readonly lonDeg: number;
  readonly altRelM: number;
}

export interface SaidText {
  readonly atMs: number;
  readonly severity: number;
  readonly text: string;
}

export interface ModeChange {
  readonly atMs: number;
  readonly autopilot: number;
  readonly vehicleType: number;
  readonly customMode: number;
}

export interface FlightOverview {
  readonly track: readonly TrackPoint[];
  readonly texts: readonly SaidText[];
  readonly modes: readonly ModeChange[];
  /** When it was first higher than a person above home; null: never. */
  readonly airborneMs: number | null;
}

const STEP_M = 1;
/** Beyond it the track is thinned to half: a line on a screen has no more points. */
const MAX_POINTS = 2_000;
const MAX_TEXTS = 2_000;
const MAX_MODES = 2_000;
const AIRBORNE_ABOVE_M = 1.5;
/** Silence after which another system may be the drone's own (wire/own_system.py). */
const SILENT_MS = 5_000;
const HEARTBEAT = 0;
const GLOBAL_POSITION_INT = 33;
const STATUSTEXT = 253;

/** Of tens of thousands of positions: a decoded message for each would be more garbage than the flight has bytes, and a
 * worker keeps the memory in which it collected it. The log has checked the frames. */
function readerOf(msgid: number, name: string): FieldReader {
  return fieldReader(definitionOf(msgid)!.fields.find((field) => field.name === name)!);
}

const heartbeat = {
  autopilot: readerOf(HEARTBEAT, 'autopilot'),
  type: readerOf(HEARTBEAT, 'type'),
  customMode: readerOf(HEARTBEAT, 'custom_mode'),
};
const position = {
  lat: readerOf(GLOBAL_POSITION_INT, 'lat'),
  lon: readerOf(GLOBAL_POSITION_INT, 'lon'),
  altMm: readerOf(GLOBAL_POSITION_INT, 'relative_alt'),
};

export class OverviewReader {
  readonly #log: FrameLog;
  readonly #texts = new Map<number, SaidText>();
  readonly #assembler = new StatusTextAssembler();
  readonly #modes: ModeChange[] = [];
  #track: TrackPoint[] = [];
  #newest: TrackPoint | null = null;
  #stepM = STEP_M;
  #sysid: number | null = null;
  #beatAtMs = 0;
  #airborneMs: number | null = null;
  #read = 0;

  constructor(log: FrameLog) {
    this.#log = log;
  }

  get overview(): FlightOverview {
    const last = this.#track.at(-1);
    const track = this.#newest && this.#newest !== last ? [...this.#track, this.#newest] : [...this.#track];
    return { track, texts: [...this.#texts.values()], modes: [...this.#modes], airborneMs: this.#airborneMs };
  }

  /** Reads what has come into the log. */
  update(): void {
    const log = this.#log;
    log.eachFrom(this.#read, (kind, atMs, bytes, at, length) => {
      const { msgid, sysid, compid } = log.kinds[kind]!;
      if (sysid !== (this.#sysid ?? sysid) && msgid !== HEARTBEAT) return;
      if (msgid === STATUSTEXT) this.#hear(bytes.subarray(at, at + length), atMs);
      else if (compid !== AUTOPILOT_COMPID) return;
      else if (msgid === HEARTBEAT) this.#beat(sysid, atMs, bytes, at);
      else if (msgid === GLOBAL_POSITION_INT) this.#move(atMs, bytes, at);
    });
    this.#read = log.end;
  }

  #hear(frame: Uint8Array, saidAtMs: number): void {
    const message = decode(frame);
    if (message?.name !== 'STATUSTEXT') return;
    const { key, severity, text, atMs } = this.#assembler.receive(message.header, message.fields, saidAtMs);
    if (this.#texts.size < MAX_TEXTS || this.#texts.has(key)) this.#texts.set(key, { atMs, severity, text });
  }

  #beat(sysid: number, atMs: number, bytes: Uint8Array, at: number): void {
    const autopilot = heartbeat.autopilot(bytes, at);
    if (autopilot === MAV_AUTOPILOT.INVALID) return;
    if (sysid !== this.#sysid && this.#sysid !== null && atMs - this.#beatAtMs < SILENT_MS) return;
    this.#sysid = sysid;
    this.#beatAtMs = atMs;
    const customMode = heartbeat.customMode(bytes, at);
    if (this.#modes.at(-1)?.customMode === customMode || this.#modes.length >= MAX_MODES) return;
    this.#modes.push({ atMs, autopilot, vehicleType: heartbeat.type(bytes, at), customMode });
  }

  #move(atMs: number, bytes: Uint8Array, at: number): void {
    const lat = position.lat(bytes, at);
    const lon = position.lon(bytes, at);
    if (lat === 0 && lon === 0) return; // no position yet
    this.#follow({ atMs, latDeg: lat / 1e7, lonDeg: lon / 1e7, altRelM: position.altMm(bytes, at) / 1000 });
  }

  #follow(point: TrackPoint): void {
    this.#newest = point;
    if (point.altRelM > AIRBORNE_ABOVE_M) this.#airborneMs ??= point.atMs;
    const last = this.#track.at(-1);
    if (last && Math.hypot(distanceM(last, point), point.altRelM - last.altRelM) < this.#stepM) return;
    this.#track.push(point);
    if (this.#track.length <= MAX_POINTS) return;
    this.#track = this.#track.filter((_, at) => at % 2 === 0);
    this.#stepM *= 2;
  }
}
