/** One replay: the file, its index, the player, and what of them is on view. */

import { untrack } from 'svelte';

import { t } from '../languages/text';
import type { SeriesSource } from '../frames/chart_field';
import type { Schemas } from '../link/rest_types';
import type { Rest } from '../link/rest';
import type { Vehicle } from '../link/vehicle';
import { flightFileHref, flightIdOf } from '../link/flights';
import { importIdOf, importFileHref, type FlightKey, type ImportedFlight } from '../link/flight_imports';
import type { TrackPlace } from '../map/curtain';
import type { SceneDrone } from '../map/overlay';
import { sceneDrone } from '../scene';
import type { UnitSystem } from '../words/units';
import { wordsOf } from '../loading.svelte';
import { holderSpans, marksOf, silentSpans, type IndexEntry } from './marks';
import type { FlightOverview, TrackPoint } from './overview';
import { Player, type PlayerState } from './player';
import { recordedDrone } from './recorded_drone';
import { openReplayWorker, ReplayFile } from './replay_file';
import type { Progress } from './worker_messages';

export type FlightDetail = Schemas['FlightDetailView'];

const FILE_DRONE_ID = 0;
/** Digits that change faster cannot be read, and lay out the page anew each time. The map, the horizon, the timeline and
 * the video follow each step, and a single jump is read at once. */
const READ_MS = 120;

export class ReplaySession {
  readonly file: ReplayFile;
  readonly player: Player;
  name = $state('');
  detail = $state.raw<FlightDetail | null>(null);
  /** Of a flight from another program's file, in place of `detail`. */
  imported = $state.raw<ImportedFlight | null>(null);
  progress = $state.raw<Progress | null>(null);
  shown = $state.raw<PlayerState>()!;
  /** For numbers: follow the moment on view, less often. */
  readMs = $state(0);
  readVehicle = $state.raw<Vehicle>()!;
  problem = $state('');
  readonly index = $derived<readonly IndexEntry[]>(this.detail?.index ?? []);
  readonly overview = $derived<FlightOverview | null>(this.progress?.overview ?? null);
  readonly fromMs = $derived(this.progress?.fromMs ?? 0);
  readonly toMs = $derived(this.progress?.toMs ?? 0);
  readonly marks = $derived(
    marksOf(this.index, this.overview, this.name).filter(({ atMs }) => atMs >= this.fromMs && atMs <= this.wholeToMs),
  );
  readonly holders = $derived(holderSpans(this.index, this.fromMs, this.wholeToMs));
  readonly silences = $derived(silentSpans(this.index, this.wholeToMs));
  readonly videos = $derived(
    (this.detail?.video ?? [])
      .filter(({ state }) => state === 'ready')
      .map(({ id, began_at, first_picture_at, ended_at, quality }) => ({
        id,
        // A recording may begin long before its first picture.
        fromMs: Date.parse(first_picture_at ?? began_at),
        toMs: ended_at ? Date.parse(ended_at) : Infinity,
        label: quality,
      })),
  );
  /** On view, by the moment of the map and not by that of the numbers: one that came later would be of another moment. */
  readonly video = $derived.by(() => {
    const { atMs } = this.shown;
    return this.videos.find(({ fromMs, toMs }) => fromMs <= atMs && atMs < toMs) ?? null;
  });
  /** Curves are read anew when there is twice as much: with each piece, they would cost more than it. */
  readonly chartVersion = $derived.by(() => {
    const { frames, isWhole } = this.progress ?? { frames: 0, isWhole: false };
    return isWhole ? frames : 2 ** Math.floor(Math.log2(Math.max(1, frames)));
  });
  readonly chartSource = $derived.by<SeriesSource>(() => {
    void this.chartVersion;
    const kinds = untrack(() => this.progress?.kinds ?? []);
    return { kinds, series: (request) => this.file.series(request) };
  });
  readonly track = $derived<readonly TrackPoint[]>(this.overview?.track ?? []);
  /** How much higher its home is than that of the flight on whose map it is: heights there are above one home. */
  homeUpM = $state(0);
  readonly ways = $derived<readonly TrackPlace[]>(
    this.track.map(({ latDeg, lonDeg, altRelM }) => ({ latDeg, lonDeg, upM: altRelM + this.homeUpM })),
  );
  #readAt = -Infinity;
  /** What was read last. No `$state`: whoever seeks in an effect must not depend on it. */
  #last: PlayerState;
  #reading: ReturnType<typeof setTimeout> | null = null;

  constructor(droneId: number, name: string) {
    this.name = name;
    this.file = new ReplayFile(openReplayWorker());
    this.player = new Player(this.file, recordedDrone(droneId, name));
    this.shown = this.#last = this.player.state.get();
    this.#read();
    this.player.state.subscribe((state) => {
      this.shown = state;
      // What changes nothing to read, as a jump that begins to wait for the worker, must not put off what does.
      if (this.#reading !== null || (state.atMs === this.#last.atMs && state.vehicle === this.#last.vehicle)) return;
      const waitMs = this.#readAt + READ_MS - performance.now();
      if (waitMs <= 0) this.#read();
      else this.#reading = setTimeout(() => this.#read(), waitMs);
    });
    this.file.problem.subscribe((words) => (this.problem = words));
    this.file.progress.subscribe((progress) => {
      if (!progress) return;
      untrack(() => (this.progress = progress));
      const { fromMs, toMs, begins, overview } = progress;
      this.player.known(fromMs, toMs, begins, overview.airborneMs);
    });
  }

  /** The end of the flight, also while it is being fetched. */
  get wholeToMs(): number {
    const ended = this.detail?.ended_at ? Date.parse(this.detail.ended_at) : 0;
    return this.progress?.isWhole ? this.toMs : Math.max(this.toMs, ended);
  }

  /** By which two flights are aligned: first higher than a person above home, or the beginning. */
  get takeOffMs(): number {
    return this.overview?.airborneMs ?? this.fromMs;
  }

  /** How many points of the track are behind. */
  passedPoints(atMs: number): number {
    let low = 0;
    let high = this.track.length;
    while (low < high) {
      const middle = (low + high) >>> 1;
      if (this.track[middle]!.atMs <= atMs) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The vehicle at the moment on view with its way, behind and ahead; null while it has no position. */
  onMap(units: UnitSystem, place: 'alone' | 'beside' = 'alone'): SceneDrone | null {
    const { vehicle, atMs } = this.shown;
    const values = vehicle.values(this.player.vehicleMs);
    const here = sceneDrone(vehicle, values, 0, units);
    // Exact, also below home: its track is beside it.
    const upM = values.airborne && values.altRelM !== null ? values.altRelM + this.homeUpM : 0;
    return here && { ...here, track: this.ways, passed: this.passedPoints(atMs), upM, isBeside: place === 'beside' };
  }

  /** The mark before or after the moment on view. */
  jump(way: -1 | 1): void {
    const { atMs } = this.shown;
    const found =
      way > 0
        ? this.marks.find((mark) => mark.atMs > atMs + 1)
        : this.marks.findLast((mark) => mark.atMs < atMs - (this.shown.isPlaying ? 1_000 : 1));
    if (found) this.player.seek(found.atMs);
  }

  #read(): void {
    this.#reading = null;
    this.#readAt = performance.now();
    this.#last = this.player.state.get();
    this.readMs = this.#last.atMs;
    this.readVehicle = this.#last.vehicle;
  }

  close(): void {
    this.player.pause();
    if (this.#reading !== null) clearTimeout(this.#reading);
    this.file.close();
  }
}

/**
 * Opens a flight of the tower, recorded or imported. `droneId`: on the map, if not that of its drone. Raises RestError.
 */
export async function openFlight(rest: Rest, flight: FlightKey, droneId?: number): Promise<ReplaySession> {
  const importId = importIdOf(flight);
  if (importId !== null) {
    const imported = await rest.call('GET', '/flight-imports/{import_id}', { path: { import_id: importId } });
    const session = new ReplaySession(droneId ?? FILE_DRONE_ID, imported.name);
    session.imported = imported;
    session.file.openUrl(importFileHref(importId));
    return session;
  }
  const flightId = flightIdOf(flight);
  const detail = await rest.call('GET', '/flights/{flight_id}', { path: { flight_id: flightId } });
  const session = new ReplaySession(droneId ?? detail.drone_id, detail.drone);
  session.detail = detail;
  if (detail.state !== 'ready') {
    session.problem =
      detail.state === 'recording'
        ? t('This flight is still being recorded. Open it again when it has ended.')
        : detail.words;
  } else session.file.openUrl(flightFileHref(flightId, 'tlog'));
  return session;
}

/** Opens a file of the person's computer; it is sent nowhere. */
export function openOwnFile(file: File): ReplaySession {
  const session = new ReplaySession(FILE_DRONE_ID, file.name.replace(/\.[^.]*$/, '') || file.name);
  try {
    session.file.openFile(file);
  } catch (error) {
    session.problem = wordsOf(error);
  }
  return session;
}
