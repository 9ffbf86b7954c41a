/** Flying without a radio receiver: the required parameters, and why they cannot be set now. */

import { t } from '../languages/text';
import { mayCommand } from '../link/drone_view';
import type { ReceiverSetupRow } from '../link/safety_types';
import type { Drone, User } from '../link/wire_types';
import { UNKNOWN } from './format';

/** Parameters are float32: 0.1 comes back as 0.10000000149. */
const figure = (value: number): string => String(Number(value.toPrecision(6)));

/** "0 → 1", or that the value is right already. */
export function rowWords({ now, wanted, ok }: ReceiverSetupRow): string {
  if (ok) return t('{figure}, stays', { figure: figure(now ?? wanted) });
  return `${now === null ? UNKNOWN : figure(now)} → ${figure(wanted)}`;
}

export interface SetupSituation {
  readonly drone: Drone;
  readonly user: Pick<User, 'id'>;
  readonly armed: boolean | null;
  readonly isConnected: boolean;
  /** All of the parameters were read. */
  readonly isKnown: boolean;
}

/** Why the parameters cannot be written now; empty if they can. */
export function setupBlockedWords({ drone, user, armed, isConnected, isKnown }: SetupSituation): string {
  if (!isConnected) return t('The connection to the tower is down.');
  if (!drone.online) return t('{drone} is offline.', { drone: drone.name });
  if (!mayCommand(drone, user)) return t('Take control of {drone} first.', { drone: drone.name });
  if (!isKnown) return t('Not every one of them was read yet: {drone} is asked again.', { drone: drone.name });
  if (armed === null) return t('Whether {drone} is armed is not known.', { drone: drone.name });
  return armed ? t('{drone} is armed. Disarm it first.', { drone: drone.name }) : '';
}
