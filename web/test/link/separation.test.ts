import { beforeEach, describe, expect, it } from 'vitest';

import { Rest } from '../../src/link/rest';
import { nearLines } from '../../src/link/separation';
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
const near = () => [...tower.separations.near.get().keys()];

beforeEach(async () => {
  clock = new FakeClock();
  socket = new FakeSocket();
  const rest = new Rest(() => Promise.resolve(new Response(JSON.stringify(OLGA), { status: 200 })));
  tower = new Tower({ clock, rest, openSocket: () => socket });
  await tower.signIn('olga', 'secret');
  socket.says({ type: 'welcome', user: OLGA, drones: [HERON, KITE], server_time: '' });
});

describe('drones that come near each other', () => {
  it('are near until the tower says that they are not', () => {
    for (const inS of [18, 16, 14]) socket.says(event({ in_s: inS }));
    expect(near()).toEqual([3]);
    socket.says(CLEAR);
    expect(near()).toEqual([]);
  });

  it('stay near over a new connection only while the tower says so', async () => {
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
  });

  it('are forgotten when one of them is no longer ours to see', () => {
    socket.says(event());
    socket.says({ type: 'drone_removed', drone_id: 2 });
    expect(near()).toEqual([]);
    socket.says(event({ drones: [1, null] }));
    expect(near()).toEqual([3]);
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
