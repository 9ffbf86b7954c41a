/** KMZ, shapefiles and tables: what is taken, left and assumed, and what hostile ones are refused for. */

import { DOMParser } from '@xmldom/xmldom';
import fc from 'fast-check';
import { strToU8, zipSync } from 'fflate';
import proj4 from 'proj4';
import { describe, expect, it } from 'vitest';

import { FRAME } from '../../src/plan/frames';
import { chosenPlan, firstChoices, heightsIn } from '../../src/plan/formats/import_choices';
import { openPlanBytes } from '../../src/plan/formats/open_bytes';
import { NotAPlanFile, type ReadFile } from '../../src/plan/formats/plan_file';
import { readShapes } from '../../src/plan/formats/shape_file';

const DEFAULTS = { heightM: 60, frame: 3, speedMS: 4 };
const parseXml = (text: string): Document =>
  new DOMParser().parseFromString(text, 'application/xml') as unknown as Document;
const open = (bytes: Uint8Array | string, fileName = ''): Promise<ReadFile> =>
  openPlanBytes(typeof bytes === 'string' ? strToU8(bytes) : bytes, { defaults: DEFAULTS, fileName }, parseXml);

const KML = `<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><name>Field</name><Polygon>
<outerBoundaryIs><LinearRing><coordinates>8,47 8.01,47 8.01,47.01 8,47</coordinates></LinearRing></outerBoundaryIs>
</Polygon></Placemark></kml>`;
const UTM_32 =
  'PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",9.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]';

type Point = readonly [number, number];
/** Written by the format's paper, apart from the reader: one polygon or polyline for each list of rings. */
function shapefile(kind: 3 | 5, shapes: readonly (readonly (readonly Point[])[])[]): Uint8Array {
  const bodies = shapes.map((rings) => {
    const points = rings.flat();
    const view = new DataView(new ArrayBuffer(44 + 4 * rings.length + 16 * points.length));
    view.setInt32(0, kind, true);
    view.setInt32(36, rings.length, true);
    view.setInt32(40, points.length, true);
    let first = 0;
    for (const [at, ring] of rings.entries()) {
      view.setInt32(44 + 4 * at, first, true);
      first += ring.length;
    }
    for (const [at, [x, y]] of points.entries()) {
      view.setFloat64(44 + 4 * rings.length + 16 * at, x, true);
      view.setFloat64(52 + 4 * rings.length + 16 * at, y, true);
    }
    return new Uint8Array(view.buffer);
  });
  const all = new Uint8Array(100 + bodies.reduce((sum, body) => sum + 8 + body.length, 0));
  const view = new DataView(all.buffer);
  view.setInt32(0, 9994);
  view.setInt32(32, kind, true);
  const points = shapes.flat(2);
  const least = (axis: 0 | 1): number => points.reduce((found, point) => Math.min(found, point[axis]), Infinity);
  const most = (axis: 0 | 1): number => points.reduce((found, point) => Math.max(found, point[axis]), -Infinity);
  for (const [place, value] of [least(0), least(1), most(0), most(1)].entries()) {
    view.setFloat64(36 + 8 * place, value, true);
  }
  let at = 100;
  for (const [number, body] of bodies.entries()) {
    view.setInt32(at, number + 1);
    view.setInt32(at + 4, body.length / 2);
    all.set(body, at + 8);
    at += 8 + body.length;
  }
  return all;
}
/** Clockwise, as outlines are. */
const SQUARE: readonly Point[] = [
  [8, 47],
  [8, 47.01],
  [8.01, 47.01],
  [8.01, 47],
  [8, 47],
];
const HOLE: readonly Point[] = [
  [8.004, 47.004],
  [8.006, 47.004],
  [8.006, 47.006],
  [8.004, 47.004],
];

describe('a KMZ', () => {
  it('is the KML in it, and says what else is packed', async () => {
    const read = await open(zipSync({ 'doc.kml': strToU8(KML), 'images/a.png': new Uint8Array(9) }));
    expect([read.format, read.areas.length, read.areas[0]!.name]).toEqual(['KMZ', 1, 'Field']);
    expect(read.dropped).toEqual(['1 packed file is not read: images/a.png']);
  });

  it.each([
    ['nothing to read', zipSync({ 'a.txt': strToU8('hello') }), /No KML and no shapefile/],
    ['a bomb', zipSync({ 'doc.kml': new Uint8Array(40_000_000) }), /too large unpacked/],
    [
      'many files',
      zipSync(Object.fromEntries(Array.from({ length: 2001 }, (_, at) => [`${at}.png`, new Uint8Array(1)]))),
      /2000 files/,
    ],
    ['an empty map', zipSync({ 'doc.kml': strToU8('<kml/>') }), /nothing to fly/],
    ['half of it', zipSync({ 'doc.kml': strToU8(KML) }).slice(0, 60), /damaged/],
  ])('with %s is refused in words', async (_, bytes, words) => {
    await expect(open(bytes)).rejects.toThrow(words);
  });

  it('whose claim of its size is a lie takes no more room than it claims', async () => {
    const bytes = zipSync({ 'doc.kml': new Uint8Array(20_000_000) });
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    for (let at = 0; at + 28 < bytes.length; at += 1)
      if (view.getUint32(at, true) === 0x02014b50) view.setUint32(at + 24, 100, true);
    await expect(open(bytes)).rejects.toThrow(NotAPlanFile);
  });
});

describe('a shapefile', () => {
  it('has its outlines with their holes', async () => {
    const read = await open(shapefile(5, [[SQUARE, HOLE]]), 'field.shp');
    expect(read.areas.map(({ name, corners, holes }) => [name, corners.length, holes.length])).toEqual([
      ['field', 4, 1],
    ]);
    expect(read.assumed).toEqual(['It has no .prj: its numbers are taken as degrees.']);
  });

  it('with a .prj is converted, to the places that are meant', async () => {
    const inMetres = SQUARE.map((at): Point => proj4('+proj=utm +zone=32 +datum=WGS84', [...at]) as [number, number]);
    const packed = {
      'a/field.shp': shapefile(5, [[inMetres]]),
      'a/field.prj': strToU8(UTM_32),
      'a/field.dbf': strToU8('x'),
    };
    const read = await open(zipSync(packed));
    expect(read.format).toBe('shapefile');
    expect(read.areas[0]!.corners[2]).toEqual({ latE7: 470_100_000, lonE7: 80_100_000 });
    expect(read.dropped).toEqual([]);
    expect(read.assumed!.join()).toMatch(/Converted to degrees of WGS 84 from "WGS_1984_UTM_Zone_32N"/);
    await expect(open(shapefile(5, [[inMetres]]), 'field.shp')).rejects.toThrow(/not in degrees, and no .prj/);
    await expect(open(zipSync({ ...packed, 'a/field.prj': strToU8('PROJCS[nonsense') }))).rejects.toThrow(
      /not understood/,
    );
  });

  it('says when nobody knows how its datum lies', () => {
    const local = UTM_32.replace('D_WGS_1984', 'D_Of_An_Island').replace('WGS_1984",6378137.0', 'Island",6377000.0');
    const layer = {
      name: 'x',
      shp: shapefile(3, [
        [
          [
            [500_000, 5_200_000],
            [500_100, 5_200_000],
          ],
        ],
      ]),
      prj: local,
    };
    expect(readShapes(layer).assumed.join()).toMatch(/off by 100 m/);
  });

  it('of lines has routes', async () => {
    const read = await open(shapefile(3, [[SQUARE.slice(0, 3), HOLE.slice(0, 2)]]), 'way.shp');
    expect(read.routes!.map(({ places }) => places.length)).toEqual([3, 2]);
  });

  it('is refused or read, and never followed out of the file, whatever its bytes are', async () => {
    const whole = shapefile(5, [[SQUARE, HOLE], [SQUARE]]);
    await fc.assert(
      fc.asyncProperty(
        fc.array(fc.tuple(fc.integer({ min: 28, max: whole.length - 1 }), fc.integer({ min: 0, max: 255 })), {
          minLength: 1,
          maxLength: 6,
        }),
        fc.integer({ min: 4, max: whole.length }),
        async (changes, length) => {
          const bytes = whole.slice(0, length);
          for (const [at, value] of changes) if (at < length) bytes[at] = value;
          await open(bytes, 'x.shp').catch((error: unknown) => expect(error).toBeInstanceOf(NotAPlanFile));
        },
      ),
    );
  });

  it('with more points or parts than a plan has is refused', async () => {
    const line = Array.from({ length: 200_001 }, (_, at): Point => [8 + at / 1e6, 47]);
    await expect(open(shapefile(3, [[line]]), 'x.shp')).rejects.toThrow(/200000 points/);
    const parts = Array.from({ length: 501 }, () => HOLE);
    await expect(open(shapefile(5, [parts]), 'x.shp')).rejects.toThrow(/500 parts/);
  });
});

describe('a table of places', () => {
  const spots = (read: ReadFile): unknown[] =>
    read.marks!.map(({ name, place }) => [name, place.spot.latE7, place.spot.lonE7, place.heightM]);
  const AT = [473_977_420, 85_455_940];
  it.each([
    ['name,lat,lon,alt\nA,47.397742,8.545594,30', 30],
    ['Latitude;Longitude;Altitude;Label\n47,397742;8,545594;30,5;A', 30.5],
    ['sep=;\nid;lon;lat\nA;8.545594;47.397742', null],
    ['name\tposition\nA\t47.397742 8.545594', null],
    [`name,lat,lon\nA,"47°23'51.8712""N","8°32'44.1384""E"`, null],
    ['name,zone,easting,northing,height\nA,32T,465710.6,5249465.1,12', 12],
    ['name,x,y\r\nA,8.545594,47.397742\r\n', null],
    ['name,mgrs\nA,32TMT6571049465', null],
  ])('is read: %s', async (text, heightM) => {
    const [[name, latE7, lonE7, height]] = spots(await open(text)) as [[string, number, number, number | null]];
    expect([name, height]).toEqual(['A', heightM]);
    expect(Math.abs(latE7 - AT[0]!)).toBeLessThan(100);
    expect(Math.abs(lonE7 - AT[1]!)).toBeLessThan(100);
  });

  it('says what it left, and the first reason', async () => {
    const read = await open('name,lat,lon,colour\nA,47,8,red\nB,95,8,blue\nC,,,\nD,47.1,8.1,x');
    expect(spots(read).length).toBe(2);
    expect(read.dropped).toEqual([
      '2 rows left out. The first: Latitude 95 is beyond 90 degrees. Is the longitude first?',
      'Columns that are not read: colour.',
    ]);
  });

  it('takes what the name of a column says of heights', async () => {
    const feet = await open('lat,lon,alt_ft_msl\n47,8,1000');
    expect(feet.marks![0]!.place.heightM).toBeCloseTo(304.8, 6);
    expect(feet.marks![0]!.frame).toBe(FRAME.GLOBAL);
    expect(feet.assumed).toEqual([
      'Heights are in feet, by the name of their column.',
      'Heights are above the sea, by the name of their column.',
    ]);
    const unknown = await open('lat,lon,alt\n47,8,100');
    expect(heightsIn(unknown)).toEqual({ stated: false, unstated: true });
    expect(chosenPlan(unknown, firstChoices(unknown)).items[0]!.z).toBe(60);
  });

  it('without a head is read by the name of the file, and says so', async () => {
    const read = await open('47.1;8.1\n47.2;8.2', 'a.csv');
    expect(spots(read).length).toBe(2);
    expect(read.assumed!.join()).toMatch(/no head/);
  });

  it.each([
    ['places in metres', 'x,y\n465710,5249465', 'a.csv', /nothing to fly.*1 row left out/],
    ['words', 'hello world', 'a.csv', /nothing to fly/],
    ['too many rows', `lat,lon\n${'47,8\n'.repeat(20_001)}`, 'a.csv', /more than 20000 rows/],
  ])('of %s is refused in words', async (_, text, fileName, words) => {
    await expect(open(text, fileName)).rejects.toThrow(words);
  });

  it('is refused or read, whatever it is', async () => {
    const signs = fc.constantFrom(...`0123456789.,;:"\n\t lationghemNSEW°'`);
    await fc.assert(
      fc.asyncProperty(fc.string({ unit: signs, maxLength: 200 }), async (text) => {
        await open(`lat,lon,alt,name\n${text}`, 'x.csv').catch((error: unknown) =>
          expect(error).toBeInstanceOf(NotAPlanFile),
        );
      }),
    );
  });
});
