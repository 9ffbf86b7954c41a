/** Whether the autopilot knows its position and attitude: from EKF_STATUS_REPORT, or else from SYS_STATUS. */

import { t } from '../languages/text';
import { EKF_STATUS_FLAGS, MAV_SYS_STATUS_SENSOR, type MessageFields } from './generated/mavlink.gen';

export type EstimatorTone = 'good' | 'warning' | 'danger';

export interface EstimatorHealth {
  readonly tone: EstimatorTone;
  /** One or two words. */
  readonly text: string;
}

/** Ratios to the filter's limits; the autopilot's own failsafe acts from 0.8. */
const DOUBTFUL = 0.5;
const BAD = 0.8;

export function estimatorHealth(
  report: MessageFields['EKF_STATUS_REPORT'] | undefined,
  system: MessageFields['SYS_STATUS'] | undefined,
): EstimatorHealth | null {
  if (report) return fromReport(report);
  const bit = MAV_SYS_STATUS_SENSOR.MAV_SYS_STATUS_AHRS;
  if (!system || (system.onboard_control_sensors_enabled & bit) === 0) return null;
  const isWell = (system.onboard_control_sensors_health & bit) !== 0;
  return isWell ? { tone: 'good', text: t('good') } : { tone: 'danger', text: t('not healthy') };
}

function fromReport(report: MessageFields['EKF_STATUS_REPORT']): EstimatorHealth {
  const has = (flag: number): boolean => (report.flags & flag) !== 0;
  if (!has(EKF_STATUS_FLAGS.EKF_ATTITUDE)) return { tone: 'danger', text: t('no attitude') };
  const parts = {
    speed: report.velocity_variance,
    position: report.pos_horiz_variance,
    height: report.pos_vert_variance,
    compass: report.compass_variance,
  };
  const [worst, share] = Object.entries(parts).reduce((one, other) => (other[1] > one[1] ? other : one));
  if (share >= BAD) return { tone: 'danger', text: t('bad {worst}', { worst }) };
  if (!has(EKF_STATUS_FLAGS.EKF_POS_HORIZ_ABS) || has(EKF_STATUS_FLAGS.EKF_CONST_POS_MODE)) {
    return { tone: 'warning', text: t('no position') };
  }
  if (share >= DOUBTFUL) return { tone: 'warning', text: t('doubtful {worst}', { worst }) };
  return { tone: 'good', text: t('good') };
}
