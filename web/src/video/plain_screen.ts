/** Draws pictures without WebGL: computes the colours here. */

import type { AnyCanvas, Planes, Screen } from './screen';

/** Null without any canvas to draw on. */
export function plainScreen(canvas: AnyCanvas): Screen | null {
  const context = canvas.getContext('2d', { alpha: false }) as
    CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D | null;
  if (!context) return null;
  let pixels: ImageData | null = null;
  const fit = (width: number, height: number): void => {
    if (canvas.width === width && canvas.height === height) return;
    canvas.width = width;
    canvas.height = height;
  };
  return {
    planes(picture) {
      const { width, height } = picture;
      fit(width, height);
      if (pixels?.width !== width || pixels.height !== height) pixels = new ImageData(width, height);
      colours(picture, pixels.data);
      context.putImageData(pixels, 0, 0);
    },
    frame(picture) {
      fit(picture.displayWidth, picture.displayHeight);
      context.drawImage(picture, 0, 0);
    },
    again: () => undefined, // this kind of canvas keeps its content
  };
}

/** ITU-R BT.601 with luma 16 to 235, in integers; `into` holds four bytes per pixel. */
export function colours({ width, height, codedWidth, y, cb, cr }: Planes, into: Uint8ClampedArray): void {
  const halfWidth = codedWidth >> 1;
  let out = 0;
  for (let row = 0; row < height; row++) {
    const line = row * codedWidth;
    const halfLine = (row >> 1) * halfWidth;
    for (let column = 0; column < width; column++) {
      const luma = 298 * ((y[line + column] ?? 0) - 16) + 128;
      const blue = (cb[halfLine + (column >> 1)] ?? 0) - 128;
      const red = (cr[halfLine + (column >> 1)] ?? 0) - 128;
      into[out] = (luma + 409 * red) >> 8;
      into[out + 1] = (luma - 100 * blue - 208 * red) >> 8;
      into[out + 2] = (luma + 516 * blue) >> 8;
      into[out + 3] = 255;
      out += 4;
    }
  }
}
