/** Where a panel stands so that it does not cover the place that it is about. Pure. */

export interface Size {
  readonly width: number;
  readonly height: number;
}

export interface PanelPlace {
  readonly left: number;
  readonly top: number;
  /** How far down the map must move (up if negative) where there is room beside the place nowhere. */
  readonly moveDownPx: number;
}

const MARGIN_PX = 8;
/** Of the symbol of the target, and its label. */
const GAP_PX = 26;

const clamp = (value: number, most: number): number => Math.max(MARGIN_PX, Math.min(value, most));

interface Point {
  readonly x: number;
  readonly y: number;
}

/**
 * `at`: the place, from the top left of the map; `drone`: not covered either, if it can be helped. Beside the place if
 * there is room, else at the bottom of the map.
 */
export function besideTarget(at: Point, panel: Size, map: Size, drone: Point | null = null): PanelPlace {
  const lastLeft = map.width - panel.width - MARGIN_PX;
  const lastTop = map.height - panel.height - MARGIN_PX;
  const [left, top] = [clamp(at.x - panel.width / 2, lastLeft), clamp(at.y - panel.height / 2, lastTop)];
  const rightOf = { left: at.x + GAP_PX, top };
  const leftOf = { left: at.x - GAP_PX - panel.width, top };
  const below = { left, top: at.y + GAP_PX };
  const above = { left, top: at.y - GAP_PX - panel.height };
  const fitting = [rightOf, leftOf, below, above].filter(
    (one) => one.left >= MARGIN_PX && one.left <= lastLeft && one.top >= MARGIN_PX && one.top <= lastTop,
  );
  const covers = (one: { left: number; top: number }): boolean =>
    drone !== null &&
    Math.abs(drone.x - one.left - panel.width / 2) < panel.width / 2 + MARGIN_PX &&
    Math.abs(drone.y - one.top - panel.height / 2) < panel.height / 2 + MARGIN_PX;
  const best = fitting.find((one) => !covers(one)) ?? fitting[0];
  if (best) return { ...best, moveDownPx: 0 };
  const bottom = Math.max(MARGIN_PX, lastTop);
  return { left, top: bottom, moveDownPx: Math.min(0, Math.max(bottom / 2, bottom - GAP_PX) - at.y) };
}
