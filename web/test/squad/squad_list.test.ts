import { describe, expect, it } from 'vitest';

import type { Alert } from '../../src/link/alerts';
import { flightValues, type FlightValues } from '../../src/link/flight_values';
import { Telemetry } from '../../src/link/telemetry';
import { readHold } from '../../src/link/hold_view';
import { troubleOf } from '../../src/link/trouble';
import type { Drone, HoldView } from '../../src/link/wire_types';
import { matches, passes, sorted, windowOf, type SortKey, type SquadEntry } from '../../src/squad/squad_list';
import { A_DRONE, A_HOLD, anAlert, heartbeat } from '../link/fakes';

const OLGA = { id: 5, name: 'olga' };
const BESIDE = { online: true, armed: false, target: null, link: null, airborneSinceMs: null, batteryTime: null };

function entry(
  drone: Partial<Drone>,
  values: Partial<FlightValues> = {},
  trouble: Partial<Alert> | null = null,
): SquadEntry {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(5), 0);
  const whole = { ...A_DRONE, ...drone };
  const now = { ...flightValues(telemetry, BESIDE, 0), ...values };
  return {
    drone: whole,
    values: now,
    link: null,
    hold: null,
    trouble: trouble && troubleOf([anAlert(trouble)]),
    silence: null,
  };
}

const HERON = entry({ id: 1, name: 'Heron', holder: OLGA }, { state: 'flying', airborne: true, batteryPercent: 40 });
const SWIFT = entry(
  { id: 2, name: 'Swift' },
  { state: 'flying', airborne: true, batteryPercent: 90 },
  { rule: 'unattended', rank: 19 },
);
const PLOVER = entry({ id: 3, name: 'Plover 10', online: false }, { state: 'lost', batteryPercent: null });
const PLOVER_2 = entry(
  { id: 4, name: 'Plover 9' },
  { state: 'alert', batteryPercent: 40 },
  { rule: 'emergency', severity: 'critical', rank: 8 },
);
const SQUAD = [HERON, SWIFT, PLOVER, PLOVER_2];

const names = (entries: readonly SquadEntry[]): string[] => entries.map(({ drone }) => drone.name);
const by = (key: SortKey, isDescending = false): string[] => names(sorted(SQUAD, { key, isDescending }));

describe('sorting', () => {
  it('by name reads numbers as numbers', () => {
    expect(by('name')).toEqual(['Heron', 'Plover 9', 'Plover 10', 'Swift']);
    expect(by('name', true)).toEqual(['Swift', 'Plover 10', 'Plover 9', 'Heron']);
  });

  it('by state begins with what wants attention most', () => {
    expect(by('state')).toEqual(['Plover 9', 'Swift', 'Heron', 'Plover 10']);
  });

  it('puts what is not known last, either way, and equals by name', () => {
    expect(by('battery')).toEqual(['Heron', 'Plover 9', 'Swift', 'Plover 10']);
    expect(by('battery', true)).toEqual(['Swift', 'Heron', 'Plover 9', 'Plover 10']);
  });
});

describe('attention first', () => {
  it('begins with a link lost in the air, then the batteries', () => {
    const flies = { state: 'flying', airborne: true } as const;
    const lost = entry({ id: 5, name: 'Lost', online: false }, { state: 'lost' }, { rule: 'link-lost', rank: 0 });
    const critical = entry({ id: 6, name: 'Critical', holder: OLGA }, flies, { rule: 'battery-critical', rank: 3 });
    const low = entry({ id: 7, name: 'Low', holder: OLGA }, flies, { rule: 'battery-low', rank: 7 });
    const order = { key: 'state', isDescending: false } as const;
    expect(names(sorted([...SQUAD, low, critical, lost], order)).slice(0, 4)).toEqual([
      'Lost',
      'Critical',
      'Low',
      'Plover 9',
    ]);
    expect(passes(lost, 'attention', OLGA)).toBe(true);
  });
});

describe('a drone whose lost action is counted down', () => {
  const reading = (phase: HoldView['phase']) =>
    readHold({ ...A_HOLD, phase }, { droneName: 'Heron', lostActionS: 30, towerLagMs: 0 }, 0);

  it('wants attention though somebody has its controls; one that is held alone does not', () => {
    const [counted, held] = (['counting', 'quiet'] as const).map((phase) => ({
      ...entry(
        { ...HERON.drone, hold: { ...A_HOLD, phase } },
        { state: 'flying', airborne: true },
        phase === 'counting' ? { rule: 'lost-action-counting', rank: 13 } : null,
      ),
      hold: reading(phase),
    }));
    expect(passes(counted!, 'attention', OLGA)).toBe(true);
    expect(passes(held!, 'attention', OLGA)).toBe(false);
    const order = sorted([held!, { ...counted!, drone: { ...counted!.drone, name: 'Z' } }], {
      key: 'state',
      isDescending: false,
    });
    expect(names(order)).toEqual(['Z', 'Heron']);
  });
});

describe('filters', () => {
  it.each([
    ['all', ['Heron', 'Swift', 'Plover 10', 'Plover 9']],
    ['mine', ['Heron']],
    ['flying', ['Heron', 'Swift']],
    ['unattended', ['Swift']],
    ['attention', ['Swift', 'Plover 9']],
    ['online', ['Heron', 'Swift', 'Plover 9']],
    ['offline', ['Plover 10']],
  ] as const)('%s', (filter, expected) => {
    expect(names(SQUAD.filter((one) => passes(one, filter, OLGA)))).toEqual(expected);
  });
});

describe('searching', () => {
  it.each([
    ['', 4],
    ['plov', 2],
    ['PLOVER 9', 1],
    ['olga', 4],
    ['loiter heron', 1],
    ['free', 3],
    ['nobody', 0],
  ] as const)('%j finds %d', (search, count) => {
    expect(SQUAD.filter((one) => matches(one, search))).toHaveLength(count);
  });
});

describe('the window of a long list', () => {
  it('is what can be seen and a little more', () => {
    expect(windowOf(200, 100, 0, 450)).toEqual({ first: 0, end: 9 });
    expect(windowOf(200, 100, 5_000, 450)).toEqual({ first: 46, end: 59 });
    expect(windowOf(200, 100, 19_900, 450)).toEqual({ first: 195, end: 200 });
  });

  it('of an empty or a suddenly shorter list is no trouble', () => {
    expect(windowOf(0, 100, 0, 450)).toEqual({ first: 0, end: 0 });
    expect(windowOf(3, 100, 5_000, 450)).toEqual({ first: 0, end: 3 });
  });
});
