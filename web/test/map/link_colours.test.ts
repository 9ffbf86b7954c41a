import { expect, it } from 'vitest';

import { GRADE_COLOURS } from '../../src/map/link_colours';

/** Relative luminance (WCAG 2). */
function luminance(colour: string): number {
  const [red, green, blue] = [1, 3, 5].map((at) => {
    const part = parseInt(colour.slice(at, at + 2), 16) / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red! + 0.7152 * green! + 0.0722 * blue!;
}

it('gets darker from grade to grade, so that hue is not needed to tell them apart', () => {
  const { good, fair, poor, bad } = GRADE_COLOURS;
  const light = [good, fair, poor, bad].map(luminance);
  for (let at = 1; at < light.length; at += 1) {
    expect((light[at - 1]! + 0.05) / (light[at]! + 0.05)).toBeGreaterThan(1.5);
  }
});
