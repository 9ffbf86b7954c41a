import { expect, it } from 'vitest';

import { boxIn, pictureIn, SHOWN_MS, strength } from '../../src/video/sighting_box';

const PICTURE = { width: 640, height: 480 };

it.each([
  ['bars at the sides', { width: 1000, height: 480 }, { left: 180, top: 0, width: 640, height: 480 }],
  ['bars above and below', { width: 320, height: 480 }, { left: 0, top: 120, width: 320, height: 240 }],
  ['no bars', { width: 1280, height: 960 }, { left: 0, top: 0, width: 1280, height: 960 }],
])('finds the picture in its frame: %s', (_, frame, picture) => {
  expect(pictureIn(frame, PICTURE)).toEqual(picture);
});

it('has no picture before the first one', () => {
  expect(pictureIn({ width: 100, height: 100 }, { width: 0, height: 0 })).toEqual({
    left: 0,
    top: 0,
    width: 0,
    height: 0,
  });
});

it('puts the middle of the box where the target is', () => {
  const picture = pictureIn({ width: 1000, height: 480 }, PICTURE);
  expect(boxIn(picture, { x: 0.25, y: 0.5, width: 0.1, height: 0.2 })).toEqual({
    left: 308,
    top: 192,
    width: 64,
    height: 96,
  });
  expect(boxIn(picture, { x: 1, y: 0, width: 0, height: 0 })).toEqual({ left: 813, top: -7, width: 14, height: 14 });
});

it('fades a box in its last second', () => {
  expect([-50, 0, SHOWN_MS - 1000, SHOWN_MS - 250, SHOWN_MS, SHOWN_MS + 1].map(strength)).toEqual([
    1, 1, 1, 0.25, 0, 0,
  ]);
});
