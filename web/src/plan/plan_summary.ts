/** What a plan has, in a few lines: counts, and heights with what they count from. */

import { plural, t } from '../languages/text';
import { isScaled, shortFloat } from './formats/plan_file';
import { frameWords } from './frames';
import type { Plan } from './plan_types';

interface Height {
  readonly frame: number;
  readonly heightM: number;
}

/** "30 to 50 m above home, 500 m above sea level". */
function heightWords(heights: readonly Height[]): string {
  const froms = [...new Set(heights.map(({ frame }) => frameWords(frame)))];
  return froms
    .map((from) => {
      const all = heights.filter(({ frame }) => frameWords(frame) === from).map(({ heightM }) => heightM);
      const [low, high] = [shortFloat(Math.min(...all)), shortFloat(Math.max(...all))];
      return low === high
        ? t('{height} m {from}', { height: low, from })
        : t('{low} to {high} m {from}', { low, high, from });
    })
    .join(', ');
}

export function planSummary({ home, items, fence, rally }: Plan): string[] {
  const places = items.filter(({ command, frame, x, y }) => isScaled(command, frame) && (x !== 0 || y !== 0));
  const areas = fence.shapes.filter(({ shape }) => shape === 'polygon').length;
  const circles = fence.shapes.length - areas;
  const fences = [
    ...(areas > 0 ? [plural(areas, { one: '{n} area', other: '{n} areas' })] : []),
    ...(circles > 0 ? [plural(circles, { one: '{n} circle', other: '{n} circles' })] : []),
    ...(fence.returnPoint ? [t('a place to return to')] : []),
  ];
  const counted = plural(items.length, { one: '{n} item', other: '{n} items' });
  const mission =
    places.length > 0
      ? t('Mission: {counted}, places at {heights}', {
          counted,
          heights: heightWords(places.map(({ frame, z }) => ({ frame, heightM: z }))),
        })
      : t('Mission: {counted}, no places', { counted });
  return [
    ...(items.length > 0 ? [mission] : []),
    ...(fences.length > 0 ? [t('Fence: {fences}', { fences: fences.join(', ') })] : []),
    ...(rally.length > 0
      ? [
          t('{counted} at {heights}', {
            counted: plural(rally.length, { one: '{n} rally point', other: '{n} rally points' }),
            heights: heightWords(rally),
          }),
        ]
      : []),
    ...(home ? [t('Planned home at {height} m above sea level', { height: shortFloat(home.altM) })] : []),
  ];
}
