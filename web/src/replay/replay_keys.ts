/** The keys of a replay, as changes of its player. Pure. */

import { SPEEDS } from './player';

export type ReplayKey =
  | { readonly do: 'toggle' }
  | { readonly do: 'by'; readonly ms: number }
  | { readonly do: 'to'; readonly end: 'begin' | 'end' }
  | { readonly do: 'event'; readonly way: -1 | 1 }
  | { readonly do: 'speed'; readonly way: -1 | 1 };

const STEP_MS = 5_000;
const LONG_STEP_MS = 30_000;
const FINE_STEP_MS = 100;

interface Pressed {
  readonly key: string;
  readonly shiftKey: boolean;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly altKey: boolean;
}

/** Null: not for the replay. */
export function replayKey({ key, shiftKey, ctrlKey, metaKey, altKey }: Pressed): ReplayKey | null {
  if (ctrlKey || metaKey || altKey) return null;
  const step = shiftKey ? LONG_STEP_MS : STEP_MS;
  switch (key) {
    case ' ':
      return { do: 'toggle' };
    case 'ArrowLeft':
      return { do: 'by', ms: -step };
    case 'ArrowRight':
      return { do: 'by', ms: step };
    case ',':
      return { do: 'by', ms: -FINE_STEP_MS };
    case '.':
      return { do: 'by', ms: FINE_STEP_MS };
    case 'Home':
      return { do: 'to', end: 'begin' };
    case 'End':
      return { do: 'to', end: 'end' };
    case 'p':
      return { do: 'event', way: -1 };
    case 'n':
      return { do: 'event', way: 1 };
    case '[':
      return { do: 'speed', way: -1 };
    case ']':
      return { do: 'speed', way: 1 };
    default:
      return null;
  }
}

/** The next speed that way; the same at the end. */
export function nextSpeed(speed: number, way: -1 | 1): number {
  const at = SPEEDS.findIndex((one) => one === speed);
  return SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + way))]!;
}
