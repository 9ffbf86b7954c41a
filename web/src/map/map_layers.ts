/** The layers that the tower offers for the map, and which of them the user wants to see. No map library here. */

export type MapRole = 'imagery' | 'map' | 'terrain';

/** One layer of the tower's answer to `GET /map`. */
export interface MapLayer {
  readonly id: string;
  readonly name: string;
  readonly role: MapRole;
  readonly kind: 'raster' | 'vector';
  readonly source: 'file' | 'addresses';
  readonly url: string;
  readonly tileSize: number;
  readonly maxZoom: number | null;
  readonly attribution: string;
  /** The names of the layers inside vector tiles. */
  readonly parts: readonly string[];
}

export const MAP_VIEWS = ['both', 'imagery', 'map', 'none'] as const;
/** `both`: roads and names over imagery; `none`: the coastline alone. */
export type MapView = (typeof MAP_VIEWS)[number];

export interface MapChoice {
  readonly view: MapView;
  /** Ids of layers; null: the first one. */
  readonly imagery: string | null;
  readonly map: string | null;
  /** Of the imagery, 0 to 1. */
  readonly opacity: number;
  readonly labels: boolean;
  /** The shape of the ground, shaded. */
  readonly relief: boolean;
}

export const DEFAULT_CHOICE: MapChoice = {
  view: 'both',
  imagery: null,
  map: null,
  opacity: 1,
  labels: true,
  relief: true,
};
export const MIN_OPACITY = 0.2;

/** What is drawn: never more than the tower has. */
export interface Shown {
  readonly imagery: MapLayer | null;
  readonly map: MapLayer | null;
  readonly opacity: number;
  readonly labels: boolean;
  readonly relief: MapLayer | null;
}

const isOneOf = <T extends string>(all: readonly T[], value: unknown): value is T => all.some((one) => one === value);

/** Reads what was stored: anything unusable becomes the default. */
export function readChoice(stored: unknown): MapChoice {
  const { view, imagery, map, opacity, labels, relief } = (stored ?? {}) as Record<string, unknown>;
  const id = (value: unknown): string | null => (typeof value === 'string' ? value : null);
  return {
    view: isOneOf(MAP_VIEWS, view) ? view : DEFAULT_CHOICE.view,
    imagery: id(imagery),
    map: id(map),
    opacity: typeof opacity === 'number' && opacity >= MIN_OPACITY && opacity <= 1 ? opacity : DEFAULT_CHOICE.opacity,
    labels: typeof labels === 'boolean' ? labels : DEFAULT_CHOICE.labels,
    relief: typeof relief === 'boolean' ? relief : DEFAULT_CHOICE.relief,
  };
}

/** The chosen layer of a role, or the first one if the chosen one is gone. */
export function layerOf(layers: readonly MapLayer[], role: MapRole, id: string | null): MapLayer | null {
  const ofRole = layers.filter((layer) => layer.role === role);
  return ofRole.find((layer) => layer.id === id) ?? ofRole[0] ?? null;
}

/** With only one of the two, that one is drawn whatever the view says: an empty map helps nobody. */
export function shownOf(layers: readonly MapLayer[], choice: MapChoice): Shown {
  const imagery = layerOf(layers, 'imagery', choice.imagery);
  const map = layerOf(layers, 'map', choice.map);
  const { view, opacity, labels } = choice;
  if (view === 'none') return { imagery: null, map: null, opacity, labels, relief: null };
  const relief = choice.relief ? layerOf(layers, 'terrain', null) : null;
  return {
    imagery: view === 'map' && map ? null : imagery,
    map: view === 'imagery' && imagery ? null : map,
    opacity,
    labels,
    relief,
  };
}

/** The credits of what is drawn, each once. */
export const creditsOf = ({ imagery, map, relief }: Shown): string =>
  [...new Set([imagery?.attribution, map?.attribution, relief?.attribution].filter(Boolean))].join(' · ');
