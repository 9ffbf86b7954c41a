/** QGroundControl file formats of the last ten years that are no longer written. */

import { describe, expect, it } from 'vitest';

import { NotAPlanFile } from '../../src/plan/formats/plan_file';
import { spotOf } from '../../src/plan/plan_types';
import { open, rows, TAKEOFF, WAYPOINT, JUMP_TO_SECOND } from './opened_files';

describe('a .mission of QGroundControl', () => {
  const place = (command: number, latDeg: number, lonDeg: number, heightM: number): object => ({
    autoContinue: true,
    command,
    coordinate: [latDeg, lonDeg, heightM],
    frame: 3,
  });
  const home = { ...place(16, 47.3977, 8.5456, 488), frame: 0, id: 0, param1: 0, param2: 0, param3: 0, param4: 0 };

  it('of the first form: parameters by name, jumps by id, home an item, no file type', () => {
    const { plan, dropped } = open(
      JSON.stringify({
        MAV_AUTOPILOT: 3,
        complexItems: [],
        groundStation: 'QGroundControl',
        items: [
          {
            ...place(22, 47.3977, 8.5456, 25),
            id: 1,
            param1: 15,
            param2: 0,
            param3: 0,
            param4: 0,
            type: 'missionItem',
          },
          { ...place(16, 47.3982, 8.5441, 40), id: 2, param1: 2, param2: 0, param3: 0, param4: 0, type: 'missionItem' },
          { ...place(177, 0, 0, 0), frame: 2, id: 3, param1: 2, param2: 3, param3: 0, param4: 0, type: 'missionItem' },
        ],
        plannedHomePosition: home,
        version: '1.0',
      }),
    );
    expect(rows(plan, 'mission')).toEqual([TAKEOFF, WAYPOINT, JUMP_TO_SECOND]);
    expect(plan.home).toEqual({ spot: spotOf(47.3977, 8.5456), altM: 488 });
    expect(dropped).toEqual([]);
  });

  it('of the first form with a survey: its outline, in its place among the items', () => {
    const { areas, dropped, plan } = open(
      JSON.stringify({
        MAV_AUTOPILOT: 12,
        complexItems: [
          {
            id: 2,
            polygon: [
              [47.1, 8.1],
              [47.2, 8.1],
              [47.2, 8.2],
            ],
            type: 'survey',
            version: 1,
          },
        ],
        items: [
          {
            ...place(22, 47.3977, 8.5456, 25),
            id: 1,
            param1: 15,
            param2: 0,
            param3: 0,
            param4: 0,
            type: 'missionItem',
          },
          {
            ...place(16, 47.3982, 8.5441, 40),
            id: 30,
            param1: 2,
            param2: 0,
            param3: 0,
            param4: 0,
            type: 'missionItem',
          },
          {
            ...place(177, 0, 0, 0),
            frame: 2,
            id: 31,
            param1: 30,
            param2: 3,
            param3: 0,
            param4: 0,
            type: 'missionItem',
          },
        ],
        plannedHomePosition: home,
        version: '1.0',
      }),
    );
    expect(rows(plan, 'mission')).toEqual([TAKEOFF, WAYPOINT, JUMP_TO_SECOND]);
    expect(areas.map(({ corners }) => corners)).toEqual([[spotOf(47.1, 8.1), spotOf(47.2, 8.1), spotOf(47.2, 8.2)]]);
    expect(dropped).toEqual([
      'Item 2, a survey: the file does not say which waypoints it stands for. Its outline was taken, its settings were not.',
    ]);
  });

  const four = (command: number, params: number[], at: readonly number[], doJumpId: number, frame = 3): object => ({
    autoContinue: true,
    command,
    coordinate: at,
    doJumpId,
    frame,
    params,
    type: 'SimpleItem',
  });
  const second = {
    cruiseSpeed: 16,
    firmwareType: 12,
    hoverSpeed: 4,
    items: [
      four(22, [15, 0, 0, 0], [47.3977, 8.5456, 25], 1),
      four(16, [2, 0, 0, 0], [47.3982, 8.5441, 40], 2),
      four(177, [2, 3, 0, 0], [0, 0, 0], 3, 2),
    ],
    plannedHomePosition: [47.3977, 8.5456, 488],
    vehicleType: 2,
    version: 2,
  };

  it.each([
    ['in a file of its own', { fileType: 'Mission', ...second }],
    ['in a .plan', { fileType: 'Plan', version: 1, mission: second }],
    ['of Mission Planner, without a file type', { groundStation: 'MissionPlanner', fileType: null, mission: second }],
  ])('of four parameters and a place, %s', (_where, json) => {
    const { plan, dropped, format } = open(JSON.stringify(json));
    expect(format).toBe('QGroundControl plan');
    expect(rows(plan, 'mission')).toEqual([TAKEOFF, WAYPOINT, JUMP_TO_SECOND]);
    expect(plan.home).toEqual({ spot: spotOf(47.3977, 8.5456), altM: 488 });
    expect(plan.defaults.speedMS).toBe(4);
    expect(dropped).toEqual([]);
  });

  it('of Mission Planner, which numbers no item: jumps count them, home being 0', () => {
    const items = second.items.map((item) => ({ ...item, doJumpId: 0, type: null }));
    const { plan, dropped } = open(JSON.stringify({ version: 1, mission: { ...second, items } }));
    expect(rows(plan, 'mission')).toEqual([TAKEOFF, WAYPOINT, JUMP_TO_SECOND]);
    expect(dropped).toEqual([]);
  });

  it('says where a height was computed from the ground', () => {
    const items = [{ ...four(16, [2, 0, 0, 0], [47.3982, 8.5441, 540], 1, 0), AltitudeMode: 3, Altitude: 40 }];
    const { dropped } = open(JSON.stringify({ fileType: 'Mission', ...second, items }));
    expect(dropped).toEqual([
      'Item 1: its height was computed from the ground there; it is kept as a height above the sea.',
    ]);
  });

  it.each([
    [{ ...second, version: 3 }, 'other than 1 and 2'],
    [{ ...second, items: [{ type: 'SimpleItem', command: 16, frame: 3, params: [0, 0, 0, 0] }] }, 'seven parameters'],
    [{ ...second, items: [{ type: 'missionItem', command: 16, frame: 3, param1: 0 }] }, 'does not have its parameters'],
  ])('that is damaged is refused in words: %#', (json, words) => {
    expect(() => open(JSON.stringify({ fileType: 'Mission', ...json }))).toThrow(NotAPlanFile);
    expect(() => open(JSON.stringify({ fileType: 'Mission', ...json }))).toThrow(words);
  });
});

describe('other parts of old plans', () => {
  it('.fence and .rally of QGroundControl are files of their own', () => {
    const polygon = [
      [47.1, 8.1],
      [47.2, 8.1],
      [47.2, 8.2],
    ];
    const parameters = [{ compId: 1, name: 'FENCE_RADIUS', value: 150 }];
    const fence = open(
      JSON.stringify({ fileType: 'GeoFence', version: 1, polygon, breachReturn: [47.15, 8.15], parameters }),
    );
    expect(rows(fence.plan, 'fence')).toHaveLength(4);
    expect(fence.dropped).toEqual([
      'The parameters of the fence (circle, heights, what happens) are left out: set them on the drone.',
      'The fence is of version 1: its border was taken as one to stay inside of.',
    ]);
    const rally = open(JSON.stringify({ fileType: 'RallyPoints', version: 1, points: [[47.1, 8.1, 30]] }));
    expect(rows(rally.plan, 'rally')).toEqual([[5100, 3, [0, 0, 0, 0], 471_000_000, 81_000_000, 30, 1]]);
  });

  it('a survey of 2017, which has no items, gives its outline', () => {
    const survey = {
      complexItemType: 'survey',
      grid: { altitude: 50, angle: 30, spacing: 20 },
      polygon: [
        [47.1, 8.1],
        [47.2, 8.1],
        [47.2, 8.2],
      ],
      type: 'ComplexItem',
      version: 3,
    };
    const { areas, dropped } = open(JSON.stringify({ fileType: 'Plan', version: 1, mission: { items: [survey] } }));
    expect(areas).toHaveLength(1);
    expect(dropped[0]).toContain('Item 1, a survey: the file does not say which waypoints');
  });
});
