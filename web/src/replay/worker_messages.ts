/** What the page and the worker that reads a recorded flight say to each other. */

import type { FrameKind } from '../frames/frame_log';
import type { Series } from '../frames/field_series';
import type { Piece } from './key_frames';
import type { FlightOverview } from './overview';

export interface SeriesRequest {
  /** The kind of message, as a place in `kinds`. */
  readonly kind: number;
  readonly field: string;
  readonly index: number;
  readonly fromMs: number;
  readonly toMs: number;
  readonly maxPoints: number;
}

export type ToWorker =
  | { readonly type: 'open-url'; readonly url: string }
  | { readonly type: 'open-file'; readonly file: Blob; readonly name: string }
  | { readonly type: 'piece'; readonly id: number; readonly number: number }
  | { readonly type: 'series'; readonly id: number; readonly request: SeriesRequest };

/** How much of the flight has been read. */
export interface Progress {
  readonly readBytes: number;
  readonly totalBytes: number;
  readonly isWhole: boolean;
  readonly frames: number;
  readonly skippedBytes: number;
  readonly fromMs: number;
  readonly toMs: number;
  readonly begins: readonly number[];
  readonly kinds: readonly FrameKind[];
  readonly overview: FlightOverview;
}

export type FromWorker =
  | { readonly type: 'progress'; readonly progress: Progress }
  | { readonly type: 'problem'; readonly words: string }
  | { readonly type: 'piece'; readonly id: number; readonly piece: Piece | null }
  | { readonly type: 'series'; readonly id: number; readonly series: Series };
