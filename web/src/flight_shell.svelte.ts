/** What the flight bar is about, and who shows the alerts: state shared by the bar, the pages and the alert drawer. */

import { mayCommand } from './link/drone_view';
import type { Vehicle } from './link/vehicle';
import type { User } from './link/wire_types';
import { tower } from './tower.svelte';

/** `selectedId`: the drone whose card is open on the Monitor. */
export const shell = $state<{
  selectedId: number | null;
  showsAlerts: boolean;
  /** On a phone, where the bar of the pages is folded away while the flight bar shows a drone. */
  showsPages: boolean;
  /** What the flight bar was about last: it never changes to another drone by itself. */
  ownId: number | null;
}>({ selectedId: null, showsAlerts: false, showsPages: false, ownId: null });

/** The drones that this user's commands reach, in the order of their ids. */
export const commanded = (vehicles: ReadonlyMap<number, Vehicle>, user: Pick<User, 'id'>): Vehicle[] =>
  [...vehicles.values()].filter((vehicle) => mayCommand(vehicle.drone.get(), user));

/**
 * The drone that the bar is about: the one looked at if it is one's own, else the one that it was about (`lastId`) as
 * long as one controls it, else the first that one controls, else the one looked at.
 */
export function barSubject(
  vehicles: ReadonlyMap<number, Vehicle>,
  user: Pick<User, 'id'>,
  lookedAtId: number | null,
  lastId: number | null = null,
): { readonly own: Vehicle | null; readonly other: Vehicle | null } {
  const mine = commanded(vehicles, user);
  const lookedAt = lookedAtId === null ? null : (vehicles.get(lookedAtId) ?? null);
  const last = mine.find((one) => one.drone.get().id === lastId);
  const own = mine.find((one) => one === lookedAt) ?? last ?? mine[0] ?? null;
  return { own, other: lookedAt === own ? null : lookedAt };
}

/** At once, and never asks: the drone that the bar names. False if there is none. */
export function holdOwn(lookedAtId: number | null): boolean {
  const user = tower.user.get();
  const { own } = user ? barSubject(tower.vehicles.get(), user, lookedAtId, shell.ownId) : { own: null };
  if (!own) return false;
  void own.sendHold();
  return true;
}
