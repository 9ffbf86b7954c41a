/** What a whole flight looks like from far: its way, its modes, and what the autopilot said. Read once, in order. */

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
const HEARTBEAT = 0;
const GLOBAL_POSITION_INT = 33;
const STATUSTEXT = 253;

export class OverviewReader {
  readonly #log: FrameLog;
  readonly #texts = new Map<number, SaidText>();
  readonly #assembler = new StatusTextAssembler();
  readonly #modes: ModeChange[] = [];
  #track: TrackPoint[] = [];
  #newest: TrackPoint | null = null;
  #stepM = STEP_M;
  #sysid: number | null = null;
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
    for (; this.#read < this.#log.end; this.#read++) {
      const kind = this.#log.kinds[this.#log.kindOf(this.#read)]!;
      if (kind.msgid === STATUSTEXT) this.#take(this.#read);
      else if (kind.compid === AUTOPILOT_COMPID && (kind.msgid === HEARTBEAT || kind.msgid === GLOBAL_POSITION_INT)) {
        this.#take(this.#read);
      }
    }
  }

  #take(entry: number): void {
    const message = decode(this.#log.frameOf(entry));
    if (!message) return;
    const atMs = this.#log.timeOf(entry);
    if (message.name === 'STATUSTEXT') {
      const { key, severity, text, atMs: saidMs } = this.#assembler.receive(message.header, message.fields, atMs);
      if (this.#texts.size < MAX_TEXTS || this.#texts.has(key)) this.#texts.set(key, { atMs: saidMs, severity, text });
    } else if (message.name === 'HEARTBEAT') {
      const { autopilot, type: vehicleType, custom_mode: customMode } = message.fields;
      if (autopilot === MAV_AUTOPILOT.INVALID) return;
      this.#sysid = message.header.sysid;
      const isNew = this.#modes.at(-1)?.customMode !== customMode;
      if (isNew && this.#modes.length < MAX_MODES) this.#modes.push({ atMs, autopilot, vehicleType, customMode });
    } else if (
      message.name === 'GLOBAL_POSITION_INT' &&
      message.header.sysid === (this.#sysid ?? message.header.sysid)
    ) {
      const { lat, lon, relative_alt: altMm } = message.fields;
      if (lat === 0 && lon === 0) return; // no position yet
      this.#follow({ atMs, latDeg: lat / 1e7, lonDeg: lon / 1e7, altRelM: altMm / 1000 });
    }
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
