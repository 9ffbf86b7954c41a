/** Packed files: KMZ, and .zip with shapefiles. Bounded in files and in unpacked bytes. Loaded when one is opened. */

import { unzipSync } from 'fflate';

import { plural, t } from '../../languages/text';
import { readFeatures } from './geojson_plan';
import { NotAPlanFile, type ReadFile, type ReadSettings } from './plan_file';
import { readShapes, type ShapeLayer } from './shape_file';

const MAX_FILES = 2000;
const MAX_LAYERS = 20;
const MAX_UNPACKED = 32_000_000;
const WANTED = /\.(kml|shp|prj)$/i;
const OF_A_SHAPEFILE = /\.(dbf|shx|cpg|sbn|sbx|qpj|qmd|qix|fbn|fbx|atx|xml|prj)$/i;

interface Unpacked {
  readonly wanted: Readonly<Record<string, Uint8Array>>;
  /** Names of files that are not read, without folders. */
  readonly others: readonly string[];
}

function unpacked(bytes: Uint8Array): Unpacked {
  const others: string[] = [];
  let [files, size] = [0, 0];
  try {
    const wanted = unzipSync(bytes, {
      // The size that a file claims is the size of the room it gets.
      filter: ({ name, originalSize }) => {
        files += 1;
        if (files > MAX_FILES) {
          throw new NotAPlanFile(
            t('More than {most} files are packed in this one: it is no plan.', { most: MAX_FILES }),
          );
        }
        if (name.endsWith('/') || name.startsWith('__MACOSX/')) return false;
        if (!WANTED.test(name)) {
          others.push(name);
          return false;
        }
        size += originalSize;
        if (size <= MAX_UNPACKED) return true;
        throw new NotAPlanFile(t('This packed file is too large unpacked: it is no plan.'));
      },
    });
    return { wanted, others };
  } catch (error) {
    if (error instanceof NotAPlanFile) throw error;
    throw new NotAPlanFile(t('This packed file is damaged, or packed in a way that is not read.'));
  }
}

const textOf = (bytes: Uint8Array): string => new TextDecoder().decode(bytes);
const stemOf = (path: string): string => path.replace(/\.[^./]*$/, '');

/** `readKml`: reads the text of a KML. Throws NotAPlanFile. */
export function readPacked(bytes: Uint8Array, settings: ReadSettings, readKml: (text: string) => ReadFile): ReadFile {
  const { wanted, others } = unpacked(bytes);
  const names = Object.keys(wanted);
  const maps = names.filter((name) => /\.kml$/i.test(name));
  const shapes = names.filter((name) => /\.shp$/i.test(name));
  if (maps.length + shapes.length === 0) {
    throw new NotAPlanFile(t('No KML and no shapefile is packed in this file.'));
  }
  const main = maps.find((name) => /^doc\.kml$/i.test(name)) ?? maps[0];
  const read = main ? readKml(textOf(wanted[main]!)) : readLayers(shapes, wanted, settings);
  const left = [
    ...maps.filter((name) => name !== main),
    ...(main ? shapes : []),
    ...(main ? others : others.filter((name) => !OF_A_SHAPEFILE.test(name))),
  ];
  return {
    ...read,
    format: main ? 'KMZ' : 'shapefile',
    dropped: [
      ...read.dropped,
      ...(left.length > 0
        ? [
            plural(
              left.length,
              { one: '{n} packed file is not read: {names}', other: '{n} packed files are not read: {names}' },
              { names: left.slice(0, 5).join(', ') },
            ),
          ]
        : []),
    ],
  };
}

function readLayers(names: readonly string[], files: Unpacked['wanted'], settings: ReadSettings): ReadFile {
  if (names.length > MAX_LAYERS) {
    throw new NotAPlanFile(t('More than {most} shapefiles are packed in this one.', { most: MAX_LAYERS }));
  }
  const layers = names.map((name): ShapeLayer => {
    const prj = Object.keys(files).find((one) => /\.prj$/i.test(one) && stemOf(one) === stemOf(name));
    return { name: stemOf(name).split('/').at(-1)!, shp: files[name]!, prj: prj ? textOf(files[prj]!) : null };
  });
  return readLayersOf(layers, settings);
}

/** A .shp alone, or several of a packed file. */
export function readLayersOf(layers: readonly ShapeLayer[], settings: ReadSettings): ReadFile {
  const all = layers.map(readShapes);
  const read = readFeatures(
    all.flatMap(({ features }) => features),
    settings,
    'shapefile',
  );
  return { ...read, assumed: [...new Set([...all.flatMap(({ assumed }) => assumed), ...(read.assumed ?? [])])] };
}
