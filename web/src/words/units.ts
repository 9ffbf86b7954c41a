/** Quantities in the user's units. Everything internal is metric (SI); only texts and input fields are not. */

import { inLanguage, t } from '../languages/text';

export type UnitSystem = 'metric' | 'imperial' | 'aviation';
export type Quantity = 'height' | 'distance' | 'speed' | 'climb';

export const UNIT_SYSTEMS: readonly { readonly value: UnitSystem; readonly label: string }[] = [
  { value: 'metric', label: t('Metric') },
  { value: 'imperial', label: t('Imperial') },
  { value: 'aviation', label: t('Aviation') },
];

export function isUnitSystem(value: unknown): value is UnitSystem {
  return UNIT_SYSTEMS.some((one) => one.value === value);
}

export interface Unit {
  readonly symbol: string;
  /** One of these units in metres, or metres per second. */
  readonly inMetric: number;
  readonly decimals: number;
}

export interface Measure {
  readonly text: string;
  readonly unit: string;
}

const FOOT_M = 0.3048;
const STATUTE_MILE_M = 1609.344;
const NAUTICAL_MILE_M = 1852;
const HOUR_S = 3600;

const METRE: Unit = { symbol: 'm', inMetric: 1, decimals: 1 };
const FOOT: Unit = { symbol: 'ft', inMetric: FOOT_M, decimals: 0 };
const METRE_PER_SECOND: Unit = { symbol: 'm/s', inMetric: 1, decimals: 1 };

const UNITS: Record<UnitSystem, Record<Quantity, Unit>> = {
  metric: { height: METRE, distance: { ...METRE, decimals: 0 }, speed: METRE_PER_SECOND, climb: METRE_PER_SECOND },
  imperial: {
    height: FOOT,
    distance: FOOT,
    speed: { symbol: 'mph', inMetric: STATUTE_MILE_M / HOUR_S, decimals: 1 },
    climb: { symbol: 'ft/s', inMetric: FOOT_M, decimals: 1 },
  },
  aviation: {
    height: FOOT,
    distance: { ...METRE, decimals: 0 },
    speed: { symbol: 'kt', inMetric: NAUTICAL_MILE_M / HOUR_S, decimals: 1 },
    climb: { symbol: 'ft/min', inMetric: FOOT_M / 60, decimals: 0 },
  },
};

/** The unit for long distances, and from how many metres it applies. */
const FAR: Record<UnitSystem, Unit & { readonly fromM: number }> = {
  metric: { symbol: 'km', inMetric: 1000, decimals: 2, fromM: 1000 },
  imperial: { symbol: 'mi', inMetric: STATUTE_MILE_M, decimals: 2, fromM: STATUTE_MILE_M / 2 },
  aviation: { symbol: 'NM', inMetric: NAUTICAL_MILE_M, decimals: 2, fromM: NAUTICAL_MILE_M / 2 },
};

const UNKNOWN = '–';

export const unitOf = (system: UnitSystem, quantity: Quantity): Unit => UNITS[system][quantity];

/** `value` in metres or metres per second. */
export function measure(system: UnitSystem, quantity: Quantity, value: number | null, decimals?: number): Measure {
  const isFar = quantity === 'distance' && value !== null && Math.abs(value) >= FAR[system].fromM;
  const unit = isFar ? FAR[system] : UNITS[system][quantity];
  if (value === null || !Number.isFinite(value)) return { text: UNKNOWN, unit: unit.symbol };
  const text = (value / unit.inMetric).toFixed(decimals ?? unit.decimals);
  // -0.0 would suggest a movement that does not exist.
  return { text: inLanguage(Number(text) === 0 ? text.replace('-', '') : text.replace('-', '−')), unit: unit.symbol };
}

/** The same as one string. */
export function measured(system: UnitSystem, quantity: Quantity, value: number | null, decimals?: number): string {
  const { text, unit } = measure(system, quantity, value, decimals);
  return text === UNKNOWN ? text : `${text} ${unit}`;
}

/** `120 m, 30 m high`. */
export const awayAndHigh = (system: UnitSystem, awayM: number | null, highM: number | null): string =>
  t('{distance}, {height} high', {
    distance: measured(system, 'distance', awayM),
    height: measured(system, 'height', highM, 0),
  });

/** The input of a field in the user's unit, as metres or metres per second. */
export const toMetric = (system: UnitSystem, quantity: Quantity, value: number): number =>
  value * UNITS[system][quantity].inMetric;

/** The reverse, rounded as a field shows it. */
export function fromMetric(system: UnitSystem, quantity: Quantity, value: number): number {
  const { inMetric, decimals } = UNITS[system][quantity];
  return Number((value / inMetric).toFixed(decimals));
}

/** The value of a field that began at `initial`: exactly that until the user types another, despite the rounding. */
export const meantBy = (system: UnitSystem, quantity: Quantity, typed: number, initial: number): number =>
  typed === fromMetric(system, quantity, initial) ? initial : toMetric(system, quantity, typed);

/** A field's limits, rounded inwards: neither limit is ever outside the allowed range. */
export function fieldBounds(system: UnitSystem, quantity: Quantity, least: number, most: number): [number, number] {
  const { inMetric, decimals } = UNITS[system][quantity];
  const step = 10 ** decimals;
  return [Math.ceil((least / inMetric) * step) / step, Math.floor((most / inMetric) * step) / step];
}
