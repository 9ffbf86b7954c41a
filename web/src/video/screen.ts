/** Where pictures are drawn. A picture is drawn at once: nothing here waits for a clock or keeps a second one. */

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
  /** It stays the caller's, who closes it. */
  frame(picture: VideoFrame): void;
  /** The picture in sight once more, for whoever reads the canvas right after. */
  again(): void;
}

export type AnyCanvas = OffscreenCanvas | HTMLCanvasElement;
