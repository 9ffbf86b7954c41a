/**
 * Plays a recorded flight into a `Vehicle`, as the live channel does: the same decoding, and everything that draws a
 * vehicle draws this one. Time passes only in `pass`, so a test plays an hour in a moment.
 */

import { t } from '../languages/text';
import type { Clock } from '../link/clock';
import { Store } from '../link/store';
import { Vehicle, type Uplink } from '../link/vehicle';
import type { Drone } from '../link/wire_types';
import type { Axes } from '../link/sticks';
import { frameOf, pieceAt, type Piece } from './key_frames';
import { SticksSeen } from './sticks_seen';

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16] as const;
const MAX_PIECES = 12;
/** A page that was in the background does not jump. */
const MAX_STEP_MS = 250;

export interface PlayerSource {
  piece(number: number): Promise<Piece | null>;
}

export interface PlayerState {
  readonly atMs: number;
  readonly isPlaying: boolean;
  readonly speed: number;
  /** The vehicle as it was then: another object after a jump. */
  readonly vehicle: Vehicle;
  /** A jump waits for the worker. */
  readonly isSeeking: boolean;
}

const NO_UPLINK: Uplink = {
  command: () => Promise.resolve({ kind: 'failed', why: t('this is a recorded flight') }),
  send: () => false,
  sendFresh: () => 'down',
  alerts: () => [],
};

export class Player {
  readonly state: Store<PlayerState>;
  /** The flight's own time, for what draws by a clock. */
  readonly clock: Clock;
  readonly #source: PlayerSource;
  readonly #drone: Drone;
  readonly #pieces = new Map<number, Piece>();
  readonly #asked = new Set<number>();
  #begins: readonly number[] = [];
  #fromMs = 0;
  #toMs = 0;
  #piece: Piece | null = null;
  /** Frames of the piece that the vehicle has received. */
  #fed = 0;
  #wantedMs: number | null = null;
  #airborneSinceMs: number | null = null;
  #wider = { fromMs: Infinity, toMs: -Infinity };
  #sticks = new SticksSeen();

  constructor(source: PlayerSource, drone: Drone) {
    this.#source = source;
    this.#drone = drone;
    this.clock = {
      nowMs: () => this.vehicleMs,
      monotonicMs: () => this.vehicleMs,
      after: () => () => undefined,
    };
    const vehicle = this.#newVehicle();
    this.state = new Store<PlayerState>({ atMs: 0, isPlaying: false, speed: 1, vehicle, isSeeking: false });
  }

  /** The moment that the vehicle is shown at: it stays as it was at the end of its flight. */
  get vehicleMs(): number {
    const { atMs } = this.state.get();
    return this.#begins.length === 0 ? atMs : Math.min(Math.max(atMs, this.#fromMs), this.#toMs);
  }

  /** Where a jump under way leads, else the moment on view: a step that follows a step before it was shown adds to it. */
  get headedMs(): number {
    return this.#begins.length === 0 ? this.state.get().atMs : this.#clamped(this.#wantedMs ?? this.state.get().atMs);
  }

  get fromMs(): number {
    return this.#fromMs;
  }

  get toMs(): number {
    return this.#toMs;
  }

  /** The sticks as they passed at the moment on view; null: none. */
  get sticks(): Axes | null {
    return this.#sticks.at(this.state.get().atMs);
  }

  /** Time goes on beyond this flight, because another one beside it is longer. */
  widen(fromMs: number, toMs: number): void {
    this.#wider = { fromMs, toMs };
  }

  /** More of the flight is known. */
  known(fromMs: number, toMs: number, begins: readonly number[], airborneSinceMs: number | null): void {
    const isFirst = this.#begins.length === 0 && begins.length > 0;
    const last = this.#begins.length - 1;
    this.#begins = begins;
    this.#fromMs = fromMs;
    this.#toMs = toMs;
    this.#airborneSinceMs = airborneSinceMs;
    this.#pieces.delete(last); // the last one was not whole
    if (this.#piece?.number === last) this.#refresh(last);
    if (isFirst) this.seek(this.#wantedMs ?? fromMs);
    else if (this.#wantedMs !== null) this.seek(this.#wantedMs);
  }

  play(): void {
    if (this.state.get().atMs >= this.#endMs) this.seek(this.#beginMs);
    this.#set({ isPlaying: true });
  }

  pause(): void {
    this.#set({ isPlaying: false });
  }

  toggle(): void {
    if (this.state.get().isPlaying) this.pause();
    else this.play();
  }

  setSpeed(speed: number): void {
    this.#set({ speed });
  }

  /** So much time of the person has passed. */
  pass(realMs: number): void {
    const { isPlaying, speed, atMs } = this.state.get();
    if (!isPlaying || this.#wantedMs !== null) return;
    const nextMs = atMs + Math.min(realMs, MAX_STEP_MS) * speed;
    if (nextMs >= this.#endMs) {
      this.pause();
      this.seek(this.#endMs);
    } else this.seek(nextMs);
  }

  /** Shows this moment: at once if its piece is at hand, else when the worker has sent it. */
  seek(wantedMs: number): void {
    const toMs = this.#begins.length === 0 ? wantedMs : this.#clamped(wantedMs);
    const number = pieceAt(this.#begins, toMs);
    const piece = this.#pieces.get(number);
    if (!piece) {
      this.#wantedMs = wantedMs;
      this.#set({ isSeeking: this.#begins.length > 0 });
      if (this.#begins.length > 0) this.#ask(number);
      return;
    }
    this.#wantedMs = null;
    this.#show(piece, toMs);
    if (number + 1 < this.#begins.length) this.#ask(number + 1);
  }

  get #beginMs(): number {
    return Math.min(this.#fromMs, this.#wider.fromMs);
  }

  get #endMs(): number {
    return Math.max(this.#toMs, this.#wider.toMs);
  }

  #clamped(atMs: number): number {
    return Math.min(Math.max(atMs, this.#beginMs), this.#endMs);
  }

  #show(piece: Piece, atMs: number): void {
    const { vehicle: shown, atMs: shownMs } = this.state.get();
    const goesOn = this.#piece === piece && atMs >= shownMs;
    const follows = this.#piece !== null && piece.number === this.#piece.number + 1 && atMs >= shownMs;
    let vehicle = shown;
    if (follows) {
      this.#feed(vehicle, this.#piece!, Infinity);
      this.#fed = 0;
    } else if (!goesOn) {
      vehicle = this.#newVehicle();
      for (let at = 0; at < piece.before.ends.length; at++) {
        vehicle.receive(frameOf(piece.before, at), piece.before.times[at]!);
      }
      this.#fed = 0;
    }
    this.#piece = piece;
    this.#feed(vehicle, piece, atMs);
    this.#set({ atMs, vehicle, isSeeking: false });
  }

  #feed(vehicle: Vehicle, { frames }: Piece, untilMs: number): void {
    while (this.#fed < frames.ends.length && frames.times[this.#fed]! <= untilMs) {
      vehicle.receive(frameOf(frames, this.#fed), frames.times[this.#fed]!);
      this.#fed += 1;
    }
  }

  #ask(number: number): void {
    if (this.#pieces.has(number) || this.#asked.has(number)) return;
    this.#asked.add(number);
    void this.#source.piece(number).then((piece) => {
      this.#asked.delete(number);
      if (!piece) return;
      this.#keep(piece);
      if (this.#wantedMs !== null) this.seek(this.#wantedMs);
    });
  }

  /** The piece on view has grown. */
  #refresh(number: number): void {
    void this.#source.piece(number).then((piece) => {
      if (!piece || this.#piece?.number !== number) return;
      this.#keep(piece);
      this.#piece = piece; // it begins with the same frames
    });
  }

  #keep(piece: Piece): void {
    this.#pieces.delete(piece.number);
    this.#pieces.set(piece.number, piece);
    for (const number of this.#pieces.keys()) {
      if (this.#pieces.size <= MAX_PIECES) break;
      this.#pieces.delete(number);
    }
  }

  #newVehicle(): Vehicle {
    const vehicle = new Vehicle(this.#drone, this.clock, NO_UPLINK, () => undefined);
    const sticks = new SticksSeen();
    this.#sticks = sticks;
    vehicle.telemetry.onMessage((message, atMs) => sticks.receive(message, atMs));
    if (this.#airborneSinceMs !== null) {
      vehicle.put({ ...this.#drone, airborne_since: new Date(this.#airborneSinceMs).toISOString() }, Infinity);
    }
    return vehicle;
  }

  #set(change: Partial<PlayerState>): void {
    this.state.set({ ...this.state.get(), ...change });
  }
}
