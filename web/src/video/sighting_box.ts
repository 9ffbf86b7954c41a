/** Where a target's box lies over a video that keeps its own shape in its frame. Pure. */

import type { VideoBox } from '../link/sightings';

export interface Rectangle {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

/** A sighting is shown for this long, and fades in the last second. */
export const SHOWN_MS = 4_000;
const FADES_MS = 1_000;
/** Smaller targets get a box of this side. */
const LEAST_PX = 14;

/** The picture as `object-fit: contain` draws it, in pixels of the frame. */
export function pictureIn(
  frame: { width: number; height: number },
  picture: { width: number; height: number },
): Rectangle {
  if (picture.width <= 0 || picture.height <= 0) return { left: 0, top: 0, width: 0, height: 0 };
  const scale = Math.min(frame.width / picture.width, frame.height / picture.height);
  const [width, height] = [picture.width * scale, picture.height * scale];
  return { left: (frame.width - width) / 2, top: (frame.height - height) / 2, width, height };
}

export function boxIn(picture: Rectangle, box: Pick<VideoBox, 'x' | 'y' | 'width' | 'height'>): Rectangle {
  const width = Math.max(box.width * picture.width, LEAST_PX);
  const height = Math.max(box.height * picture.height, LEAST_PX);
  const [x, y] = [picture.left + box.x * picture.width, picture.top + box.y * picture.height];
  return { left: x - width / 2, top: y - height / 2, width, height };
}

/** 1: new, 0: gone. */
export const strength = (ageMs: number): number =>
  ageMs < 0 ? 1 : Math.max(0, Math.min(1, (SHOWN_MS - ageMs) / FADES_MS));
