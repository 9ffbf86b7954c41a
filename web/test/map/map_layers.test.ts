import { describe, expect, it } from 'vitest';

import { creditsOf, DEFAULT_CHOICE, readChoice, shownOf, type MapLayer, type MapRole } from '../../src/map/map_layers';

const layer = (id: string, role: MapRole, attribution = ''): MapLayer => ({
  id,
  name: id,
  role,
  kind: 'raster',
  source: 'file',
  url: `/${id}`,
  tileSize: 256,
  maxZoom: null,
  attribution,
  parts: [],
});
const ABOVE = layer('above', 'imagery', '© Pilots');
const OTHER = layer('other', 'imagery');
const STREETS = layer('streets', 'map', '© Walkers');
const HILLS = layer('hills', 'terrain', '© Climbers');
const ALL = [STREETS, ABOVE, OTHER, HILLS];

describe('what is stored of a choice', () => {
  it('comes back as it was', () => {
    const choice = { view: 'map', imagery: 'a', map: 'b', opacity: 0.5, labels: false, relief: false } as const;
    expect(readChoice(JSON.parse(JSON.stringify(choice)))).toEqual(choice);
  });

  it.each([[null], [undefined], ['both'], [[]], [{ view: 'all', imagery: 7, map: {}, opacity: 0, labels: 'yes' }]])(
    'is the default where it is unusable: %j',
    (stored) => {
      expect(readChoice(stored)).toEqual(DEFAULT_CHOICE);
    },
  );
});

describe('what is drawn', () => {
  it.each([
    ['both', 'above', 'streets'],
    ['imagery', 'above', undefined],
    ['map', undefined, 'streets'],
    ['none', undefined, undefined],
  ] as const)('in the view %s', (view, imagery, map) => {
    const shown = shownOf(ALL, { ...DEFAULT_CHOICE, view });
    expect([shown.imagery?.id, shown.map?.id]).toEqual([imagery, map]);
  });

  it('is the chosen layer while it is there, else the first of its role', () => {
    expect(shownOf(ALL, { ...DEFAULT_CHOICE, imagery: 'other' }).imagery).toBe(OTHER);
    expect(shownOf([STREETS, ABOVE], { ...DEFAULT_CHOICE, imagery: 'other' }).imagery).toBe(ABOVE);
    expect(shownOf(ALL, { ...DEFAULT_CHOICE, map: 'above' }).map).toBe(STREETS);
  });

  it('is what there is, if the tower lacks what the view is for', () => {
    expect(shownOf([STREETS], { ...DEFAULT_CHOICE, view: 'imagery' }).map).toBe(STREETS);
    expect(shownOf([ABOVE], { ...DEFAULT_CHOICE, view: 'map' }).imagery).toBe(ABOVE);
    expect(shownOf([HILLS], DEFAULT_CHOICE)).toMatchObject({ imagery: null, map: null });
  });

  it('is credited, each source once', () => {
    expect(creditsOf(shownOf(ALL, DEFAULT_CHOICE))).toBe('© Pilots · © Walkers · © Climbers');
    expect(creditsOf(shownOf(ALL, { ...DEFAULT_CHOICE, relief: false }))).toBe('© Pilots · © Walkers');
    expect(creditsOf(shownOf([ABOVE, layer('b', 'map', '© Pilots')], DEFAULT_CHOICE))).toBe('© Pilots');
    expect(creditsOf(shownOf([], DEFAULT_CHOICE))).toBe('');
  });
});
