/** Four axes of a pilot's hands, where they come from, and when they are centred. */

/** Each -1..1. `throttle` 0 is the middle (keep height), `pitch` 1 is stick forward (nose down). */
export interface Axes {
  readonly roll: number;
  readonly pitch: number;
  readonly yaw: number;
  readonly throttle: number;
}

export const CENTRED: Axes = { roll: 0, pitch: 0, yaw: 0, throttle: 0 };
export const AXIS_NAMES = ['throttle', 'yaw', 'pitch', 'roll'] as const satisfies readonly (keyof Axes)[];

/** Pads rest a little off their middle. */
export const CENTRE_LIMIT = 0.08;

/** The axes that are not centred. */
export function offCentre(axes: Axes): (keyof Axes)[] {
  return AXIS_NAMES.filter((name) => Math.abs(axes[name]) > CENTRE_LIMIT);
}

/** Something that a pilot moves. */
export interface AxesSource {
  readonly name: string;
  /** Null when it is gone (a pad that was unplugged). */
  read(nowMs: number): Axes | null;
}

/** The part of a browser's Gamepad that is used. */
export interface PadLike {
  readonly id: string;
  readonly index: number;
  readonly connected: boolean;
  readonly axes: readonly number[];
}

const clamp = (value: number): number => Math.max(-1, Math.min(1, Number.isFinite(value) ? value : 0));
const deadened = (value: number): number => (Math.abs(value) <= CENTRE_LIMIT ? 0 : clamp(value));

/** Mode 2: throttle and yaw on the left stick, pitch and roll on the right. Null for a pad with fewer axes. */
export function padAxes(pad: PadLike): Axes | null {
  const [leftX, leftY, rightX, rightY] = pad.axes;
  if (leftX === undefined || leftY === undefined || rightX === undefined || rightY === undefined) return null;
  // A pad says -1 for up and forward. 0 - x, because -0 is nobody's friend.
  return { roll: clamp(rightX), pitch: clamp(0 - rightY), yaw: clamp(leftX), throttle: clamp(0 - leftY) };
}

type Pads = () => readonly (PadLike | null)[];

/** The first connected pad with two sticks. */
export function findPad(pads: Pads): PadLike | null {
  return pads().find((pad) => pad !== null && pad.connected && padAxes(pad) !== null) ?? null;
}

export function padSource(first: PadLike, pads: Pads): AxesSource {
  return {
    name: first.id,
    read() {
      const pad = pads().find((one) => one?.index === first.index && one.id === first.id && one.connected);
      const axes = pad ? padAxes(pad) : null;
      return (
        axes && {
          roll: deadened(axes.roll),
          pitch: deadened(axes.pitch),
          yaw: deadened(axes.yaw),
          throttle: deadened(axes.throttle),
        }
      );
    },
  };
}
