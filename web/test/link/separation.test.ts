import { beforeEach, describe, expect, it } from 'vitest';

import { Rest } from '../../src/link/rest';
import { directionWords, nearLines, separationWords } from '../../src/link/separation';
import { Tower } from '../../src/link/tower';
import { offsetBy } from '../../src/link/geometry';
import type { SeparationEvent } from '../../src/link/wire_types';
import { A_DRONE, FakeClock, FakeSocket } from './fakes';

const OLGA = { id: 5, name: 'olga', role: 'operator' };
const HERON = { ...A_DRONE, id: 1, name: 'heron' };
const KITE = { ...A_DRONE, id: 2, name: 'kite' };
const PLACE = { latDeg: 47, lonDeg: 8 };

const event = (changes: Partial<SeparationEvent> = {}): SeparationEvent => ({
  type: 'separation',
  number: 3,
  level: 'caution',
  drones: [1, 2],
  in_s: 18,
  horizontal_m: 4.2,
  vertical_m: 1.7,
  bearing_deg: 90,
  distance_m: 120,
  above_m: 2,
  why: '',
  ...changes,
});
const CLEAR = event({
  level: 'clear',
  in_s: null,
  horizontal_m: null,
  vertical_m: null,
  bearing_deg: null,
  distance_m: null,
  above_m: null,
  why: 'apart',
});

let clock: FakeClock;
let socket: FakeSocket;
let tower: Tower;
const alerts = () =>
  tower.alertFeed.alerts.list.get().map(({ severity, droneId, isLasting }) => ({ severity, droneId, isLasting }));
const near = () => [...tower.alertFeed.separations.near.get().keys()];

beforeEach(async () => {
  clock = new FakeClock();
  socket = new FakeSocket();
  const rest = new Rest(() => Promise.resolve(new Response(JSON.stringify(OLGA), { status: 200 })));
  tower = new Tower({ clock, rest, openSocket: () => socket });
  await tower.signIn('olga', 'secret');
  socket.says({ type: 'welcome', user: OLGA, drones: [HERON, KITE], server_time: '' });
});

describe('drones that come near each other', () => {
  it('are one alert each time, and another when it becomes a warning', () => {
    for (const inS of [18, 16, 14]) socket.says(event({ in_s: inS }));
    expect(alerts()).toEqual([{ severity: 'warning', droneId: 1, isLasting: true }]);
    socket.says(event({ level: 'warning', in_s: 9 }));
    socket.says(event({ level: 'caution', in_s: 3 }));
    expect(alerts()).toEqual([
      { severity: 'warning', droneId: 1, isLasting: false },
      { severity: 'critical', droneId: 1, isLasting: true },
    ]);
    socket.says(CLEAR);
    expect(alerts().map(({ isLasting }) => isLasting)).toEqual([false, false]);
    expect(near()).toEqual([]);
  });

  it('are an alert with the names of both, in words', () => {
    socket.says(event());
    expect(tower.alertFeed.alerts.list.get()[0]!.text).toBe(
      'heron and kite will be 4 m apart, 2 m in height, in 18 s.',
    );
  });

  it('stay an alert over a new connection only while the tower says so', async () => {
    socket.says(event());
    socket.says(event({ number: 4, level: 'warning' }));
    const welcome = { type: 'welcome', user: OLGA, drones: [HERON, KITE], server_time: '' };
    socket.says(welcome);
    socket.says(event({ in_s: 5 }));
    tower.look();
    expect(near()).toEqual([3, 4]);
    await clock.pass(5_000);
    tower.look();
    expect(near()).toEqual([3]);
    expect(alerts()).toEqual([
      { severity: 'warning', droneId: 1, isLasting: true },
      { severity: 'critical', droneId: 1, isLasting: false },
    ]);
  });

  it('are no alert any more when one of them is no longer ours to see', () => {
    socket.says(event());
    socket.says({ type: 'drone_removed', drone_id: 2 });
    expect(near()).toEqual([]);
    socket.says(event({ drones: [1, null] }));
    expect(near()).toEqual([3]);
    expect(tower.alertFeed.alerts.list.get().at(-1)!.text).toContain('heron and another drone');
  });
});

describe('in words', () => {
  const name = (droneId: number): string => (droneId === 1 ? 'heron' : 'kite');
  it.each([
    [event({ in_s: 0.4, horizontal_m: 6, vertical_m: 3 }), 'heron and kite are 6 m apart, 3 m in height.'],
    [
      event({ drones: [1, null], in_s: 15, horizontal_m: null, vertical_m: null, above_m: 5 }),
      'heron and another drone will be close in about 15 s. Seen from heron it is about 120 m to the east (090°), about 5 m higher.',
    ],
    [
      event({ drones: [2, null], in_s: 0, horizontal_m: null, vertical_m: null, above_m: 0, bearing_deg: 30 }),
      'kite and another drone are near each other. Seen from kite it is about 120 m to the north-east (030°), at about the same height.',
    ],
    [
      event({ drones: [1, null], in_s: null, bearing_deg: null, distance_m: null, above_m: null }),
      'heron and another drone are near each other.',
    ],
    [event({ in_s: null, horizontal_m: null, vertical_m: null }), 'heron and kite are too near each other.'],
  ])('%#', (said, words) => {
    expect(separationWords(said, name)).toBe(words);
  });

  it('directions are the nearest of eight', () => {
    expect([0, 22, 23, 90, 179, 226, 337, 338, 359.9, -45].map(directionWords)).toEqual([
      'north',
      'north',
      'north-east',
      'east',
      'south',
      'south-west',
      'north-west',
      'north',
      'north',
      'north-west',
    ]);
  });
});

describe('lines of the map', () => {
  const places = new Map([
    [1, PLACE],
    [2, offsetBy(PLACE, 0, 100)],
  ]);
  const placeOf = (droneId: number) => places.get(droneId) ?? null;

  it('go from one drone to the other', () => {
    const [line] = nearLines([event()], placeOf);
    expect(line).toMatchObject({ from: PLACE, to: places.get(2), isWarning: false, isStranger: false });
    expect(line!.label).toBe('120 m, 2 m in height');
  });

  it('end where the tower says that a stranger is', () => {
    const [line] = nearLines([event({ drones: [1, null], level: 'warning' })], placeOf);
    const there = offsetBy(PLACE, 0, 120);
    expect(line!.isStranger && line!.isWarning).toBe(true);
    expect(line!.label).toBe('about 120 m, 2 m in height');
    expect(line!.to.latDeg).toBeCloseTo(there.latDeg, 9);
    expect(line!.to.lonDeg).toBeCloseTo(there.lonDeg, 9);
  });

  it('are none where a place is not known, and none of others where one drone is shown', () => {
    expect(nearLines([event({ drones: [7, 2] })], placeOf)).toEqual([]);
    expect(nearLines([event({ distance_m: null, bearing_deg: null, above_m: null })], placeOf)).toEqual([]);
    expect(nearLines([event()], placeOf, undefined, 9)).toEqual([]);
    expect(nearLines([event()], placeOf, undefined, 2)).toHaveLength(1);
  });
});
