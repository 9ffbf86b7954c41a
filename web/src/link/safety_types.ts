/** What the REST interface says about a drone's safety: its settings, the check before flight, the rehearsal. */

import type { LostAction, RehearsedLoss, StreamProfile } from './wire_types';

export interface SafetySettings {
  /** Mode names, tried in order; altitude hold always comes last, named or not. */
  readonly hold_ladder: readonly string[];
  readonly sticks_stale_s: number;
  readonly sticks_late_s: number;
  readonly commands_late_s: number;
  readonly lost_hold_s: number;
  readonly lost_action: LostAction;
  readonly lost_action_s: number;
  readonly rtt_limit_ms: number;
  readonly rtt_limit_s: number;
  readonly stream_profile: StreamProfile | 'auto';
}

export type NumberSetting = Exclude<keyof SafetySettings, 'hold_ladder' | 'lost_action' | 'stream_profile'>;

export type LossAbout = 'operator' | 'tower' | 'radio';
export type LossSeverity = 'info' | 'warning' | 'danger';

export interface LossSentence {
  readonly about: LossAbout | (string & {});
  readonly severity: LossSeverity;
  readonly text: string;
}

export interface LossCheck {
  /** Every parameter was read. */
  readonly complete: boolean;
  readonly has_radio: boolean | null;
  readonly sentences: readonly LossSentence[];
  readonly dangerous: boolean;
  readonly acknowledged: boolean;
}

/** A parameter that flying without a radio receiver depends on. */
export interface ReceiverSetupRow {
  readonly name: string;
  /** Null: not read yet. */
  readonly now: number | null;
  readonly wanted: number;
  readonly why: string;
  readonly ok: boolean;
}

export interface ReceiverSetup {
  readonly autopilot: 'ardupilot' | 'px4' | '';
  readonly has_radio: boolean | null;
  /** There is no receiver, and something is not as it should be. */
  readonly needed: boolean;
  /** Every one of the parameters was read. */
  readonly known: boolean;
  readonly rows: readonly ReceiverSetupRow[];
  readonly text: string;
}

/** What a rehearsal would be. */
export interface RehearsalTerms {
  readonly lasts_s: Readonly<Record<RehearsedLoss, number>>;
  readonly running: boolean;
  /** The parameters prove that the autopilot is a simulated one. */
  readonly simulated: boolean;
}

/** Whether arming must wait for "I have read this". */
export const wantsReading = (check: LossCheck): boolean => check.dangerous && !check.acknowledged;

/** The rungs that a hold may be built of, by autopilot, before altitude hold, which is the last one anyway. */
export const COPTER_RUNGS = ['LOITER', 'POSHOLD', 'BRAKE'] as const;
export const PX4_RUNGS = ['AUTO.LOITER', 'POSCTL'] as const;
export const ALTITUDE_RUNGS: ReadonlySet<string> = new Set(['ALT_HOLD', 'ALTCTL']);
