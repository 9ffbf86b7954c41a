/**
 * How a battery stands, by the autopilot's own thresholds (BATTERY_STATUS.charge_state). Percentages of ours count only
 * for an autopilot that reports none, and as a last warning before a battery is empty. Pure.
 */

export type BatteryLevel = 'low' | 'critical';

export const BATTERY_LOW_PERCENT = 30;
export const BATTERY_CRITICAL_PERCENT = 15;

/** MAV_BATTERY_CHARGE_STATE. */
const OK = 1;
const LOW = 2;
const CRITICAL = 3;
const UNHEALTHY = 6;

export interface BatterySaid {
  readonly batteryPercent: number | null;
  /** The worst charge state of its batteries; null or 0: not reported. */
  readonly batteryCharge: number | null;
}

/** Null: neither low nor critical, as far as is known. */
export function batteryLevel({ batteryPercent: percent, batteryCharge: charge }: BatterySaid): BatteryLevel | null {
  if (charge === LOW) return 'low';
  if (charge !== null && charge >= CRITICAL && charge <= UNHEALTHY) return 'critical';
  if (percent === null) return null;
  // A threshold that nobody set never warns: a battery near its end is low whatever the autopilot says.
  if (charge === OK) return percent <= BATTERY_CRITICAL_PERCENT ? 'low' : null;
  if (percent <= BATTERY_CRITICAL_PERCENT) return 'critical';
  return percent <= BATTERY_LOW_PERCENT ? 'low' : null;
}
