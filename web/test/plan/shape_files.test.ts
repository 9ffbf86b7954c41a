/** Files of shapes: what they say beside coordinates is taken, or said; and what is chosen becomes the plan. */

import { DOMParser } from '@xmldom/xmldom';
import { describe, expect, it } from 'vitest';

import {
  areaToSurvey,
  assumedWords,
  chosenPlan,
  firstChoices,
  heightsIn,
  leftWords,
  takesSomething,
  tooMuch,
  type Choices,
} from '../../src/plan/formats/import_choices';
import { openPlanFile } from '../../src/plan/formats/open_plan_file';
import type { ReadFile } from '../../src/plan/formats/plan_file';
import type { ParseXml } from '../../src/plan/formats/xml';
import { planSummary } from '../../src/plan/plan_summary';
import { degOf, spotOf } from '../../src/plan/plan_types';
import { missionItems } from '../../src/plan/wire_items';

const parseXml: ParseXml = (text) => new DOMParser().parseFromString(text, 'application/xml') as unknown as Document;
const DEFAULTS = { heightM: 60, frame: 3, speedMS: 4 };
const open = (text: string): ReadFile => openPlanFile(text, { defaults: DEFAULTS }, parseXml);
const kml = (...marks: string[]): ReadFile =>
  open(`<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document>
    ${marks.join('\n')}</Document></kml>`);
const line = (coordinates: string, mode = '', name = ''): string =>
  `<Placemark><name>${name}</name><LineString>${mode && `<altitudeMode>${mode}</altitudeMode>`}
    <coordinates>${coordinates}</coordinates></LineString></Placemark>`;
const point = (coordinates: string, mode = '', name = ''): string =>
  `<Placemark><name>${name}</name><Point>${mode && `<altitudeMode>${mode}</altitudeMode>`}
    <coordinates>${coordinates}</coordinates></Point></Placemark>`;
/** Latitude, longitude, height and frame of each waypoint. */
const way = (read: ReadFile, changes: Partial<Choices> = {}): number[][] =>
  missionItems(chosenPlan(read, { ...firstChoices(read), ...changes })).map(({ x, y, z, frame }) => [
    degOf(x),
    degOf(y),
    z,
    frame,
  ]);
const words = (read: ReadFile, changes: Partial<Choices> = {}): { assumed: string[]; left: string[] } => {
  const choices = { ...firstChoices(read), ...changes };
  return { assumed: assumedWords(read, choices), left: leftWords(read, choices) };
};

describe('coordinates of KML', () => {
  const PLACES = [
    [47.1, 8.5, 60, 3],
    [47.2, 8.6, 60, 3],
  ];
  it.each([
    '8.5,47.1,0 8.6,47.2,0',
    '8.5, 47.1, 0 8.6, 47.2, 0',
    '8.5 ,47.1 ,0\n8.6 ,47.2 ,0',
    '8.5,47.1,0, 8.6,47.2,0,',
    '8.5,47.1 8.6,47.2',
    '8.5, 47.1\n  8.6, 47.2',
    '\t8.5,47.1,0\r\n\t8.6,47.2,0\r\n',
    '+8.50,4.71e1 8.6,47.2',
  ])('are read as people write them: %j', (coordinates) => {
    expect(way(kml(line(coordinates)))).toEqual(PLACES);
  });

  it.each(['8,5,47,1,0 8,6,47,2,0', '8.5;47.1 8.6;47.2', '8.5 47.1 8.6 47.2', 'a,b c,d'])(
    'that are none are no success: %j',
    (coordinates) => {
      expect(() => kml(line(coordinates))).toThrow(/nothing to fly.*"longitude,latitude,height" with decimal points/);
    },
  );
});

describe('heights of KML', () => {
  const RISING = '8.5,47.1,500 8.6,47.2,520.5';
  it.each([
    ['absolute', 0],
    ['relativeToGround', 10],
    ['relativeToSeaFloor', 10],
  ])('count from what the file says: %s', (mode, frame) => {
    const read = kml(line(RISING, mode));
    expect(way(read)).toEqual([
      [47.1, 8.5, 500, frame],
      [47.2, 8.6, 520.5, frame],
    ]);
    expect(words(read)).toEqual({ assumed: [], left: [] });
    expect(way(read, { heights: 'plan' })[0]).toEqual([47.1, 8.5, 60, 3]);
    expect(words(read, { heights: 'plan' }).assumed).toEqual([
      '2 places at 60 m above home: the height of new items in this plan.',
      'The heights of 2 places in the file are not used.',
    ]);
  });

  it.each(['', 'clampToGround', 'clampToSeaFloor'])('of shapes on the ground are none, and it is said: %j', (mode) => {
    const read = kml(line(RISING, mode));
    expect(way(read).map(([, , z, frame]) => [z, frame])).toEqual([
      [60, 3],
      [60, 3],
    ]);
    expect(words(read).assumed).toEqual([
      'The heights of 2 places are not taken: the file lays these shapes on the ground (clampToGround).',
      '2 places at 60 m above home: the height of new items in this plan.',
    ]);
    expect(heightsIn(read)).toEqual({ stated: false, unstated: false });
  });

  it('of its own extension and of each shape in a collection are theirs', () => {
    const read = kml(
      `<Placemark><MultiGeometry>
        <LineString><gx:altitudeMode>absolute</gx:altitudeMode><coordinates>1,2,300 1,3,300</coordinates></LineString>
        <LineString><altitudeMode>relativeToGround</altitudeMode><coordinates>1,4,30 1,5,30</coordinates></LineString>
      </MultiGeometry></Placemark>
      <Placemark><gx:Track><altitudeMode>absolute</altitudeMode>
        <gx:coord>8.5 47.1 400</gx:coord><gx:coord>8.6 47.2 410</gx:coord></gx:Track></Placemark>`,
    );
    expect(way(read, { routes: new Set([0, 1, 2]) }).map(([, , z, frame]) => [z, frame])).toEqual([
      [300, 0],
      [300, 0],
      [30, 10],
      [30, 10],
      [400, 0],
      [410, 0],
    ]);
  });

  it('that are all 0 were given by nobody', () => {
    expect(way(kml(line('8.5,47.1,0 8.6,47.2,0', 'relativeToGround')))[0]).toEqual([47.1, 8.5, 60, 3]);
  });
});

describe('heights of others', () => {
  it('of GeoJSON count from what the user says', () => {
    const read = open('{"type": "LineString", "coordinates": [[8.5, 47.1, 900], [8.6, 47.2]]}');
    expect(heightsIn(read)).toEqual({ stated: false, unstated: true });
    expect(way(read).map(([, , z, frame]) => [z, frame])).toEqual([
      [60, 3],
      [60, 3],
    ]);
    expect(words(read).assumed.join(' ')).toContain('The heights of 1 place in the file are not used.');
    expect(way(read, { heights: 0 }).map(([, , z, frame]) => [z, frame])).toEqual([
      [900, 0],
      [60, 3],
    ]);
    expect(words(read, { heights: 0 }).assumed).toEqual([
      '1 place at 60 m above home: the height of new items in this plan.',
    ]);
  });

  it('of GPX are above sea level; its routes and segments are apart, its waypoints are marks', () => {
    const read = open(`<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1">
      <wpt lat="47" lon="8"><ele>500</ele><name>Mast</name></wpt><wpt lat="95" lon="8"/>
      <rte><name>Round</name><rtept lat="47.1" lon="8.1"><ele>510</ele></rtept><rtept lat="47.2" lon="8.2"/></rte>
      <trk><name>Log</name><trkseg><trkpt lat="1" lon="2"/><trkpt lat="1" lon="3"/></trkseg>
        <trkseg><trkpt lat="1" lon="4"/><trkpt lat="1" lon="5"/></trkseg></trk></gpx>`);
    expect(read.routes?.map(({ name, places }) => [name, places.length])).toEqual([
      ['Round', 2],
      ['Log', 2],
      ['Log', 2],
    ]);
    expect(read.marks).toEqual([{ name: 'Mast', frame: 0, place: { spot: spotOf(47, 8), heightM: 500 } }]);
    expect(way(read, { routes: new Set([0]) })).toEqual([
      [47.1, 8.1, 510, 0],
      [47.2, 8.2, 60, 3],
    ]);
    expect(words(read).left).toEqual([
      '1 place left out: not on earth, latitude and longitude in degrees.',
      '3 routes',
      '1 mark',
    ]);
  });
});

describe('what is taken', () => {
  const FIELD = `<Placemark><name>Field</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
    8,47 8.01,47 8.01,47.01 8,47.01 8,47</coordinates></LinearRing></outerBoundaryIs><innerBoundaryIs><LinearRing>
    <coordinates>8.001,47.001 8.002,47.001 8.002,47.002 8.001,47.001</coordinates></LinearRing></innerBoundaryIs>
    </Polygon></Placemark>`;

  it('is the only route; of several the user says which, and joins them', () => {
    const one = kml(line('1,1 1,2'), point('5,5'));
    expect(way(one)).toHaveLength(2);
    expect(words(one).left).toEqual(['1 mark']);
    const two = kml(line('1,1 1,2', '', 'North'), line('2,1 2,2 2,3', '', 'South'));
    expect(way(two)).toEqual([]);
    expect(takesSomething(two, firstChoices(two))).toBe(false);
    expect(way(two, { routes: new Set([1]) })).toHaveLength(3);
    const both = new Set([1, 0]);
    expect(way(two, { routes: both }).map(([lat, lon]) => [lat, lon])).toEqual([
      [1, 1],
      [2, 1],
      [1, 2],
      [2, 2],
      [3, 2],
    ]);
    expect(words(two, { routes: both }).assumed).toContain('2 routes are flown one after the other, as one.');
  });

  it('is marks as what the user says', () => {
    const read = kml(point('8.5, 47.1, 30', 'relativeToGround', 'Mast'), point('8.6,47.2'));
    expect(way(read)).toEqual([
      [47.1, 8.5, 30, 10],
      [47.2, 8.6, 60, 3],
    ]);
    const { items, rally } = chosenPlan(read, { ...firstChoices(read), marks: 'rally' });
    expect(items).toEqual([]);
    expect(rally.map(({ frame, heightM, spot }) => [frame, heightM, spot])).toEqual([
      [10, 30, spotOf(47.1, 8.5)],
      [3, 60, spotOf(47.2, 8.6)],
    ]);
  });

  it('is outlines as a fence with its holes, or to survey', () => {
    const read = kml(FIELD);
    const choices = firstChoices(read);
    expect(takesSomething(read, choices)).toBe(false);
    const inside = chosenPlan(read, { ...choices, areas: ['inside'] }).fence.shapes;
    expect(inside.map((one) => [one.shape, one.inclusion])).toEqual([
      ['polygon', true],
      ['polygon', false],
    ]);
    expect(chosenPlan(read, { ...choices, areas: ['outside'] }).fence.shapes).toHaveLength(1);
    const survey: Choices = { ...choices, areas: ['survey'] };
    expect(takesSomething(read, survey)).toBe(true);
    expect(areaToSurvey(read, survey)?.corners).toHaveLength(4);
    expect(assumedWords(read, survey)).toEqual(['1 hole in outlines: not left out of what is surveyed or forbidden.']);
  });

  it('is outlines without the corners that are drawn twice', () => {
    const twice = FIELD.replace('8.01,47 8.01,47.01', '8.01,47 8.01,47 8.01,47.01');
    const read = kml(twice);
    const choices: Choices = { ...firstChoices(read), areas: ['inside'] };
    expect(chosenPlan(read, choices).fence.shapes[0]).toMatchObject({
      corners: [spotOf(47, 8), spotOf(47, 8.01), spotOf(47.01, 8.01), spotOf(47.01, 8)],
    });
    expect(assumedWords(read, choices)).toEqual(['Corners of outlines that are drawn twice count once: 1.']);
  });

  it('is what a drone has room for', () => {
    const many = kml(line(Array.from({ length: 725 }, (_, at) => `8,${at / 100}`).join(' ')));
    expect(tooMuch(many, firstChoices(many))).toBe('These are 725 places; a drone takes 724 at most.');
    const fewer = kml(line(Array.from({ length: 724 }, (_, at) => `8,${at / 100}`).join(' ')));
    expect(tooMuch(fewer, firstChoices(fewer))).toBe('');
  });

  it('has ids of its own', () => {
    const read = kml(line('1,1 1,2'), point('5,5'), FIELD);
    const plan = chosenPlan(read, { ...firstChoices(read), marks: 'rally', areas: ['inside'] });
    const ids = [...plan.items, ...plan.fence.shapes, ...plan.rally].map(({ id }) => id);
    expect(new Set(ids).size).toBe(5);
    expect(plan.nextId).toBeGreaterThan(Math.max(...ids));
  });
});

it('names repeated places, short lines, links and models', () => {
  const read = kml(
    line('1,1 1,1 1,2'),
    line('1,1'),
    '<NetworkLink/><ScreenOverlay/>',
    '<Placemark><Model/></Placemark><Placemark><name>Nothing</name></Placemark>',
  );
  expect(way(read)).toHaveLength(2);
  expect(words(read)).toEqual({
    assumed: [
      'Places that repeat the one before are taken once: 1 place.',
      '2 places at 60 m above home: the height of new items in this plan.',
    ],
    left: [
      'A line with fewer than two places is left out.',
      'A shape of the kind "Model" is left out.',
      'What the file only links to is left out: save it from there.',
      'Image overlays on the map are left out.',
    ],
  });
});

it('a plan in a few lines', () => {
  const read = kml(
    line('8.5,47.1,500 8.6,47.2,520', 'absolute'),
    line('1,1,30 1,2,30', 'relativeToGround'),
    point('5,5'),
  );
  const plan = chosenPlan(read, { ...firstChoices(read), routes: new Set([0, 1]), marks: 'rally' });
  expect(planSummary({ ...plan, home: { spot: spotOf(47, 8), altM: 488 } })).toEqual([
    'Mission: 4 items, places at 500 to 520 m above sea level, 30 m above terrain',
    '1 rally point at 60 m above home',
    'Planned home at 488 m above sea level',
  ]);
});
