/** What the tower sent, with its texts in the chosen language (languages/tower_text.ts). Values stay as they are. */

import { forReaders, inTowerWords } from '../languages/tower_text';
import type { Operation } from './operation_types';
import type { Preflight } from './preflight';
import type { Schemas } from './rest_types';
import type { LossCheck } from './safety_types';
import type { Drone, TowerEvent } from './wire_types';

type AlertView = Schemas['AlertView'];

export const alertInWords = (alert: AlertView): AlertView =>
  inTowerWords(alert, 'badge', 'words', 'advice', 'closed_why');

export const operationInWords = forReaders((operation: Operation): Operation => ({
  ...inTowerWords(operation, 'phase', 'words'),
  refusals: operation.refusals?.map((one) => inTowerWords(one, 'words')),
}));

export const droneInWords = forReaders((drone: Drone): Drone => ({
  ...inTowerWords(drone, 'profile_why'),
  restraint: drone.restraint && inTowerWords(drone.restraint, 'reason'),
  hold: drone.hold && inTowerWords(drone.hold, 'waiting_for', 'detail', 'nobody_because'),
}));

export const restraintsInWords = (found: Schemas['RestraintsView']): Schemas['RestraintsView'] => ({
  ...found,
  measures: found.measures.map((one) => inTowerWords(one, 'effect')),
});

export const lossCheckInWords = forReaders((check: LossCheck): LossCheck => ({
  ...check,
  sentences: check.sentences.map((one) => inTowerWords(one, 'text')),
}));

export const preflightInWords = forReaders((preflight: Preflight): Preflight => ({
  ...preflight,
  lines: preflight.lines.map((line) => inTowerWords(line, 'title', 'words')),
}));

/** Drones and operations are translated where they are kept: they come by REST as well. */
export function eventInWords(event: TowerEvent): TowerEvent {
  switch (event.type) {
    case 'welcome':
      return { ...event, alerts: event.alerts?.map(alertInWords) ?? [] };
    case 'alert':
      return { ...event, alert: alertInWords(event.alert) };
    case 'control':
      return inTowerWords(event, 'reason');
    case 'hold':
      return inTowerWords(event, 'detail');
    case 'notice':
    case 'rehearsal':
      return inTowerWords(event, 'text');
    default:
      return event;
  }
}
