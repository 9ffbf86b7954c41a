/**
 * How good links were, by place: the cells of `GET /statistics/link-quality`, graded like a live link. Access is that
 * of the flights.
 */

import { GRADES, type LinkGrade } from './link_quality';
import type { Place } from './messages';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import type { Period } from './statistics';

/** The side of a cell in metres. */
export const CELL_SIZES_M = [50, 100, 500, 2000] as const;
export const DEFAULT_CELL_M = 100;

export const LINK_MEASURES = ['loss', 'latency'] as const;
/** What the colours of the cells say. */
export type LinkMeasure = (typeof LINK_MEASURES)[number];

/** One cell of the grid, in degrees. Null: nothing was measured there. */
export interface LinkPlace {
  readonly south: number;
  readonly west: number;
  readonly north: number;
  readonly east: number;
  /** One every five seconds of flight. */
  readonly reports: number;
  /** How often the link was lost here. */
  readonly losses: number;
  readonly lossPercent: number | null;
  /** The median round trip. */
  readonly rttMs: number | null;
  readonly rttMaxMs: number | null;
}

export interface LinkPlaces {
  readonly places: readonly LinkPlace[];
  readonly flights: number;
  readonly isWhole: boolean;
}

const query = ({ droneId, fromIso, untilIso }: Period, cellM: number) => ({
  ...(droneId === null ? {} : { drone_id: droneId }),
  ...(fromIso === '' ? {} : { since: fromIso }),
  ...(untilIso === '' ? {} : { until: untilIso }),
  cell_m: cellM,
});

/** Raises RestError. */
export async function readLinkPlaces(rest: Pick<Rest, 'call'>, period: Period, cellM: number): Promise<LinkPlaces> {
  const view = await rest.call('GET', '/statistics/link-quality', { query: query(period, cellM) });
  return { places: view.features.map(placeOf), flights: view.flights, isWhole: view.is_whole };
}

/** The address of the same as CSV. */
export function linkPlacesHref(period: Period, cellM: number): string {
  const asked = Object.entries(query(period, cellM)).map(([name, value]) => [name, String(value)]);
  return `/api/v1/statistics/link-quality/csv?${new URLSearchParams(asked).toString()}`;
}

function placeOf({ geometry, properties }: Schemas['CellFeature']): LinkPlace {
  const ring = geometry.coordinates[0] ?? [];
  const [lons, lats] = [ring.map(([lon]) => lon), ring.map(([, lat]) => lat)];
  return {
    south: Math.min(...lats),
    west: Math.min(...lons),
    north: Math.max(...lats),
    east: Math.max(...lons),
    reports: properties.reports,
    losses: properties.losses,
    lossPercent: properties.loss_mean === null ? null : 100 * properties.loss_mean,
    rttMs: properties.rtt_median_ms,
    rttMaxMs: properties.rtt_max_ms,
  };
}

export const middleOf = ({ south, west, north, east }: LinkPlace): Place => ({
  latDeg: (south + north) / 2,
  lonDeg: (west + east) / 2,
});

export const valueOf = (place: LinkPlace, measure: LinkMeasure): number | null =>
  measure === 'loss' ? place.lossPercent : place.rttMs;

const limitOf = (grade: (typeof GRADES)[number], measure: LinkMeasure): number =>
  measure === 'loss' ? grade.lossPercent : grade.rttMs;

/** Null: not measured. */
export function gradeOf(place: LinkPlace, measure: LinkMeasure): LinkGrade | null {
  const value = valueOf(place, measure);
  if (value === null) return null;
  return GRADES.find((one) => value <= limitOf(one, measure))?.grade ?? 'bad';
}

/** A row of the legend. `above` and `upTo` in per cent or milliseconds; null: no limit. */
export interface GradeRange {
  readonly grade: LinkGrade;
  readonly above: number | null;
  readonly upTo: number | null;
}

/** The best first. */
export function gradeRanges(measure: LinkMeasure): readonly GradeRange[] {
  const limits = GRADES.map((one) => limitOf(one, measure));
  const grades: readonly LinkGrade[] = [...GRADES.map(({ grade }) => grade), 'bad'];
  return grades.map((grade, at) => ({ grade, above: limits[at - 1] ?? null, upTo: limits[at] ?? null }));
}

/** A place that only lost the link comes first: nothing could be measured there. One without any figure comes last. */
export function worstFirst(places: readonly LinkPlace[], measure: LinkMeasure): readonly LinkPlace[] {
  const badness = (place: LinkPlace): number =>
    valueOf(place, measure) ?? (place.losses > 0 ? Number.MAX_VALUE : Number.MIN_SAFE_INTEGER);
  return [...places].sort(
    (one, other) => badness(other) - badness(one) || other.losses - one.losses || other.reports - one.reports,
  );
}

/** The cell that a point of the map is in. The map repeats the world, so its longitudes may be beyond 180 degrees. */
export function placeAt(places: readonly LinkPlace[], { latDeg, lonDeg }: Place): LinkPlace | null {
  const lon = ((((lonDeg + 180) % 360) + 360) % 360) - 180;
  const isIn = ({ south, west, north, east }: LinkPlace): boolean =>
    south <= latDeg && latDeg < north && west <= lon && lon < east;
  return places.find(isIn) ?? null;
}
