/** What the REST interface says about a drone's safety: its settings, the check before flight, the rehearsal. */

import type { Schemas } from './rest_types';

export type SafetySettings = Schemas['DroneSettingsView'];
export type NumberSetting = Exclude<keyof SafetySettings, 'hold_ladder' | 'lost_action' | 'stream_profile'>;
export type LossSentence = Schemas['SentenceView'];
export type LossCheck = Schemas['LossCheckView'];
/** A parameter that flying without a radio receiver depends on. */
export type ReceiverSetupRow = Schemas['SetupRowView'];
export type ReceiverSetup = Schemas['ReceiverSetupView'];
export type RehearsalTerms = Schemas['RehearsalView'];

/** Whether arming must wait for "I have read this". */
export const wantsReading = (check: LossCheck): boolean => check.dangerous && !check.acknowledged;

/** The rungs that a hold may be built of, by autopilot, before altitude hold, which is the last one anyway. */
export const COPTER_RUNGS = ['LOITER', 'POSHOLD', 'BRAKE'] as const;
export const PX4_RUNGS = ['AUTO.LOITER', 'POSCTL'] as const;
export const ALTITUDE_RUNGS: ReadonlySet<string> = new Set(['ALT_HOLD', 'ALTCTL']);
