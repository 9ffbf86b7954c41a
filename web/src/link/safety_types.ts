/** REST types of a drone's safety: its settings, the check before flight, the rehearsal. */

import type { Schemas } from './rest_types';

export type SafetySettings = Schemas['DroneSettingsView'];
export type NumberSetting = Exclude<keyof SafetySettings, 'hold_ladder' | 'lost_action' | 'stream_profile'>;
export type LossSentence = Schemas['SentenceView'];
export type LossCheck = Schemas['LossCheckView'];
/** A parameter relevant to flying without a radio receiver. */
export type ReceiverSetupRow = Schemas['SetupRowView'];
export type ReceiverSetup = Schemas['ReceiverSetupView'];
export type RehearsalTerms = Schemas['RehearsalView'];

/** Whether arming requires a confirmation that the check was read. */
export const mustBeRead = (check: LossCheck): boolean => check.dangerous && !check.acknowledged;

/** The last rung of every hold ladder, by the autopilots' mode names. */
export const ALTITUDE_RUNGS: ReadonlySet<string> = new Set(['ALT_HOLD', 'ALTCTL']);
