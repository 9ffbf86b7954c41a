/**
 * How vector tiles are drawn: tables of layer names, kinds and colours, by the Protomaps and the OpenMapTiles schema.
 * Layers that are not in a table are not drawn. The colours are the theme's; names are drawn in the console's own font.
 */

import type { ExpressionSpecification, LayerSpecification } from 'maplibre-gl';

import type { MapTheme } from './theme';

export type VectorTheme = Pick<MapTheme, 'sea' | 'land' | 'border' | 'ground' | 'label'>;

/** What a vector layer is drawn over. */
export type Under = 'ground' | 'imagery';

interface Common {
  readonly source: string;
  readonly parts: readonly string[];
  readonly theme: VectorTheme;
  readonly under: Under;
}

const FONT = ['Inter Variable'];
/** The map library reads the weight from the first name; the letters come from the second. */
const FONT_STRONG = ['Map Semibold', 'Inter Variable'];
const NONE = 'rgba(0, 0, 0, 0)';

/** `kind` in Protomaps' tiles, `class` in OpenMapTiles'. */
const KIND: ExpressionSpecification = ['coalesce', ['get', 'kind'], ['get', 'class'], ''];
const NAME: ExpressionSpecification = ['coalesce', ['get', 'name:latin'], ['get', 'name'], ''];

const isIn = (kinds: readonly string[]): ExpressionSpecification => ['in', KIND, ['literal', [...kinds]]];
const FORESTS = ['forest', 'wood'];
const MEADOWS = [
  'meadow',
  'grassland',
  'grass',
  'park',
  'nature_reserve',
  'garden',
  'cemetery',
  'pitch',
  'golf_course',
];
const SIGHTS = ['peak', 'aerodrome', 'airfield', 'park', 'nature_reserve', 'golf_course', 'cemetery'];
const FARMLANDS = ['farmland', 'farmyard', 'orchard', 'vineyard'];

function byZoom(...stops: readonly [zoom: number, value: number][]): never {
  return ['interpolate', ['exponential', 1.5], ['zoom'], ...stops.flat()] as never;
}

function groundColour({ ground }: VectorTheme, fallback: string): ExpressionSpecification {
  const crop: ExpressionSpecification = [
    'match',
    ['coalesce', ['get', 'crop'], ''],
    'wheat',
    ground.wheat,
    'rape',
    ground.rape,
    'maize',
    ground.maize,
    'soil',
    ground.soil,
    ground.farmland,
  ];
  return ['case', isIn(FORESTS), ground.forest, isIn(MEADOWS), ground.meadow, isIn(FARMLANDS), crop, fallback] as never;
}

const MAJOR = ['major_road', 'highway', 'motorway', 'trunk', 'primary', 'secondary'];
const PATHS = ['path', 'track', 'other', 'rail', 'transit'];

/** From bottom to top. Fills are for a ground without imagery; lines are drawn over both. */
export function areaLayers(common: Common): LayerSpecification[] {
  const { theme } = common;
  const fill = (part: string, colour: unknown, more: object = {}): LayerSpecification[] =>
    common.parts.includes(part)
      ? [
          {
            id: `${common.source}-${part}`,
            source: common.source,
            'source-layer': part,
            type: 'fill',
            filter: ['==', ['geometry-type'], 'Polygon'],
            paint: { 'fill-color': colour as string, ...more },
          },
        ]
      : [];
  return [
    ...fill('earth', theme.land),
    ...fill('landcover', groundColour(theme, theme.ground.meadow)),
    ...fill('landuse', groundColour(theme, NONE)),
    ...fill('park', theme.ground.meadow),
    ...fill('water', theme.sea),
    ...['buildings', 'building'].flatMap((part) => fill(part, theme.ground.building)),
  ];
}

export function lineLayers(common: Common): LayerSpecification[] {
  const { source, parts, theme, under } = common;
  const isOverImagery = under === 'imagery';
  const line = (part: string, suffix: string, paint: object, filter?: ExpressionSpecification): LayerSpecification[] =>
    parts.includes(part)
      ? [
          {
            id: `${source}-${part}${suffix}`,
            source,
            'source-layer': part,
            type: 'line',
            filter: filter ?? ['!=', ['geometry-type'], 'Point'],
            layout: { 'line-cap': 'round', 'line-join': 'round' },
            paint,
          },
        ]
      : [];
  const roads = ['roads', 'transportation'];
  const isRoad: ExpressionSpecification = ['all', ['!=', ['geometry-type'], 'Point'], ['!', isIn(PATHS)]];
  const isPath: ExpressionSpecification = ['all', ['!=', ['geometry-type'], 'Point'], isIn(PATHS)];
  const colour = ['case', isIn(MAJOR), theme.ground.roadMajor, theme.ground.road] as never;
  // Over imagery the road itself is seen; a thin light line makes it found.
  const opacity = isOverImagery ? { 'line-opacity': 0.5 } : {};
  return [
    ...(isOverImagery
      ? []
      : line('waterway', '', { 'line-color': theme.sea, 'line-width': byZoom([8, 0.5], [18, 5]) })),
    ...roads.flatMap((part) =>
      line(
        part,
        '-path',
        { 'line-color': theme.ground.road, 'line-width': byZoom([12, 0.4], [18, 2.5]), ...opacity },
        isPath,
      ),
    ),
    ...(isOverImagery
      ? []
      : roads.flatMap((part) =>
          line(
            part,
            '-edge',
            { 'line-color': theme.ground.roadEdge, 'line-width': byZoom([8, 1], [12, 2.2], [15, 6], [19, 30]) },
            isRoad,
          ),
        )),
    ...roads.flatMap((part) =>
      line(
        part,
        '',
        isOverImagery
          ? { 'line-color': theme.label.onImagery, 'line-width': byZoom([9, 0.6], [14, 1.6], [19, 3]), ...opacity }
          : { 'line-color': colour, 'line-width': byZoom([8, 0.5], [12, 1.4], [15, 4.4], [19, 25]) },
        isRoad,
      ),
    ),
    ...['boundaries', 'boundary'].flatMap((part) =>
      line(part, '', { 'line-color': theme.border, 'line-width': byZoom([4, 0.6], [12, 1.5]) }),
    ),
  ];
}

export function labelLayers(common: Common): LayerSpecification[] {
  const { source, parts, theme, under } = common;
  const { onImagery, onImageryHalo, place, quiet, road, water, halo } = theme.label;
  const isOverImagery = under === 'imagery';
  const paint = (colour: string): object => ({
    'text-color': isOverImagery ? onImagery : colour,
    'text-halo-color': isOverImagery ? onImageryHalo : halo,
    'text-halo-width': isOverImagery ? 1.6 : 1.4,
    'text-halo-blur': 0.3,
  });
  const label = (
    part: string,
    suffix: string,
    layout: object,
    colour: string,
    more: object = {},
  ): LayerSpecification[] =>
    parts.includes(part)
      ? [
          {
            id: `${source}-${part}-label${suffix}`,
            source,
            'source-layer': part,
            type: 'symbol',
            layout: { 'text-field': NAME, 'text-font': FONT, 'text-max-width': 8, ...layout },
            paint: paint(colour),
            ...more,
          } as LayerSpecification,
        ]
      : [];
  const alongRoad = {
    'symbol-placement': 'line',
    'text-size': byZoom([13, 10], [18, 13]),
    'text-letter-spacing': 0.02,
    'symbol-spacing': 420,
  };
  const smallNames = { 'text-size': byZoom([14, 10], [18, 13]), 'text-letter-spacing': 0.02, 'text-padding': 8 };
  const isTown = isIn(['town', 'city', 'locality', 'capital', 'country', 'state', 'region']);
  return [
    ...['pois', 'poi'].flatMap((part) => [
      ...label(part, '-field', smallNames, quiet, { filter: isIn(['field', 'meadow']), minzoom: 15.5 }),
      ...label(part, '', smallNames, quiet, { filter: isIn([...FORESTS, ...SIGHTS]), minzoom: 14 }),
    ]),
    ...['roads', 'transportation_name'].flatMap((part) => label(part, '', alongRoad, road, { minzoom: 13 })),
    ...['water', 'water_name'].flatMap((part) =>
      label(part, '', { 'text-size': 12 }, water, { filter: ['==', ['geometry-type'], 'Point'] }),
    ),
    ...['places', 'place'].flatMap((part) =>
      label(
        part,
        '',
        {
          'text-font': FONT_STRONG,
          'text-size': ['interpolate', ['linear'], ['zoom'], 6, ['case', isTown, 11, 9], 16, ['case', isTown, 17, 14]],
          'symbol-sort-key': ['case', isTown, 0, 1],
          'text-padding': 6,
        },
        place,
      ),
    ),
  ];
}
