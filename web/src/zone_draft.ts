/** A zone in the making, as the form has it: texts of fields, and points of the map. */

import type { Zone, ZoneBody, ZoneKind } from './link/zones';
import { cleanLine, cleanOutline, crossingsOf, inOrder, mayOrder } from './plan/outline';
import { degOf, spotOf, type Spot } from './plan/plan_types';
import { fieldOfMs, isoOfField } from './words/dates';

export interface ZoneDraft {
  /** The one to be changed; null: a new one. */
  zone: Zone | null;
  name: string;
  kind: ZoneKind;
  warns: boolean;
  isLine: boolean;
  widthM: number;
  /** Latitude and longitude. */
  points: readonly (readonly [number, number])[];
  /** Empty: the whole tower. */
  teamId: string;
  floorM: string;
  ceilingM: string;
  aboveSea: boolean;
  from: string;
  until: string;
  reason: string;
}

const EMPTY: ZoneDraft = {
  ...{ zone: null, name: '', kind: 'no-fly', warns: false, isLine: false, widthM: 40, points: [], reason: '' },
  ...{ teamId: '', floorM: '', ceilingM: '', aboveSea: false, from: '', until: '' },
};

export const newDraft = (more: Partial<ZoneDraft> = {}): ZoneDraft => ({ ...EMPTY, ...more });
export const fewestPoints = ({ isLine }: ZoneDraft): number => (isLine ? 2 : 3);

const spotsOf = ({ points }: Pick<ZoneDraft, 'points'>): Spot[] => points.map(([lat, lon]) => spotOf(lat, lon));

/** The points, each counted once; as they are if too few would be left. */
export function cleanPoints(draft: Pick<ZoneDraft, 'points' | 'isLine'>): ZoneDraft['points'] {
  const spots = spotsOf(draft);
  const { corners } = draft.isLine ? cleanLine(spots) : cleanOutline(spots);
  const kept = new Set(corners);
  const points = draft.points.filter((_, at) => kept.has(spots[at]!));
  return points.length < (draft.isLine ? 2 : 3) ? draft.points : points;
}

/** Points that are drawn twice, and count once. */
export const pointsTooMany = (draft: Pick<ZoneDraft, 'points' | 'isLine'>): number =>
  draft.points.length - cleanPoints(draft).length;

export const crossesItself = (draft: Pick<ZoneDraft, 'points' | 'isLine'>): boolean =>
  !draft.isLine && crossingsOf(cleanOutline(spotsOf(draft)).corners).length > 0;

/** In an order in which the edge does not cross itself; null if it is too much, or in order. */
export function orderedPoints(draft: Pick<ZoneDraft, 'points' | 'isLine'>): ZoneDraft['points'] | null {
  const spots = spotsOf(draft);
  if (draft.isLine || !mayOrder(spots)) return null;
  return inOrder(spots).map(({ latE7, lonE7 }) => [degOf(latE7), degOf(lonE7)]);
}

const field = (iso: string | null = null): string => (iso ? fieldOfMs(Date.parse(iso)) : '');
const text = (value: number | null = null): string => String(value ?? '');
/** A number field that is empty holds null, whatever its type says. */
const number = (value: string | number | null): number | null => {
  const written = String(value ?? '').trim();
  return written === '' ? null : Number(written);
};

export const draftOf = (zone: Zone): ZoneDraft => ({
  zone,
  name: zone.name,
  kind: zone.kind,
  warns: zone.rule === 'warn',
  isLine: (zone.width_m ?? null) !== null,
  widthM: zone.width_m ?? EMPTY.widthM,
  points: zone.points,
  teamId: text(zone.team_id),
  floorM: text(zone.floor_m),
  ceilingM: text(zone.ceiling_m),
  aboveSea: zone.height_above === 'sea',
  from: field(zone.valid_from),
  until: field(zone.valid_until),
  reason: zone.reason ?? '',
});

export const bodyOf = (draft: ZoneDraft): ZoneBody => ({
  name: draft.name,
  kind: draft.kind,
  rule: draft.warns ? 'warn' : 'refuse',
  points: cleanPoints(draft).map(([lat, lon]) => [lat, lon]),
  width_m: draft.isLine ? draft.widthM : null,
  team_id: number(draft.teamId),
  floor_m: draft.kind === 'height-limit' ? null : number(draft.floorM),
  ceiling_m: number(draft.ceilingM),
  height_above: draft.aboveSea ? 'sea' : 'home',
  valid_from: draft.from ? isoOfField(draft.from) : null,
  valid_until: draft.until ? isoOfField(draft.until) : null,
  reason: draft.reason,
});
