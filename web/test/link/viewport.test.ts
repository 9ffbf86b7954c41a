/** The map area reported to the tower: slightly more than visible, in valid degrees. */

import { describe, expect, it } from 'vitest';

import { viewportText, type MapBounds } from '../../src/link/messages';

function reported(shown: MapBounds): MapBounds {
  const { type, bounds } = JSON.parse(viewportText(shown)) as { type: string; bounds: MapBounds };
  expect(type).toBe('viewport');
  return bounds;
}

describe('viewportText', () => {
  it('adds a fifth on each side', () => {
    expect(reported({ south: 10, west: 20, north: 20, east: 40 })).toEqual({ south: 8, west: 16, north: 22, east: 44 });
  });

  it('stays on the globe near the poles', () => {
    expect(reported({ south: -89, west: 0, north: 89, east: 10 })).toMatchObject({ south: -90, north: 90 });
  });

  it('begins in the east and ends in the west where it crosses the antimeridian', () => {
    expect(reported({ south: 0, west: 170, north: 1, east: 190 })).toMatchObject({ west: 166, east: -166 });
    expect(reported({ south: 0, west: -190, north: 1, east: -170 })).toMatchObject({ west: 166, east: -166 });
  });

  it('is the whole turn when it shows nearly all of it', () => {
    expect(reported({ south: -60, west: -500, north: 60, east: -200 })).toMatchObject({ west: -180, east: 180 });
  });

  it('says that there is no map', () => {
    expect(viewportText(null)).toBe('{"type":"viewport","bounds":null}');
  });
});
