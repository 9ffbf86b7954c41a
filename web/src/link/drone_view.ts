/** The tower's view of a drone, made whole: what an older tower leaves out gets the value that was true before. */

import type { Drone, User } from './wire_types';

const BEFORE_THESE_FIELDS = {
  armed: false,
  airborne: false,
  airborne_since: null,
  offered: false,
  assistant: null,
  may_watch: true,
  may_watch_video: true,
  lost_action: 'return',
  lost_action_s: 30,
  profile: null,
  profile_chosen: 'auto',
  profile_why: '',
} as const satisfies Partial<Drone>;

/** What comes over the wire: the fields of the first version are there, the newer ones perhaps. */
export type DroneOnWire = Omit<Drone, keyof typeof BEFORE_THESE_FIELDS> & Partial<Drone>;

export function readDrone(raw: DroneOnWire): Drone {
  return { ...BEFORE_THESE_FIELDS, ...raw };
}

/** Whether this user begins and ends recordings of its video. */
export const mayRecord = (drone: Drone, user: Pick<User, 'id' | 'role'>): boolean =>
  user.role === 'admin' || drone.holder?.id === user.id;

export const mayDeleteRecordings = (drone: Drone, user: Pick<User, 'id' | 'role'>): boolean =>
  user.role === 'admin' || drone.owners.some(({ id }) => id === user.id);

/** Whether this user's commands may go to the drone. An assisting admin's do as well as the holder's. */
export function mayCommand(drone: Drone, user: Pick<User, 'id'>): boolean {
  return drone.holder?.id === user.id || drone.assistant?.id === user.id;
}
