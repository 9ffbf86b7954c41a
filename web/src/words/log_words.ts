/** Why an autopilot cannot be asked for its flight logs now, by anybody. Pure. */

interface LogSituation {
  readonly name: string;
  readonly online: boolean;
  readonly isConnected: boolean;
  /** Null: unknown. */
  readonly isAirborne: boolean | null;
  readonly isBusy: boolean;
}

/** Empty if it can be asked. */
export function whyNoLogs({ name, online, isConnected, isAirborne, isBusy }: LogSituation): string {
  if (!isConnected) return 'No connection to the tower.';
  if (!online) return `${name} is offline.`;
  if (isAirborne) return `${name} is in the air: its logs are read on the ground.`;
  return isBusy ? `${name} is sending logs: it does one thing at a time.` : '';
}
