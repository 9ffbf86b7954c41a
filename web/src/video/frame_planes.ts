/**
 * Copies the planes out of a picture that the browser has decoded.
 *
 * A worker could draw the frame itself, but Chromium involves the page's thread for each frame: while the page is busy
 * nothing would be drawn. The copy does not, and costs less than a millisecond for what drones send.
 */

import type { Planes } from './screen';

/** Null for a frame of another kind, which must be drawn directly. The caller keeps ownership of the frame. */
export async function planesOf(frame: VideoFrame): Promise<Planes | null> {
  const { format, displayWidth: width, displayHeight: height } = frame;
  const isSemiPlanar = format === 'NV12';
  if ((format !== 'I420' && !isSemiPlanar) || frame.visibleRect?.width !== width) return null;
  const codedWidth = (width + 15) & ~15;
  const codedHeight = (height + 1) & ~1;
  const pixels = codedWidth * codedHeight;
  const quarter = pixels / 4;
  const bytes = new Uint8Array(pixels + 2 * quarter);
  const half = codedWidth / 2;
  await frame.copyTo(bytes, {
    layout: isSemiPlanar
      ? [
          { offset: 0, stride: codedWidth },
          { offset: pixels, stride: codedWidth },
        ]
      : [
          { offset: 0, stride: codedWidth },
          { offset: pixels, stride: half },
          { offset: pixels + quarter, stride: half },
        ],
  });
  const y = bytes.subarray(0, pixels);
  if (!isSemiPlanar) {
    return {
      width,
      height,
      codedWidth,
      codedHeight,
      y,
      cb: bytes.subarray(pixels, pixels + quarter),
      cr: bytes.subarray(pixels + quarter),
    };
  }
  const [cb, cr] = [new Uint8Array(quarter), new Uint8Array(quarter)];
  for (let at = 0; at < quarter; at++) {
    cb[at] = bytes[pixels + 2 * at] ?? 0;
    cr[at] = bytes[pixels + 2 * at + 1] ?? 0;
  }
  return { width, height, codedWidth, codedHeight, y, cb, cr };
}
