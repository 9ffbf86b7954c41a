/** The values that can be shown of a drone: named ones, and every field of every message that it sends. Pure. */

import { t } from '../languages/text';
import type { FlightValues } from '../link/flight_values';
import type { MessageName } from '../link/generated/mavlink.gen';
import type { Telemetry } from '../link/telemetry';
import { duration, fixed, plain, UNKNOWN } from '../words/format';
import { measure, type Quantity, type UnitSystem } from '../words/units';

export interface ShownValue {
  readonly label: string;
  readonly text: string;
  readonly unit: string;
  /** For machines: a plain number or word. */
  readonly raw: string;
  /** For gauges, sparklines and limits, metric; null: not known, or no number. */
  readonly number: number | null;
  readonly tone?: 'warning' | 'danger' | 'accent';
  /** Where an arrow points, clockwise from up. */
  readonly arrowDeg?: number;
  /** Left out of the display while there is nothing to say. */
  readonly isHidden?: boolean;
  /** The ends of a gauge. */
  readonly ends?: readonly [number, number];
}

interface Known {
  readonly values: FlightValues;
  readonly telemetry: Telemetry;
  readonly units: UnitSystem;
  /** Undefined: this tower has no elevation. */
  readonly overGroundM?: number | null | undefined;
}
type Show = (known: Known) => Omit<ShownValue, 'label'> & { label?: string };

/** Below this, an estimated wind direction is noise. */
const CALM_MPS = 0.5;
const LOW_PERCENT = 30;
const CRITICAL_PERCENT = 15;

const of =
  (quantity: Quantity, pick: (values: FlightValues) => number | null, ends?: readonly [number, number]): Show =>
  ({ values, units }) => {
    const number = pick(values);
    return { ...measure(units, quantity, number), raw: plain(number), number, ...(ends ? { ends } : {}) };
  };
const number =
  (pick: (known: Known) => number | null, unit: string, decimals = 0, ends?: readonly [number, number]): Show =>
  (known) => {
    const value = pick(known);
    return { text: fixed(value, decimals), unit, raw: plain(value), number: value, ...(ends ? { ends } : {}) };
  };
const words =
  (pick: (values: FlightValues) => string | null): Show =>
  ({ values }) => ({ text: pick(values) ?? UNKNOWN, unit: '', raw: pick(values) ?? '', number: null });
const batteryTone = ({ batteryPercent }: FlightValues): Pick<ShownValue, 'tone'> =>
  batteryPercent === null || batteryPercent > LOW_PERCENT
    ? {}
    : { tone: batteryPercent > CRITICAL_PERCENT ? 'warning' : 'danger' };
const radians = (degrees: number): number => (degrees * Math.PI) / 180;

const NAMED: Readonly<Record<string, readonly [string, Show]>> = {
  mode: [
    t('Mode'),
    ({ values }) => ({ text: values.mode ?? UNKNOWN, unit: '', raw: values.mode ?? '', number: null, tone: 'accent' }),
  ],
  armed: [
    t('Motors'),
    ({ values: { armed } }) => ({
      text: armed === null ? t('Unknown') : armed ? t('ARMED') : t('Disarmed'),
      unit: '',
      raw: armed === null ? '' : String(armed),
      number: null,
      ...(armed ? { tone: 'warning' } : {}),
    }),
  ],
  altitude: [t('Height above home'), of('height', ({ altRelM }) => altRelM, [0, 120])],
  'over-ground': [
    t('Height above ground'),
    ({ overGroundM, units }) => ({
      ...measure(units, 'height', overGroundM ?? null),
      raw: plain(overGroundM ?? null),
      number: overGroundM ?? null,
      ends: [0, 120],
      isHidden: overGroundM === undefined,
    }),
  ],
  'altitude-amsl': [t('Height above sea level'), of('height', ({ altAmslM }) => altAmslM)],
  climb: [t('Climb'), of('climb', ({ climbMps }) => climbMps, [-5, 5])],
  speed: [t('Ground speed'), of('speed', ({ groundSpeedMps }) => groundSpeedMps, [0, 20])],
  heading: [t('Heading'), number(({ values }) => values.headingDeg, '°', 0, [0, 360])],
  battery: [
    t('Battery'),
    ({ values }) => ({
      text: fixed(values.batteryPercent),
      unit: `% ${values.batteryV === null ? '' : `${fixed(values.batteryV, 1)} V`}`,
      raw: plain(values.batteryPercent),
      number: values.batteryPercent,
      ends: [0, 100],
      ...batteryTone(values),
    }),
  ],
  'battery-left': [
    t('Battery left'),
    ({ values }) => {
      const left = values.batteryTime;
      return {
        label: left?.isEstimate ? t('Battery left, estimated') : t('Battery left'),
        text: left ? `${left.isEstimate ? '≈ ' : ''}${duration(left.leftMs)}` : UNKNOWN,
        unit: values.batteryA === null ? '' : `${fixed(values.batteryA, 1)} A`,
        raw: left ? plain(left.leftMs) : '',
        number: left ? left.leftMs / 1000 : null,
        ...batteryTone(values),
      };
    },
  ],
  current: [t('Current'), number(({ values }) => values.batteryA, 'A', 1, [0, 60])],
  voltage: [t('Voltage'), number(({ values }) => values.batteryV, 'V', 2)],
  throttle: [t('Throttle'), number(({ values }) => values.throttlePercent, '%', 0, [0, 100])],
  gps: [
    'GPS',
    ({ values: { gpsFix, gpsNumber, satellites } }) => ({
      text: gpsFix ?? UNKNOWN,
      unit: [
        gpsNumber === null ? '' : t('GPS {gpsNumber}', { gpsNumber }),
        satellites === null ? '' : t('{satellites} sat', { satellites }),
      ]
        .filter(Boolean)
        .join(', '),
      raw: gpsFix ?? '',
      number: satellites,
    }),
  ],
  estimator: [
    t('Estimator (EKF)'),
    ({ values: { estimator } }) => ({
      text: estimator?.text ?? UNKNOWN,
      unit: '',
      raw: estimator?.tone ?? '',
      number: null,
      ...(estimator === null || estimator.tone === 'good' ? {} : { tone: estimator.tone }),
    }),
  ],
  wind: [
    t('Wind'),
    ({ values: { wind, headingDeg }, units }) => {
      if (!wind) return { text: UNKNOWN, unit: '', raw: '', number: null, isHidden: true };
      const speed = measure(units, 'speed', wind.mps);
      const isCalm = wind.mps < CALM_MPS;
      return {
        label: isCalm ? t('Wind') : t('Wind from'),
        text: isCalm ? t('calm') : `${fixed(wind.fromDeg).padStart(3, '0')}°`,
        unit: `${speed.text} ${speed.unit}`,
        raw: plain(wind.mps),
        number: wind.mps,
        ends: [0, 15],
        // Where it blows to, with the drone's nose up.
        ...(isCalm ? {} : { arrowDeg: (wind.fromDeg + 180 - (headingDeg ?? 0) + 360) % 360 }),
      };
    },
  ],
  landed: [t('Ground contact'), words(({ landed }) => landed)],
  'distance-to-home': [t('To home'), of('distance', ({ homeDistanceM }) => homeDistanceM)],
  'distance-to-target': [t('To target'), of('distance', ({ targetDistanceM }) => targetDistanceM)],
  'flight-time': [
    t('Time in air'),
    ({ values: { airborneMs } }) => ({
      text: duration(airborneMs),
      unit: '',
      raw: plain(airborneMs),
      number: airborneMs,
    }),
  ],
  link: [
    t('Link round trip'),
    ({ values }) => ({
      text: fixed(values.linkRttMs),
      unit:
        values.linkLossPercent === null ? '' : t('ms {linkLoss} % lost', { linkLoss: fixed(values.linkLossPercent) }),
      raw: plain(values.linkRttMs),
      number: values.linkRttMs,
      ends: [0, 500],
    }),
  ],
  latitude: [
    t('Latitude'),
    ({ values: { place } }) => ({
      text: fixed(place?.latDeg ?? null, 6),
      unit: '',
      raw: plain(place?.latDeg ?? null, 7),
      number: null,
    }),
  ],
  longitude: [
    t('Longitude'),
    ({ values: { place } }) => ({
      text: fixed(place?.lonDeg ?? null, 6),
      unit: '',
      raw: plain(place?.lonDeg ?? null, 7),
      number: null,
    }),
  ],
  roll: [t('Roll'), number(({ values }) => values.rollDeg, '°', 0, [-45, 45])],
  pitch: [t('Pitch'), number(({ values }) => values.pitchDeg, '°', 0, [-45, 45])],
  g: [
    t('Load factor (g), from the bank angle'),
    number(
      ({ values: { rollDeg, pitchDeg } }) =>
        rollDeg === null || pitchDeg === null
          ? null
          : 1 / Math.max(0.1, Math.cos(radians(rollDeg)) * Math.cos(radians(pitchDeg))),
      'g',
      2,
      [0, 3],
    ),
  ],
  vibration: [
    t('Vibration, worst axis'),
    number(
      ({ telemetry }) => {
        const felt = telemetry.newest('VIBRATION')?.fields;
        return felt ? Math.max(felt.vibration_x, felt.vibration_y, felt.vibration_z) : null;
      },
      'm/s²',
      1,
      [0, 60],
    ),
  ],
};

export const NAMED_VALUES: readonly { readonly id: string; readonly label: string }[] = Object.entries(NAMED).map(
  ([id, [label]]) => ({ id, label }),
);

export const labelOf = (id: string): string => NAMED[id]?.[0] ?? id;

/** What to show for an id; a field that was not heard is a dash. */
export function shownValue(id: string, known: Known): ShownValue {
  const named = NAMED[id];
  if (named) return { label: named[0], ...named[1](known) };
  const at = id.indexOf('.');
  const received = known.telemetry.newest(id.slice(0, at) as MessageName);
  const field = (received?.fields as Record<string, unknown> | undefined)?.[id.slice(at + 1)];
  const value = typeof field === 'number' ? field : typeof field === 'bigint' ? Number(field) : null;
  const text = value === null ? UNKNOWN : Number.isInteger(value) ? String(value) : fixed(value, 3);
  return { label: id, text, unit: '', raw: plain(value, 6), number: value };
}

/** Ids of every number in the messages that this drone has sent. */
export function heardFields(telemetry: Telemetry): readonly string[] {
  return telemetry.heard
    .flatMap((name) => {
      const fields = telemetry.newest(name)?.fields as Record<string, unknown> | undefined;
      return Object.entries(fields ?? {})
        .filter(([, value]) => typeof value === 'number' || typeof value === 'bigint')
        .map(([field]) => `${name}.${field}`);
    })
    .sort();
}
