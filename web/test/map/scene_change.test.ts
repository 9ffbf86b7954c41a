import { describe, expect, it } from 'vitest';

import type { Scene, SceneDrone } from '../../src/map/overlay';
import { sameScene } from '../../src/map/scene_change';

const path = [
  { latDeg: 46.9, lonDeg: 8 },
  { latDeg: 46.95, lonDeg: 8 },
];
const drone = (changes: Partial<SceneDrone> = {}): SceneDrone => ({
  id: 1,
  name: 'Kestrel',
  detail: '10.0 m  0.0 m/s',
  place: { latDeg: 47, lonDeg: 8 },
  headingDeg: 90,
  state: 'flying',
  track: [...path],
  isUnattended: false,
  isStale: false,
  ...changes,
});
const scene = (changes: Partial<Scene> = {}): Scene => ({
  drones: [drone()],
  selectedId: null,
  home: { latDeg: 47, lonDeg: 8 },
  target: { place: { latDeg: 47.1, lonDeg: 8 }, from: { latDeg: 47, lonDeg: 8 }, label: '11 km' },
  showsAim: false,
  ...changes,
});

describe('a scene', () => {
  it('made again of the same is not drawn again', () => {
    expect(sameScene(scene(), scene())).toBe(true);
  });

  it.each<Partial<SceneDrone>>([
    { id: 2 },
    { name: 'Kestrel: unattended' },
    { detail: '10.1 m  0.0 m/s' },
    { place: { latDeg: 47, lonDeg: 8.0000001 } },
    { headingDeg: 91 },
    { state: 'alert' },
    { isUnattended: true },
    { isStale: true },
    { track: [...path, { latDeg: 47, lonDeg: 8 }] },
    { track: path.slice(1) },
    { passed: 1 },
  ])('is drawn again when a drone has %j', (change) => {
    expect(sameScene(scene(), scene({ drones: [drone(change)] }))).toBe(false);
  });

  it.each<Partial<Scene>>([
    { drones: [] },
    { drones: [drone(), drone({ id: 2 })] },
    { selectedId: 1 },
    { home: null },
    { home: { latDeg: 47.1, lonDeg: 8 } },
    { target: null },
    { near: [{ from: path[0]!, to: path[1]!, isWarning: false, label: '12 m, 3 m in height', isStranger: false }] },
    { target: { place: { latDeg: 47.2, lonDeg: 8 }, from: { latDeg: 47, lonDeg: 8 }, label: '11 km' } },
    { target: { place: { latDeg: 47.1, lonDeg: 8 }, from: null, label: '11 km' } },
    { target: { place: { latDeg: 47.1, lonDeg: 8 }, from: { latDeg: 47, lonDeg: 8 }, label: '12 km' } },
    { showsAim: true },
    { distanceWords: String },
  ])('is drawn again for %j', (change) => {
    expect(sameScene(scene(), scene(change))).toBe(false);
  });
});
