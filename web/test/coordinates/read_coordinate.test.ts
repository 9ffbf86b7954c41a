import fc from 'fast-check';
import proj4 from 'proj4';
import { describe, expect, it } from 'vitest';

import { isMeantAsPlace, readCoordinate, readPlace } from '../../src/coordinates/read_coordinate';
import { latLon } from '../../src/words/format';

describe('a coordinate', () => {
  it.each([
    ['47.397742, 8.545594', 47.397742, 8.545594],
    ['47.397742 8.545594', 47.397742, 8.545594],
    ['-33.8568; 151.2153', -33.8568, 151.2153],
    ['47.397742N 8.545594E', 47.397742, 8.545594],
    ['33.8568° S, 151.2153° E', -33.8568, 151.2153],
    [`47°23'51.87"N 8°32'44.14"E`, 47.397742, 8.545594],
    ['47 23 51.87 N, 8 32 44.14 E', 47.397742, 8.545594],
    ['N47 23.8645 W8 32.7356', 47.397742, -8.545594],
    ['N 47°23.8645′ E 8°32.7356′', 47.397742, 8.545594],
    // A published pair, the CN Tower; and its mirror image in the south.
    ['17T 630084 4833438', 43.642567, -79.387139],
    ['17N 630084mE 4833438mN', 43.642567, -79.387139],
    ['17G 630084 5166562', -43.642567, -79.387139],
    // From the examples of the specification of plus codes.
    ['7FG49QCJ+2V', 20.3700625, 2.7821875],
    ['8fvc2222+22', 47.0000625, 8.0000625],
    ['4VCPPQGP+Q9', -41.2730625, 174.7859375],
    ['9C3W9QCJ+2VX', 51.3701125, -1.217765625],
    ['8FVC0000+', 47.5, 8.5],
    // Decimal commas.
    ['47,397742 8,545594', 47.397742, 8.545594],
    ['47,397742; 8,545594', 47.397742, 8.545594],
    ['47,397742, 8,545594', 47.397742, 8.545594],
    ['47,397742,8,545594', 47.397742, 8.545594],
    ['-33,8568° 151,2153°', -33.8568, 151.2153],
    ['47,8', 47, 8],
    ['47, 8', 47, 8],
    [`47°23'51,87"N 8°32'44,14"E`, 47.397742, 8.545594],
    ['N47,397742 E8,545594', 47.397742, 8.545594],
    // Signs of books, of phones and of other languages.
    ['47º 23’ 51.87” N, 8º 32’ 44.14” E', 47.397742, 8.545594],
    ['−33.8568, 151.2153', -33.8568, 151.2153],
    [`38°42'50"N 9°8'22"W`, 38.713889, -9.139444],
    [`38°42'50"N 9°8'22"L`, 38.713889, 9.139444],
    [`8°32'44.14"E 47°23'51.87"N`, 47.397742, 8.545594],
    [`-33°51'24.5" 151°12'55.1"`, -33.856806, 151.215306],
    ['47:23:51.87N 8:32:44.14E', 47.397742, 8.545594],
    ['(47.397742, 8.545594)', 47.397742, 8.545594],
    ['lat: 47.397742, lon: 8.545594', 47.397742, 8.545594],
    ['Lon 8.545594, Lat 47.397742', 47.397742, 8.545594],
    ['{"lat":47.397742,"lng":8.545594}', 47.397742, 8.545594],
    // MGRS, together and apart.
    ['32TMT6571049465', 47.397742, 8.545594],
    ['32T MT 65710 49465', 47.397742, 8.545594],
    // geo: and the addresses of maps.
    ['geo:47.397742,8.545594', 47.397742, 8.545594],
    ['geo:47.397742,8.545594,410;crs=wgs84;u=20', 47.397742, 8.545594],
    ['geo:0,0?q=47.397742,8.545594(Field%20A)', 47.397742, 8.545594],
    ['https://www.google.com/maps/@47.397742,8.545594,15z', 47.397742, 8.545594],
    ['https://www.google.com/maps/place/X/@40,7,15z/data=!3m1!8m2!3d47.397742!4d8.545594', 47.397742, 8.545594],
    ['https://www.google.com/maps/search/?api=1&query=47.397742%2C8.545594', 47.397742, 8.545594],
    ['https://maps.google.com/?q=47.397742,8.545594', 47.397742, 8.545594],
    ['https://maps.apple.com/?ll=47.397742,8.545594&q=Pin', 47.397742, 8.545594],
    ['https://www.openstreetmap.org/?mlat=47.397742&mlon=8.545594#map=15/40.1/7.1', 47.397742, 8.545594],
    ['https://www.openstreetmap.org/#map=15/47.397742/8.545594', 47.397742, 8.545594],
    ['https://www.bing.com/maps?cp=47.397742~8.545594&lvl=15', 47.397742, 8.545594],
    ['https://yandex.com/maps/?ll=8.545594%2C47.397742&z=15', 47.397742, 8.545594],
  ])('is read from %s', (text, latDeg, lonDeg) => {
    const found = readCoordinate(text);
    expect(found!.latDeg).toBeCloseTo(latDeg, 4);
    expect(found!.lonDeg).toBeCloseTo(lonDeg, 4);
  });

  it('of a short plus code is the one nearest to what the map shows', () => {
    expect(readCoordinate('CJ+2VX')).toBeNull();
    const found = readCoordinate('CJ+2VX', { latDeg: 51.3708675, lonDeg: -1.217765625 })!;
    expect(found.latDeg).toBeCloseTo(51.3701125, 6);
    expect(found.lonDeg).toBeCloseTo(-1.217765625, 6);
    // Across the edge of the area whose digits it lacks.
    const beside = readCoordinate('22+22', { latDeg: 46.9999, lonDeg: 7.9999 })!;
    expect(beside.latDeg).toBeCloseTo(47.0000625, 6);
    expect(beside.lonDeg).toBeCloseTo(8.0000625, 6);
  });

  it.each([
    '',
    'Kestrel',
    '47.39',
    '91, 8',
    '47, 181',
    '47°61\'0"N 8°0\'0"E',
    '61T 500000 5000000',
    '32I 500000 5000000',
    '8FVC9G8F',
    '8FVC9G8F+6',
    '8FVC00G8+',
    '1 2 3',
  ])('is not read from "%s"', (text) => {
    expect(readCoordinate(text)).toBeNull();
  });

  it.each([
    ['', /needed/],
    ['47.39', /One number/],
    ['91, 8', /Latitude 91.*longitude first/],
    ['151.2, 200', /Latitude 151.2 is beyond 90 degrees\.$/],
    ['47, 181', /Longitude 181/],
    [`47°61'0"N 8°0'0"E`, /below 60/],
    [`38°42'50"N 9°8'22"O`, /write E or W/],
    ['47N 8N', /not understood/],
    ['32TZZ6588649507', /no such square/],
    ['32TMT658864950', /no such square/],
    ['47 somewhere', /"47 somewhere" is not understood/],
    ['9C3W9Q+2', /plus code/],
    ['ZAH 12345 67890', /polar/],
    ['https://maps.app.goo.gl/abc', /short address/],
    ['https://example.org/page', /holds no latitude/],
    ['geo:47.4,8.5;crs=nad27', /WGS 84/],
    ['Kestrel', /"Kestrel" is not understood/],
    ['x'.repeat(2001), /too long/],
  ])('says why "%.60s" is none', (text, words) => {
    const { place, fault } = readPlace(text);
    expect(place).toBeNull();
    expect(fault).toMatch(words);
  });

  it('is told from a name in the search', () => {
    expect(['91, 8', '47°N', 'https://example.org', 'geo:1'].map(isMeantAsPlace)).toEqual([true, false, true, true]);
    expect(['Kestrel', 'Kestrel 2', 'drone-7 beta 3'].map(isMeantAsPlace)).toEqual([false, false, false]);
  });
});

describe('a place that one writes', () => {
  const turned = (deg: number): number => ((((deg + 180) % 360) + 360) % 360) - 180;
  const degrees = (most: number) => fc.integer({ min: -most * 1e7, max: most * 1e7 }).map((e7) => e7 / 1e7);
  const places = fc.record({ latDeg: degrees(90), lonDeg: degrees(180) });
  const sexagesimal = (value: number, letters: string): string => {
    const thousandths = Math.round(Math.abs(value) * 3_600_000);
    const [whole, minutes] = [Math.floor(thousandths / 3_600_000), Math.floor(thousandths / 60_000) % 60];
    return `${whole}°${minutes}'${((thousandths % 60_000) / 1000).toFixed(3)}"${letters[value < 0 ? 1 : 0]}`;
  };
  const WAYS: Record<string, (lat: number, lon: number) => string> = {
    'as the console shows it': (lat, lon) => latLon({ latDeg: lat, lonDeg: lon }, 7),
    'with decimal commas': (lat, lon) => `${lat.toFixed(7)}; ${lon.toFixed(7)}`.replaceAll('.', ','),
    'with decimal commas and blanks': (lat, lon) => `${lat.toFixed(7)} ${lon.toFixed(7)}`.replaceAll('.', ','),
    'with seconds': (lat, lon) => `${sexagesimal(lat, 'NS')} ${sexagesimal(lon, 'EW')}`,
    'with seconds and commas': (lat, lon) =>
      `${sexagesimal(lat, 'NS')}, ${sexagesimal(lon, 'EW')}`.replaceAll('.', ','),
    'as geo:': (lat, lon) => `geo:${lat.toFixed(7)},${lon.toFixed(7)}`,
    'as a link': (lat, lon) => `https://www.google.com/maps/search/?api=1&query=${lat.toFixed(7)}%2C${lon.toFixed(7)}`,
    'as a link of a map': (lat, lon) => `https://www.openstreetmap.org/#map=12/${lat.toFixed(7)}/${lon.toFixed(7)}`,
  };
  it.each(Object.entries(WAYS))('%s, is read back', (_, written) => {
    fc.assert(
      fc.property(places, ({ latDeg, lonDeg }) => {
        const found = readPlace(written(latDeg, lonDeg)).place;
        expect(Math.abs(found!.latDeg - latDeg)).toBeLessThan(2e-7);
        expect(Math.abs(found!.lonDeg - lonDeg)).toBeLessThan(2e-7);
      }),
    );
  });

  it('in MGRS is read as another reader reads it', () => {
    fc.assert(
      fc.property(
        fc.record({ latDeg: fc.double({ min: -79.9, max: 83.9, noNaN: true }), lonDeg: degrees(179.99) }),
        // Of a whole square of 100 km the other reader gives the corner.
        fc.integer({ min: 1, max: 5 }),
        ({ latDeg, lonDeg }, digits) => {
          const [, square, east, north] = /^(.*?)(\d{5})(\d{5})$/.exec(proj4.mgrs.forward([lonDeg, latDeg]))!;
          const text = `${square}${east!.slice(0, digits)}${north!.slice(0, digits)}`;
          const [lon, lat] = proj4.mgrs.toPoint(text);
          const found = readPlace(text).place!;
          // The other reader's middle is that of the edges, which are not straight.
          const apartM =
            111_320 * Math.hypot(found.latDeg - lat, turned(found.lonDeg - lon) * Math.cos((lat * Math.PI) / 180));
          expect(apartM).toBeLessThan(0.5 + 10 ** (5 - digits) / 20);
        },
      ),
    );
  });

  it('never makes the reader throw, whatever it is', () => {
    const signs = fc.constantFrom(...`0123456789.,;:°'"NSEWOL +-/@?=&#%!~()geohtpslatlonTM`);
    fc.assert(
      fc.property(fc.oneof(fc.string(), fc.string({ unit: signs, maxLength: 60 })), (text) => {
        const { place, fault } = readPlace(text);
        expect(place === null).toBe(fault !== '');
        if (place) expect(Math.abs(place.latDeg) <= 90 && Math.abs(place.lonDeg) <= 180).toBe(true);
      }),
    );
  });
});
