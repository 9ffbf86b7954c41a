/** Whether a drone's autopilot and agent sign what they send each other. */

import { t } from '../languages/text';
import type { Drone } from '../link/wire_types';

export function signingWords({ signing, name }: Pick<Drone, 'signing' | 'name'>): string {
  if (signing === 'on') return t('Autopilot and agent of {name} sign.', { name });
  if (signing === 'wrong_key')
    return t(
      'The autopilot of {name} does not sign with the key of its agent, which takes nothing from it. Was it changed or erased? Remove the key, then set up signing again.',
      { name },
    );
  if (signing === 'no_key')
    return t(
      'The autopilot of {name} signs, and its agent has no key: it takes nothing from the agent. Give the agent the key ("tower-agent signing --take"), or erase it at the autopilot over USB.',
      { name },
    );
  return t('{name} does not sign.', { name });
}
