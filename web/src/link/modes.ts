/** The flight modes of the known autopilots, from the generated table of their profiles (wire/autopilots/). */

import { t } from '../languages/text';
import { AUTOPILOTS, FAMILIES, type PilotCommandName } from './generated/autopilots.gen';
import { MAV_TYPE } from './generated/mavlink.gen';

/** What a drone in the air does in a mode, as relevant for a lost connection. */
export type FlightTask = 'mission' | 'return' | 'landing' | 'by-hand' | 'by-itself';

export interface Mode {
  /** For display. */
  readonly name: string;
  /** The autopilot's own name, as REST expects it. */
  readonly ownName: string;
  /** HEARTBEAT.custom_mode when it is active. */
  readonly customMode: number;
  /** Parameters 2 and 3 of DO_SET_MODE. */
  readonly main: number;
  readonly sub: number;
  /** Follows the sticks: with no pilot, those of a radio at rest (throttle down: it descends). */
  readonly obeysSticks: boolean;
  /** Null: not specified for this mode. */
  readonly task: FlightTask | null;
}

export interface ModeSet {
  /** The selectable modes. */
  readonly modes: readonly Mode[];
  /** Holds its position without stick input. */
  readonly hold: Mode;
  readonly returns: Mode;
  readonly land: Mode;
  /** Required before it takes off and flies to places; null: none required. */
  readonly guided: Mode | null;
  /** For flying by hand: follows the sticks, and holds its position when they are centred. */
  readonly byHand: Mode;
}

/** What the console knows about an autopilot on one kind of vehicle. */
export interface AutopilotProfile {
  readonly key: string;
  readonly label: string;
  readonly family: keyof typeof FAMILIES;
  readonly autopilot: number;
  readonly vehicleTypes: readonly number[];
  /** Item 0 of its mission is home. */
  readonly hasHomeSlot: boolean;
  /** The modes for its hold ladder, without altitude hold. */
  readonly holdRungs: readonly string[];
  /** By command, why the autopilot never carries it out. */
  readonly cannot: Readonly<Partial<Record<PilotCommandName, string>>>;
  readonly modes: readonly (Mode & { readonly drifts: boolean; readonly isOffered: boolean })[];
  readonly roles: Readonly<Record<'hold' | 'returns' | 'land' | 'guided' | 'byHand', number | null>>;
}

const PROFILES: readonly AutopilotProfile[] = AUTOPILOTS;

/** By MAV_AUTOPILOT and MAV_TYPE; without a type, that of its multicopters. Null if unknown. */
export function profileOf(autopilot: number, vehicleType: number | null): AutopilotProfile | null {
  const type = vehicleType ?? MAV_TYPE.QUADROTOR;
  return PROFILES.find((one) => one.autopilot === autopilot && one.vehicleTypes.includes(type)) ?? null;
}

/** The autopilot's family, whatever the vehicle; null if unknown. */
export function familyOf(autopilot: number | null): AutopilotProfile['family'] | null {
  return PROFILES.find((one) => one.autopilot === autopilot)?.family ?? null;
}

/** The modes that a hold ladder may have before altitude hold; those of all autopilots if none is known. */
export function holdRungs(autopilot: number | null): readonly string[] {
  const known = autopilot === null ? null : profileOf(autopilot, null);
  return known?.holdRungs ?? PROFILES.flatMap((one) => one.holdRungs);
}

/** Why the autopilot never carries out a command, as a sentence; null if it does, or if that is unknown. */
export function whyNot(command: PilotCommandName, autopilot: number, vehicleType: number | null): string | null {
  return profileOf(autopilot, vehicleType)?.cannot[command] ?? null;
}

function modeIn(profile: AutopilotProfile | null, customMode: number | null): AutopilotProfile['modes'][number] | null {
  return profile?.modes.find((one) => one.customMode === customMode) ?? null;
}

function modeSetFor(profile: AutopilotProfile): ModeSet | null {
  const { roles } = profile;
  const hold = modeIn(profile, roles.hold);
  const returns = modeIn(profile, roles.returns);
  const land = modeIn(profile, roles.land);
  const byHand = modeIn(profile, roles.byHand);
  if (!hold || !returns || !land || !byHand) return null;
  const modes = profile.modes.filter(({ isOffered }) => isOffered);
  return { modes, hold, returns, land, guided: modeIn(profile, roles.guided), byHand };
}

const MODE_SETS = new Map(PROFILES.map((profile) => [profile, modeSetFor(profile)]));

/** Null for a vehicle that is not flown from here. */
export function modeSetOf(autopilot: number, vehicleType: number | null): ModeSet | null {
  const profile = profileOf(autopilot, vehicleType);
  return profile && (MODE_SETS.get(profile) ?? null);
}

/** The mode that a hold by hand requests, of a plane too; null if there is none. */
export function holdModeOf(autopilot: number, vehicleType: number): Mode | null {
  const profile = profileOf(autopilot, vehicleType);
  return modeIn(profile, profile?.roles.hold ?? null);
}

const DRIFTING: ReadonlySet<string> = new Set(
  PROFILES.flatMap(({ modes }) => modes.filter(({ drifts }) => drifts).map(({ name }) => name)),
);

/** Whether a mode, by its display name, keeps the height but not the position. */
export const driftsWithTheWind = (mode: string | null): boolean => mode !== null && DRIFTING.has(mode);

export function obeysSticks(autopilot: number, customMode: number, vehicleType: number | null): boolean {
  const mode = modeIn(profileOf(autopilot, vehicleType), customMode);
  return mode !== null && mode.task !== null && mode.obeysSticks;
}

/** Null for an unknown mode. */
export function flightTask(
  autopilot: number | null,
  customMode: number | null,
  vehicleType: number | null,
): FlightTask | null {
  if (autopilot === null) return null;
  return modeIn(profileOf(autopilot, vehicleType), customMode)?.task ?? null;
}

export function modeName(autopilot: number, customMode: number, vehicleType: number | null): string {
  return modeIn(profileOf(autopilot, vehicleType), customMode)?.name ?? t('MODE {customMode}', { customMode });
}

/** Mission commands that releases of this family before the given one refuse. */
export const missionSince = (family: keyof typeof FAMILIES): Readonly<Record<string, readonly [number, number]>> =>
  FAMILIES[family].missionSince;
