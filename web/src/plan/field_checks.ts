/** Faults of one field of an item, in words: for the table, during typing. Whole plans: plan_checks.ts. */

import { t } from '../languages/text';
import { CMD, specOf, type ParamSpec } from './catalogue';
import { datumOf, FRAME } from './frames';
import { cleanOutline, crossingsOf } from './outline';
import { isOnEarth, type FenceShape, type Param, type PlanItem, type RallyPoint, type Spot } from './plan_types';

export type Field = 'command' | 'frame' | 'place' | 'height' | 'p1' | 'p2' | 'p3' | 'p4';

export interface Fault {
  readonly field: Field;
  readonly words: string;
}

const PARAM_FIELDS = ['p1', 'p2', 'p3', 'p4'] as const;
/** Below the Dead Sea, and above the ceiling of any of these aircraft. */
export const MIN_HEIGHT_M = -500;
export const MAX_HEIGHT_M = 10_000;
export const MAX_RADIUS_M = 100_000;

const withUnit = (value: number, unit: string): string => (unit === '' ? `${value}` : `${value} ${unit}`);

export function paramFault(spec: ParamSpec, value: Param): string | null {
  const { name, unit, least, most, choices } = spec;
  if (value === null) return spec.mayBeOpen ? null : t('{name}: a number is needed.', { name });
  if (!Number.isFinite(value)) return t('{name}: that is not a number.', { name });
  if (choices) {
    if (choices.some(([number]) => number === value)) return null;
    return t('{name}: {value} is none of {choices}.', {
      name,
      value,
      choices: choices.map(([number, label]) => `${number} (${label})`).join(', '),
    });
  }
  if (spec.whole && !Number.isInteger(value)) return t('{name}: a whole number is needed.', { name });
  const [isLow, isHigh] = [least !== undefined && value < least, most !== undefined && value > most];
  if (!isLow && !isHigh) return null;
  if (least !== undefined && most !== undefined) {
    return t('{name}: {withUnit} is outside of {least} to {withUnit2}.', {
      name,
      withUnit: withUnit(value, unit),
      least,
      withUnit2: withUnit(most, unit),
    });
  }
  return isLow
    ? t('{name}: {withUnit} is less than {withUnit2}.', {
        name,
        withUnit: withUnit(value, unit),
        withUnit2: withUnit(least!, unit),
      })
    : t('{name}: {withUnit} is more than {withUnit2}.', {
        name,
        withUnit: withUnit(value, unit),
        withUnit2: withUnit(most!, unit),
      });
}

export function heightFault(heightM: number): string | null {
  if (!Number.isFinite(heightM)) return t('Height: a number is needed.');
  if (heightM >= MIN_HEIGHT_M && heightM <= MAX_HEIGHT_M) return null;
  return t('Height: {height} m is outside of {minHeight} to {maxHeight} m.', {
    height: heightM,
    minHeight: MIN_HEIGHT_M,
    maxHeight: MAX_HEIGHT_M,
  });
}

/** Autopilots take 0, 0 as "no place". */
export const isNoPlace = (spot: Spot): boolean => spot.latE7 === 0 && spot.lonE7 === 0;

/** Every fault of an item; `count` is the number of items in its plan. */
export function itemFaults(item: PlanItem, count: number): Fault[] {
  const faults: Fault[] = [];
  const add = (field: Field, words: string | null): void => {
    if (words !== null) faults.push({ field, words });
  };
  if (!Number.isInteger(item.command) || item.command < 0 || item.command > 0xffff) {
    add('command', t('Command: a whole number from 0 to 65535 is needed.'));
  }
  const spec = specOf(item.command);
  if (!spec) {
    for (const [at, value] of item.params.entries()) {
      if (value !== null && !Number.isFinite(value))
        add(PARAM_FIELDS[at]!, t('Parameter {at}: that is not a number.', { at: at + 1 }));
    }
    if (!Number.isFinite(item.z)) add('height', heightFault(item.z));
    return faults;
  }
  for (const one of spec.params) {
    // A jump's target is chosen among the items, whatever the number says.
    if (item.command === CMD.JUMP && one.at === 0) continue;
    add(PARAM_FIELDS[one.at], paramFault(one, item.params[one.at]));
  }
  if (item.command === CMD.JUMP && item.jumpTo === null) {
    const target = item.params[0];
    add(
      'p1',
      target !== null && target >= 0
        ? t('To item: there is no item {target}, there are {count}.', { target: target + 1, count })
        : t('To item: choose one.'),
    );
  }
  const spot = { latE7: item.x, lonE7: item.y };
  if (spec.place !== 'none') {
    const isOpen = spec.place === 'here-if-none' && isNoPlace(spot);
    if (datumOf(item.frame) === null && !(isOpen && item.frame === FRAME.MISSION)) {
      add('frame', t('Height measured from: frame {frame} is not one of places on earth.', { frame: item.frame }));
    }
    if (!isOnEarth(spot)) add('place', t('Place: latitude is from -90 to 90 degrees, longitude from -180 to 180.'));
    else if (spec.place === 'needed' && isNoPlace(spot)) add('place', t('Place: it has none yet (0, 0).'));
  }
  if (spec.height) add('height', heightFault(item.z));
  return faults;
}

export function shapeFaults(shape: FenceShape): string[] {
  const faults: string[] = [];
  const spots = shape.shape === 'polygon' ? shape.corners : [shape.centre];
  if (!spots.every(isOnEarth)) faults.push(t('A corner or centre is not a place on earth.'));
  if (shape.shape === 'polygon') {
    const { corners } = cleanOutline(shape.corners);
    if (corners.length < 3) faults.push(t('A polygon has three corners at least.'));
    else if (crossingsOf(corners).length > 0) {
      faults.push(t('Its border crosses itself: inside and outside are not what they seem.'));
    }
  } else if (!(shape.radiusM > 0 && shape.radiusM <= MAX_RADIUS_M)) {
    faults.push(t('Radius: more than 0 and at most {maxRadius} m are needed.', { maxRadius: MAX_RADIUS_M }));
  }
  return faults;
}

export function rallyFaults(point: RallyPoint): string[] {
  const faults: string[] = [];
  if (!isOnEarth(point.spot) || isNoPlace(point.spot)) faults.push(t('It is not a place on earth.'));
  const height = heightFault(point.heightM);
  if (height) faults.push(height);
  return faults;
}
