/** A summary of an item for a table row: its characteristic values. Numbers are in the reader's units. */

import { t } from '../languages/text';
import { CMD, specOf, type ParamSpec } from './catalogue';
import type { Plan, PlanItem } from './plan_types';
import { shortFloat } from './formats/plan_file';

export interface InUnits {
  readonly metres: (value: number) => string;
  readonly speed: (value: number) => string;
}

const OPEN = 'open';

function valueWords(spec: ParamSpec, value: number | null, units: InUnits): string {
  if (value === null) return OPEN;
  const choice = spec.choices?.find(([number]) => number === value);
  if (choice) return choice[1];
  if (spec.unit === 'm') return units.metres(value);
  if (spec.unit === 'm/s') return units.speed(value);
  const number = `${shortFloat(value)}`;
  if (spec.unit === 'deg') return `${number}°`;
  return spec.unit === '' ? number : `${number} ${spec.unit}`;
}

/** Commands with a text of their own, such as "2 turns"; the others use the parameter's name. */
const ALONE: ReadonlyMap<number, (item: PlanItem, units: InUnits) => string> = new Map([
  [
    CMD.CHANGE_SPEED,
    ({ params: [, speed] }, units) => (speed !== null && speed >= 0 ? units.speed(speed) : t('its usual')),
  ],
  [
    CMD.TRIGGER_DISTANCE,
    ({ params: [every] }, units) => (every ? t('every {every}', { every: units.metres(every) }) : t('stop')),
  ],
  [
    CMD.NAV_DELAY,
    ({ params: [time] }) => (time !== null && time >= 0 ? `${shortFloat(time)} s` : t('until a time of day')),
  ],
  [CMD.LOITER_TIME, ({ params: [time] }) => `${shortFloat(time ?? 0)} s`],
  [
    CMD.LOITER_TURNS,
    ({ params: [turns, , radius] }, units) =>
      t('{turns} × at {metres}', { turns: shortFloat(turns ?? 0), metres: units.metres(Math.abs(radius ?? 0)) }),
  ],
]);

export function itemWords(plan: Plan, item: PlanItem, units: InUnits): string {
  if (item.command === CMD.JUMP) {
    const target = plan.items.findIndex(({ id }) => id === item.jumpTo);
    const times = item.params[1] ?? 0;
    const to = target < 0 ? t('nowhere') : t('to item {target}', { target: target + 1 });
    return times < 0 ? t('{to}, for ever', { to }) : `${to}, ${shortFloat(times)} ×`;
  }
  const alone = ALONE.get(item.command);
  if (alone) return alone(item, units);
  const spec = specOf(item.command);
  if (!spec)
    return t('numbers {params}', {
      params: item.params.map((value) => (value === null ? OPEN : shortFloat(value))).join(', '),
    });
  const said = spec.params.filter((one) => item.params[one.at] !== one.initial && item.params[one.at] !== null);
  return said
    .map((one) => `${one.name.split(',')[0]!.toLowerCase()} ${valueWords(one, item.params[one.at], units)}`)
    .join(', ');
}
