/**
 * The recordings of the drones on view, from the tower: read once, and again after a lost connection; in between, the
 * live channel reports each change.
 */

import type { Clock } from './clock';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import { Store, type Readable } from './store';

export type Recording = Schemas['RecordingView'];
export type RecordingState = Recording['state'];

export interface RecordingEvent {
  readonly type: 'recording';
  readonly drone_id: number;
  readonly event: 'begun' | 'ended' | 'ready' | 'failed' | 'removed' | (string & {});
  readonly recording: Recording;
}

export interface KnownRecordings {
  /** Newest first; null before the first read. */
  readonly list: readonly Recording[] | null;
  readonly problem: string;
}

export const TRY_AGAIN_MS = 5_000;
const NOTHING_KNOWN: KnownRecordings = { list: null, problem: '' };
const RECORDINGS = '/drones/{drone_id}/recordings';
const RECORDING = '/drones/{drone_id}/recordings/{recording_id}';
const ORDER = ['recording', 'finishing', 'failed', 'ready'];

/** An answer and an event about the same recording may arrive out of order: the later stage is newer. */
const isOlder = (one: Recording, known: Recording): boolean =>
  ORDER.indexOf(one.state) < ORDER.indexOf(known.state) && known.state !== 'failed';

const idsOf = ({ drone_id, id }: Recording) => ({ drone_id, recording_id: id });

/** The list with the update of one recording. */
export function withRecording(list: readonly Recording[], heard: Recording): Recording[] {
  const known = list.find(({ id }) => id === heard.id);
  if (known && isOlder(heard, known)) return [...list];
  return [heard, ...list.filter(({ id }) => id !== heard.id)].sort((a, b) => b.id - a.id);
}

export const isRunning = ({ state }: Recording): boolean => state === 'recording';
export const recordingHref = ({ drone_id, id }: Recording): string =>
  `/api/v1/drones/${drone_id}/recordings/${id}/file`;

interface Watched {
  readonly known: Store<KnownRecordings>;
  watchers: number;
  readings: number;
  isReading: boolean;
  /** An event arrived while the list was loading, so the list may be older. */
  isOld: boolean;
  cancelRetry: () => void;
}

export class Recordings {
  readonly #clock: Clock;
  readonly #rest: Rest;
  readonly #watched = new Map<number, Watched>();

  constructor(clock: Clock, rest: Rest) {
    this.#clock = clock;
    this.#rest = rest;
  }

  of(droneId: number): Readable<KnownRecordings> {
    return this.#entry(droneId).known;
  }

  /** Keeps them current from now on. Returns a function that stops it. */
  watch(droneId: number): () => void {
    const entry = this.#entry(droneId);
    entry.watchers += 1;
    if (entry.watchers === 1) void this.#read(droneId, entry);
    return () => {
      entry.watchers -= 1;
      if (entry.watchers === 0) entry.cancelRetry();
    };
  }

  /** An event of the live channel. */
  take({ drone_id, event, recording }: RecordingEvent): void {
    const entry = this.#watched.get(drone_id);
    if (!entry) return;
    entry.isOld = entry.isReading;
    entry.known.update((known) => {
      if (known.list === null) return known;
      const list =
        event === 'removed' ? known.list.filter(({ id }) => id !== recording.id) : withRecording(known.list, recording);
      return { ...known, list };
    });
  }

  /** Events may have been missed. */
  reread(): void {
    for (const [droneId, entry] of this.#watched) if (entry.watchers > 0) void this.#read(droneId, entry);
  }

  /** What one user saw is not shown to the next. */
  clear(): void {
    for (const entry of this.#watched.values()) {
      entry.readings += 1;
      entry.cancelRetry();
      entry.known.set(NOTHING_KNOWN);
    }
  }

  async begin(droneId: number): Promise<void> {
    this.#put(await this.#rest.call('POST', RECORDINGS, { path: { drone_id: droneId }, body: {} }));
  }

  async stop(recording: Recording): Promise<void> {
    this.#put(await this.#rest.call('POST', `${RECORDING}/stop`, { path: idsOf(recording) }));
  }

  async remove(recording: Recording): Promise<void> {
    await this.#rest.call('DELETE', RECORDING, { path: idsOf(recording) });
    this.take({ type: 'recording', drone_id: recording.drone_id, event: 'removed', recording });
  }

  #put(recording: Recording): void {
    this.take({ type: 'recording', drone_id: recording.drone_id, event: 'begun', recording });
  }

  #entry(droneId: number): Watched {
    const known = this.#watched.get(droneId);
    if (known) return known;
    const made: Watched = {
      known: new Store(NOTHING_KNOWN),
      watchers: 0,
      readings: 0,
      isReading: false,
      isOld: false,
      cancelRetry: () => undefined,
    };
    this.#watched.set(droneId, made);
    return made;
  }

  async #read(droneId: number, entry: Watched): Promise<void> {
    entry.cancelRetry();
    const reading = ++entry.readings;
    entry.isReading = true;
    entry.isOld = false;
    try {
      const list = await this.#rest.call('GET', RECORDINGS, { path: { drone_id: droneId } });
      if (reading !== entry.readings) return;
      entry.known.set({ list, problem: '' });
    } catch (error) {
      if (reading !== entry.readings) return;
      const problem = error instanceof Error ? error.message : String(error);
      entry.known.update(({ list }) => ({ list, problem }));
      if (entry.watchers > 0)
        entry.cancelRetry = this.#clock.after(TRY_AGAIN_MS, () => void this.#read(droneId, entry));
    }
    entry.isReading = false;
    if (entry.isOld) await this.#read(droneId, entry);
  }
}
