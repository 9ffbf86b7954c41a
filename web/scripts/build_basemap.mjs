/**
 * Makes the embedded basemap: land and borders of the world-atlas package, cut at the antimeridian (polygons that
 * cross it would draw a false band round the world in MapLibre), rounded to what the source can resolve.
 */

import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { geoEquirectangular } from 'd3-geo';
import { geoProject } from 'd3-geo-projection';
import { feature, mesh } from 'topojson-client';

const require = createRequire(import.meta.url);
const out = join(dirname(fileURLToPath(import.meta.url)), '..', 'public', 'basemap');
const DECIMALS = 2; // about a kilometre; the 1:50 million source is no better

const atlas = (name) => JSON.parse(readFileSync(require.resolve(`world-atlas/${name}.json`), 'utf8'));

// One degree is one unit, y upwards: projecting cuts at the antimeridian and changes nothing else.
const plateCarree = geoEquirectangular()
  .scale(180 / Math.PI)
  .translate([0, 0])
  .precision(0)
  .reflectY(true);

const factor = 10 ** DECIMALS;
const round = (value) => Math.round(value * factor) / factor;

function roundLine(line) {
  const rounded = line.map(([x, y]) => [round(x), round(y)]);
  return rounded.filter(([x, y], i) => i === 0 || x !== rounded[i - 1][0] || y !== rounded[i - 1][1]);
}

const roundPolygon = (rings) => rings.map(roundLine).filter((ring) => ring.length >= 4);

function write(name, geometry) {
  mkdirSync(out, { recursive: true });
  const text = JSON.stringify({ type: 'Feature', properties: {}, geometry });
  writeFileSync(join(out, `${name}.json`), text);
  console.log(`basemap/${name}.json ${Math.round(text.length / 1000)} kB`);
}

const land = atlas('land-50m');
const cut = geoProject(feature(land, land.objects.land), plateCarree);
const shapes = cut.type === 'FeatureCollection' ? cut.features.map((one) => one.geometry) : [cut.geometry ?? cut];
const polygons = shapes.flatMap((one) => (one.type === 'Polygon' ? [one.coordinates] : one.coordinates));
write('land', {
  type: 'MultiPolygon',
  coordinates: polygons.map(roundPolygon).filter((polygon) => polygon.length > 0),
});

const countries = atlas('countries-50m');
const borders = geoProject(
  mesh(countries, countries.objects.countries, (a, b) => a !== b),
  plateCarree,
);
write('borders', {
  type: 'MultiLineString',
  coordinates: borders.coordinates.map(roundLine).filter((line) => line.length >= 2),
});
