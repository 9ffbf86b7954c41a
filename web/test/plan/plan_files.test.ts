import { readFileSync } from 'node:fs';

import { DOMParser } from '@xmldom/xmldom';
import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { writeGeoJson } from '../../src/plan/formats/geojson_plan';
import { writeKml } from '../../src/plan/formats/kml_plan';
import { openPlanFile } from '../../src/plan/formats/open_plan_file';
import { NotAPlanFile, type ReadFile } from '../../src/plan/formats/plan_file';
import { writeQgcPlan } from '../../src/plan/formats/qgc_plan';
import { writeWaypoints } from '../../src/plan/formats/waypoint_file';
import type { ParseXml } from '../../src/plan/formats/xml';
import { documentOf } from '../../src/plan/plan_document';
import { EMPTY_PLAN, spotOf, type Plan, type PlanKind } from '../../src/plan/plan_types';
import { itemsOf, missionItems } from '../../src/plan/wire_items';
import { drawnPlan } from './plan_arbitraries';
import { examples } from '../examples';

const parseXml: ParseXml = (text) =>
  new DOMParser({
    onError: (level, message) => {
      if (level !== 'warning') throw new Error(message);
    },
  }).parseFromString(text, 'application/xml') as unknown as Document;

const DEFAULTS = { heightM: 60, frame: 3, speedMS: 4 };
const open = (text: string): ReadFile => openPlanFile(text, { defaults: DEFAULTS }, parseXml);
const sample = (name: string): string => readFileSync(new URL(`files/${name}`, import.meta.url), 'utf8');
const KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];

/** As sent, polygons of the fence before its circles: the order has no meaning, and `.plan` does not preserve it. */
function sent(plan: Plan): unknown {
  const shapes = plan.fence.shapes.toSorted((a, b) => b.shape.localeCompare(a.shape));
  const sorted = { ...plan, fence: { ...plan.fence, shapes } };
  return KINDS.map((kind) => itemsOf(sorted, kind));
}

describe('a plan of QGroundControl', () => {
  const read = open(sample('survey.plan'));

  it('has its items, those of the survey in their place', () => {
    expect(read.format).toBe('QGroundControl plan');
    const items = missionItems(read.plan);
    expect(items.map((item) => item.command)).toEqual([22, 16, 206, 16, 206, 177, 203, 20]);
    expect(items[0]).toEqual({
      command: 22,
      frame: 3,
      params: [0, 0, 0, null],
      x: 473_977_420,
      y: 85_455_939,
      z: 30,
      autocontinue: 1,
    });
    expect(items[1]!.z).toBe(Math.fround(40.1));
  });

  it('has its jumps by their ids, and numbers that are no degrees as numbers', () => {
    const items = missionItems(read.plan);
    // "doJumpId" 5 is the fourth item, 3 counted from 0.
    expect(items[5]!.params).toEqual([3, 2, 0, 0]);
    expect(items[6]).toMatchObject({ x: 1, y: 0 });
  });

  it('has its fence, rally points, home and speed', () => {
    const { plan } = read;
    expect(plan.home).toEqual({ spot: spotOf(47.397742, 8.545594), altM: 488.25 });
    expect(plan.defaults).toEqual({ ...DEFAULTS, speedMS: 6.5 });
    expect(plan.rally).toMatchObject([{ frame: 3, spot: spotOf(47.3979, 8.5459), heightM: 50 }]);
    expect(plan.fence.shapes).toMatchObject([
      {
        shape: 'polygon',
        inclusion: false,
        corners: [spotOf(47.3985, 8.5441), spotOf(47.3989, 8.5441), spotOf(47.3989, 8.5449)],
      },
      { shape: 'circle', inclusion: true, centre: spotOf(47.3977, 8.5456), radiusM: 412.5 },
    ]);
  });

  it('says what was not taken', () => {
    expect(read.dropped).toEqual([
      'Item 2, a survey: its 4 items were taken, its outline and its settings for camera and spacing were not.',
      'Item 4, a structure scan, is left out: the file does not say which waypoints it stands for.',
      'Circle 2 of the fence is left out: it has no centre on earth or no radius.',
    ]);
  });

  it('comes back as it was written', () => {
    fc.assert(
      fc.property(drawnPlan, (plan) => {
        const again = open(writeQgcPlan(plan).text);
        expect(again.dropped).toEqual([]);
        expect(sent(again.plan)).toEqual(sent(plan));
        expect(again.plan.home?.altM).toBe(plan.home?.altM);
      }),
    );
  });

  it('says what QGroundControl cannot hold', () => {
    const corners = [spotOf(1, 1), spotOf(1, 2), spotOf(2, 2)];
    const shapes = [{ shape: 'polygon', id: 1, inclusion: true, group: 2, frame: 0, corners } as const];
    const rally = [{ id: 2, frame: 0, spot: spotOf(1, 1), heightM: 600 }];
    const { dropped } = writeQgcPlan({ ...EMPTY_PLAN, fence: { shapes, returnPoint: null }, rally });
    expect(dropped.join(' ')).toMatch(/groups.*rally points.*no home/);
  });
});

describe('a waypoint file', () => {
  it('of Mission Planner has home in its first line, and jumps that count it', () => {
    const { plan, dropped, format } = open(sample('mission.waypoints'));
    expect(format).toBe('waypoint file');
    expect(dropped).toEqual([]);
    expect(plan.home).toEqual({ spot: spotOf(47.397742, 8.5455939), altM: 488.25 });
    const items = missionItems(plan);
    expect(items.map((item) => item.command)).toEqual([22, 16, 203, 16, 177, 20]);
    expect(items[1]).toMatchObject({ params: [5, 0, 0, 0], x: 473_981_000, y: 85_451_000, z: Math.fround(40.1) });
    expect(items[2]).toMatchObject({ x: 1, y: 0 });
    expect(items[3]).toMatchObject({ frame: 10, x: -338_688_197, y: 1_512_092_955 });
    expect(items[4]!.params).toEqual([1, 3, 0, 0]);
  });

  it('comes back as it was written, one kind a file', () => {
    fc.assert(
      fc.property(drawnPlan, (plan) => {
        for (const kind of KINDS) {
          const { text } = writeWaypoints(plan, kind);
          if (itemsOf(plan, kind).length === 0) {
            expect(() => open(text)).toThrow('nothing to fly');
            continue;
          }
          const again = open(text);
          expect(again.dropped).toEqual([]);
          expect(itemsOf(again.plan, kind)).toEqual(itemsOf(plan, kind));
          for (const other of KINDS) if (other !== kind) expect(itemsOf(again.plan, other)).toEqual([]);
        }
      }),
    );
  });

  it('says what it cannot hold', () => {
    const rally = [{ id: 2, frame: 3, spot: spotOf(1, 1), heightM: 60 }];
    expect(writeWaypoints({ ...EMPTY_PLAN, rally }).dropped).toEqual([
      'Not in this file: 1 rally point. Such a file holds one kind; write another.',
      'The plan has no home: the file says 0, 0 in its place.',
    ]);
  });

  it('without home is read, and says so', () => {
    const { plan, dropped } = open('QGC WPL 110\n0\t1\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1\n');
    expect(missionItems(plan)).toHaveLength(1);
    expect(dropped).toEqual(['Line 2 is no home, as such files begin with: it was taken for the first item.']);
  });

  it.each([
    ['QGC WPL 130\n', 'version 130'],
    ['QGC WPL PB 110\n', 'plain text'],
    ['QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\n', 'Line 2 has 7 fields instead of 12'],
    ['QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\tnorth\t8\t0\t1\n', '"north" is not a number'],
    ['QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t1e9\t8\t0\t1\n', 'place on earth'],
    ['QGC WPL 110\n0\t1\t0\t-3\t0\t0\t0\t0\t47\t8\t0\t1\n', 'the command'],
    [
      `QGC WPL 110\n${Array.from({ length: 726 }, (_, at) => `${at}\t0\t${at ? 3 : 0}\t16\t0\t0\t0\t0\t47\t8\t0\t1\n`).join('')}`,
      '725 items; a drone takes 724 at most',
    ],
  ])('that is damaged is refused in words: %#', (text, words) => {
    expect(() => open(text)).toThrow(NotAPlanFile);
    expect(() => open(text)).toThrow(words);
  });
});

describe('GeoJSON', () => {
  it('of ours comes back whole', () => {
    fc.assert(
      fc.property(drawnPlan, (plan) => {
        const again = open(writeGeoJson(plan).text);
        expect(again.dropped).toEqual([]);
        expect(again.areas).toEqual([]);
        expect(KINDS.map((kind) => itemsOf(again.plan, kind))).toEqual(KINDS.map((kind) => itemsOf(plan, kind)));
        expect(again.plan.home).toEqual(plan.home);
      }),
    );
  });

  it('of ours takes over a point that was moved in another program', () => {
    const items = open(sample('mission.waypoints')).plan;
    const json = JSON.parse(writeGeoJson(items).text);
    const second = json.features.find((one: { properties: { name: string } }) => one.properties.name.startsWith('2 '));
    expect(second.properties.name).toBe('2 Waypoint, 40.1 m above home');
    second.geometry.coordinates = [9, 48];
    expect(missionItems(open(JSON.stringify(json)).plan)[1]).toMatchObject({ x: 48e7, y: 9e7, params: [5, 0, 0, 0] });
  });

  it('of others gives routes and outlines to be asked about', () => {
    const { plan, areas, dropped, routes } = open(
      JSON.stringify({
        type: 'FeatureCollection',
        features: [
          {
            type: 'Feature',
            properties: null,
            geometry: {
              type: 'LineString',
              coordinates: [
                [8.5, 47.1, 900],
                [8.6, 47.2],
              ],
            },
          },
          { type: 'Feature', properties: {}, geometry: { type: 'Point', coordinates: [500_000, 4_649_776] } },
          {
            type: 'Feature',
            properties: {},
            geometry: {
              type: 'Polygon',
              coordinates: [
                [
                  [1, 2],
                  [3, 2],
                  [3, 4],
                  [1, 2],
                ],
                [
                  [2, 2.2],
                  [2, 2.4],
                  [2.2, 2.4],
                  [2, 2.2],
                ],
              ],
            },
          },
          { type: 'Feature', properties: {}, geometry: { type: 'Curve', coordinates: [] } },
        ],
      }),
    );
    expect(missionItems(plan)).toEqual([]);
    expect(routes).toEqual([
      {
        name: '',
        frame: null,
        places: [
          { spot: spotOf(47.1, 8.5), heightM: 900 },
          { spot: spotOf(47.2, 8.6), heightM: null },
        ],
      },
    ]);
    expect(areas).toEqual([
      {
        name: '',
        corners: [spotOf(2, 1), spotOf(2, 3), spotOf(4, 3)],
        holes: [[spotOf(2.2, 2), spotOf(2.4, 2), spotOf(2.4, 2.2)]],
      },
    ]);
    expect(dropped).toEqual([
      'A shape of the kind "Curve" is left out.',
      '1 place left out: not on earth, latitude and longitude in degrees.',
    ]);
  });

  it('in another coordinate system is refused', () => {
    const crs = { type: 'name', properties: { name: 'urn:ogc:def:crs:EPSG::3857' } };
    expect(() => open(JSON.stringify({ type: 'FeatureCollection', crs, features: [] }))).toThrow('not in degrees');
  });
});

describe('KML', () => {
  it('of ours comes back whole', () => {
    fc.assert(
      fc.property(drawnPlan, fc.string(), (plan, name) => {
        const again = open(writeKml(plan, name.replace(/[\u0000-\u001f\ud800-\udfff\ufffe\uffff]/g, '')).text);
        expect(again.dropped).toEqual([]);
        expect(KINDS.map((kind) => itemsOf(again.plan, kind))).toEqual(KINDS.map((kind) => itemsOf(plan, kind)));
        expect(again.plan.home).toEqual(plan.home);
      }),
      { numRuns: examples(15, 60) },
    );
  });

  it('of others gives ways and outlines, and says what it left out', () => {
    const { plan, areas, dropped, format, routes } = open(sample('field.kml'));
    expect(format).toBe('KML');
    expect(plan.items).toEqual([]);
    expect(routes).toEqual([
      {
        name: 'Way',
        frame: 0,
        places: [
          { spot: spotOf(47.3977, 8.5455), heightM: 500 },
          { spot: spotOf(47.3981, 8.5461), heightM: 520 },
        ],
      },
    ]);
    expect(areas).toEqual([
      {
        name: 'Field',
        corners: [spotOf(47.398, 8.545), spotOf(47.398, 8.547), spotOf(47.3995, 8.547)],
        holes: [[spotOf(47.3982, 8.5462), spotOf(47.3982, 8.5464), spotOf(47.3984, 8.5464)]],
      },
    ]);
    expect(dropped).toEqual(['Image overlays on the map are left out.']);
  });
});

describe('a file', () => {
  it('that the library keeps is opened as well', () => {
    const { plan, format } = open(JSON.stringify(documentOf(open(sample('survey.plan')).plan)));
    expect(format).toBe('saved plan');
    expect(plan.items).toHaveLength(8);
  });

  it.each([
    ['', 'empty'],
    ['  \n', 'empty'],
    ['hello', 'no plan'],
    ['{"a": 1', 'not whole'],
    ['{"a": 1}', 'no plan'],
    ['[1]', 'no plan'],
    ['{"fileType": "Params"}', 'for "Params"'],
    ['{"fileType": "Plan", "version": 7, "mission": {}}', 'not of version 1'],
    ['{"fileType": "Plan", "version": 1, "mission": {"items": [{"type": "SimpleItem"}]}}', 'Item 1 has no command'],
    ['{"fileType": "Plan", "version": 1, "mission": {"items": [{"type": "Odd"}]}}', 'Item 1 is of no kind'],
    ['{"mission": [[1]], "fence": [], "rally": []}', 'Item 1 of the mission'],
    ['<kml><Document>', 'not whole'],
    ['<html/>', 'neither KML nor GPX: it begins with "html"'],
    ['<gpx/>', 'nothing to fly'],
    ['{"type": "FeatureCollection", "features": []}', 'nothing to fly'],
    ['QGC WPL', 'version (none)'],
  ])('that is no plan is refused in words: %j', (text, words) => {
    expect(() => open(text)).toThrow(NotAPlanFile);
    expect(() => open(text)).toThrow(words);
  });

  it('that is too large is refused', () => {
    expect(() => open('x'.repeat(8_000_001))).toThrow('too large');
  });

  it('of any text at all is read or refused, never worse', () => {
    const starts = fc.constantFrom('', 'QGC WPL 110\n', '{', '<kml>', '{"type":"FeatureCollection","features":');
    fc.assert(
      fc.property(starts, fc.oneof(fc.string(), fc.json()), (start, rest) => {
        try {
          open(start + rest);
        } catch (error) {
          expect(error).toBeInstanceOf(NotAPlanFile);
        }
      }),
      { numRuns: examples(100, 600) },
    );
  });

  it('of JSON of any shape below the right head is read or refused, never worse', () => {
    fc.assert(
      fc.property(fc.jsonValue(), fc.jsonValue(), fc.jsonValue(), (a, b, c) => {
        const texts = [
          {
            fileType: 'Plan',
            version: 1,
            mission: { items: [{ type: 'SimpleItem', command: 16, frame: 3, params: a }] },
            geoFence: b,
          },
          {
            fileType: 'Plan',
            version: 1,
            mission: { items: [] },
            geoFence: { polygons: a, circles: b },
            rallyPoints: { points: c },
          },
          {
            type: 'FeatureCollection',
            features: [{ geometry: { type: 'Polygon', coordinates: a }, properties: b }, c],
          },
          {
            type: 'Feature',
            geometry: { type: 'Point', coordinates: a },
            properties: { control_tower: { part: 'item', item: b } },
          },
          { mission: [a], fence: b, rally: c },
        ];
        for (const json of texts) {
          try {
            open(JSON.stringify(json));
          } catch (error) {
            expect(error).toBeInstanceOf(NotAPlanFile);
          }
        }
      }),
      { numRuns: examples(66, 400) },
    );
  });
});
