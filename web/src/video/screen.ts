/** The drawing surface. Draws a picture at once: it waits for no clock and buffers no second picture. */

/** A decoded picture in its three planes; `codedWidth` and `codedHeight` are those of the luma plane. */
export interface Planes {
  readonly width: number;
  readonly height: number;
  readonly codedWidth: number;
  readonly codedHeight: number;
  readonly y: Uint8Array;
  readonly cb: Uint8Array;
  readonly cr: Uint8Array;
}

export interface Screen {
  planes(picture: Planes): void;
  /** The caller keeps ownership and closes it. */
  frame(picture: VideoFrame): void;
  /** Draws the visible picture once more, for a caller that reads the canvas right after. */
  again(): void;
}

export type AnyCanvas = OffscreenCanvas | HTMLCanvasElement;
