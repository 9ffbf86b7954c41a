/**
 * Completes the tower's view of a drone: fields that an older tower omits get the value that held before they existed.
 */

import { droneInWords } from './tower_words';
import type { Drone, User } from './wire_types';

const BEFORE_THESE_FIELDS = {
  agent_version: null,
  firmware: null,
  release: null,
  armed: null,
  airborne: null,
  airborne_since: null,
  last_heard: null,
  offered: false,
  assistant: null,
  may_watch: true,
  may_watch_video: true,
  lost_action: 'return',
  lost_action_s: 30,
  hold: null,
  profile: null,
  profile_chosen: 'auto',
  profile_why: '',
  other_systems: [],
  hears_agent: null,
  signing: 'off',
  restraint: null,
} as const satisfies Partial<Drone>;

/** As received: the fields of the first version are present, newer ones may be missing. */
type DroneOnWire = Omit<Drone, keyof typeof BEFORE_THESE_FIELDS> & Partial<Drone>;

export function readDrone(raw: DroneOnWire): Drone {
  return droneInWords({ ...BEFORE_THESE_FIELDS, ...raw });
}

/** Combines two sources: true if either says so, null if neither knows. */
export const eitherSays = (one: boolean | null, other: boolean | null): boolean | null =>
  one === true || other === true ? true : (one ?? other);

/** Whether this user may take free controls. */
export function mayHaveControls(drone: Drone, user: Pick<User, 'id' | 'role'>): boolean {
  if (drone.relation !== undefined) return drone.relation !== 'observer' && drone.relation !== 'stranger';
  return (
    user.role === 'admin' ||
    drone.owners.some(({ id }) => id === user.id) ||
    (drone.loans ?? []).some(({ user: { id } }) => id === user.id)
  );
}

/** Whether this user may take control now: the controls are free, and no admin has shut this user out. */
export const mayTakeFree = (drone: Drone, user: Pick<User, 'id' | 'role'>): boolean =>
  drone.holder === null && drone.taken_from?.id !== user.id && mayHaveControls(drone, user);

/**
 * Whether this user may take controls from others, give them back and assist: an admin of the tower or of the drone's
 * team.
 */
export const mayTake = (drone: Drone, user: Pick<User, 'role'>): boolean =>
  user.role === 'admin' || drone.relation === 'team-admin';

/** Whether this user may send "stay": the holder, and users who may fly the drone and are not shut out. */
export function mayStay(drone: Drone, user: Pick<User, 'id' | 'role'>): boolean {
  if (user.role === 'admin' || drone.holder?.id === user.id) return true;
  if (drone.taken_from?.id === user.id && !drone.offered) return false;
  return mayHaveControls(drone, user);
}

/** Whether this user may start and stop recordings of the drone's video. */
export const mayRecord = (drone: Drone, user: Pick<User, 'id' | 'role'>): boolean =>
  user.role === 'admin' || drone.holder?.id === user.id;

export const mayDeleteRecordings = (drone: Drone, user: Pick<User, 'id' | 'role'>): boolean =>
  mayTake(drone, user) || drone.owners.some(({ id }) => id === user.id);

/** Whether this user's commands may go to the drone: the holder's, and those of an assisting admin. */
export function mayCommand(drone: Drone, user: Pick<User, 'id'>): boolean {
  return drone.holder?.id === user.id || drone.assistant?.id === user.id;
}
