/** One drone's telemetry as numbers and words for people; null where the drone has not reported a value. */

import { t } from '../languages/text';
import type { BatteryTime } from './battery_time';
import { estimatorHealth, type EstimatorHealth } from './estimator_health';
import type { LastHeardView, LinkQuality } from './wire_types';
import { EKF_STATUS_FLAGS, GPS_FIX_TYPE, MAV_LANDED_STATE, MAV_MODE_FLAG, MAV_STATE } from './generated/mavlink.gen';
import { distanceM } from './geometry';
import type { Place, Target } from './messages';
import { type FlightTask, flightTask, modeName } from './modes';
import type { Telemetry } from './telemetry';

const HEARTBEAT_LIMIT_MS = 5_000;
/** A heartbeat older than this proves nothing about the motors; then the agent's report to the tower counts. */
const ARMED_LIMIT_MS = 3_000;
const AIRBORNE_ABOVE_M = 1.5;
const UNKNOWN_U16 = 0xffff;
/** In a reduced stream VFR_HUD is rarer than the position; then the fresher one counts. */
const HUD_MAY_LAG_MS = 1_000;

/** In order of the attention it needs. */
export type DroneState = 'alert' | 'flying' | 'armed' | 'idle' | 'lost';

export interface FlightValues {
  readonly state: DroneState;
  readonly heartbeatAgeMs: number | null;
  readonly autopilot: number | null;
  /** MAV_TYPE. */
  readonly vehicleType: number | null;
  readonly customMode: number | null;
  readonly mode: string | null;
  /** What a vehicle of its type does in that mode; null: unknown. */
  readonly task: FlightTask | null;
  /** Null: unknown, because the autopilot never sent a heartbeat, or none for some seconds. */
  readonly armed: boolean | null;
  readonly airborne: boolean | null;
  readonly landed: string | null;
  readonly place: Place | null;
  readonly headingDeg: number | null;
  readonly altRelM: number | null;
  readonly altAmslM: number | null;
  readonly groundSpeedMps: number | null;
  readonly climbMps: number | null;
  readonly throttlePercent: number | null;
  readonly batteryPercent: number | null;
  readonly batteryV: number | null;
  readonly batteryA: number | null;
  readonly batteryTime: BatteryTime | null;
  /** MAV_BATTERY_CHARGE_STATE, the worst of its batteries; null: not reported. */
  readonly batteryCharge: number | null;
  /** The direction the wind comes from, and its speed, as the autopilot estimates. */
  readonly wind: { readonly fromDeg: number; readonly mps: number } | null;
  readonly estimator: EstimatorHealth | null;
  readonly gpsFix: string | null;
  /** Of several GPS, the number of the worst one, whose values these are; null: there is one. */
  readonly gpsNumber: number | null;
  readonly satellites: number | null;
  readonly rollDeg: number | null;
  readonly pitchDeg: number | null;
  readonly home: Place | null;
  readonly homeDistanceM: number | null;
  readonly targetDistanceM: number | null;
  readonly airborneMs: number | null;
  readonly linkRttMs: number | null;
  readonly linkLossPercent: number | null;
  /** Whether the estimator reports that it knows attitude and height; null if it reports nothing. */
  readonly ekfIsHealthy: boolean | null;
  /** Age of the newest of these values. */
  readonly positionAgeMs: number | null;
  readonly batteryAgeMs: number | null;
}

/** What is known about the drone besides its telemetry. */
export interface Beside {
  readonly online: boolean;
  /** As the tower reports. */
  readonly armed: boolean | null;
  readonly target: Target | null;
  readonly link: LinkQuality | null;
  readonly airborneSinceMs: number | null;
  readonly batteryTime: BatteryTime | null;
  readonly batteryCharge?: number | null;
  /** From the tower, if the drone fell silent before this page could hear it. */
  readonly lastHeard?: HeardByTower | null;
}

/** What the autopilot did when the tower heard it last. `atMs`: by our clock. */
export interface HeardByTower {
  readonly view: LastHeardView;
  readonly atMs: number;
}

const GPS_WORDS: Record<number, string> = {
  [GPS_FIX_TYPE.NO_GPS]: t('none'),
  [GPS_FIX_TYPE.NO_FIX]: t('no fix'),
  [GPS_FIX_TYPE._2D_FIX]: '2D',
  [GPS_FIX_TYPE._3D_FIX]: '3D',
  [GPS_FIX_TYPE.DGPS]: t('DGPS'),
  [GPS_FIX_TYPE.RTK_FLOAT]: t('RTK float'),
  [GPS_FIX_TYPE.RTK_FIXED]: 'RTK',
};

const LANDED_WORDS: Record<number, string> = {
  [MAV_LANDED_STATE.ON_GROUND]: t('on ground'),
  [MAV_LANDED_STATE.IN_AIR]: t('in air'),
  [MAV_LANDED_STATE.TAKEOFF]: t('taking off'),
  [MAV_LANDED_STATE.LANDING]: t('landing'),
};

const degrees = (radians: number): number => (radians * 180) / Math.PI;
const place = (latE7: number, lonE7: number): Place | null =>
  latE7 === 0 && lonE7 === 0 ? null : { latDeg: latE7 / 1e7, lonDeg: lonE7 / 1e7 };

interface Gps {
  readonly fixType: number;
  readonly satellites: number | null;
  readonly number: number | null;
}

/** A GPS that is silent for so long while the other one reports is no longer there. */
const GPS_GONE_MS = 60_000;

function worstGps(telemetry: Telemetry): Gps | null {
  const heard = [telemetry.newest('GPS_RAW_INT'), telemetry.newest('GPS2_RAW')];
  const newestMs = Math.max(...heard.map((one) => one?.atMs ?? 0));
  const units = heard.flatMap((one, index) => {
    if (!one || newestMs - one.atMs > GPS_GONE_MS) return [];
    const { fix_type: fixType, satellites_visible: count } = one.fields;
    return [{ fixType, satellites: count === 255 ? null : count, number: index + 1 }];
  });
  const [worst] = units.sort((a, b) => a.fixType - b.fixType || (a.satellites ?? -1) - (b.satellites ?? -1));
  return worst ? { ...worst, number: units.length > 1 ? worst.number : null } : null;
}

export function flightValues(telemetry: Telemetry, beside: Beside, nowMs: number): FlightValues {
  const heartbeat = telemetry.newest('HEARTBEAT');
  const positionCame = telemetry.newest('GLOBAL_POSITION_INT');
  const position = positionCame?.fields;
  const hudCame = telemetry.newest('VFR_HUD');
  const hud = hudCame?.fields;
  const motion = hudCame && positionCame && positionCame.atMs - hudCame.atMs > HUD_MAY_LAG_MS ? undefined : hud;
  const gps = worstGps(telemetry);
  const attitude = telemetry.newest('ATTITUDE')?.fields;
  const systemHeard = telemetry.newest('SYS_STATUS');
  const system = systemHeard?.fields;
  const estimator = telemetry.newest('EKF_STATUS_REPORT')?.fields;
  const wind = telemetry.newest('WIND')?.fields;
  const homeAt = telemetry.newest('HOME_POSITION')?.fields;
  const landedState = telemetry.newest('EXTENDED_SYS_STATE')?.fields.landed_state ?? MAV_LANDED_STATE.UNDEFINED;

  const last = beside.lastHeard ?? null;
  const lastAgeMs = last ? nowMs - last.atMs : null;
  const lastPlace = last && last.view.lat !== null && last.view.lon !== null ? last.view : null;
  const autopilot = last?.view.autopilot ?? heartbeat?.fields.autopilot ?? null;
  const customMode = last?.view.custom_mode ?? heartbeat?.fields.custom_mode ?? null;
  const vehicleType = last?.view.vehicle_type ?? heartbeat?.fields.type ?? null;

  const heartbeatAgeMs = lastAgeMs ?? (heartbeat ? nowMs - heartbeat.atMs : null);
  const isHeard = beside.online && heartbeatAgeMs !== null && heartbeatAgeMs <= HEARTBEAT_LIMIT_MS;
  const armedHeard = heartbeat ? (heartbeat.fields.base_mode & MAV_MODE_FLAG.SAFETY_ARMED) !== 0 : null;
  const armed = !isHeard ? null : heartbeatAgeMs <= ARMED_LIMIT_MS ? armedHeard : beside.armed;
  const altRelM = lastPlace ? lastPlace.height_m : position ? position.relative_alt / 1000 : null;
  const airborne =
    armed &&
    (landedState === MAV_LANDED_STATE.UNDEFINED
      ? (altRelM ?? 0) > AIRBORNE_ABOVE_M
      : landedState !== MAV_LANDED_STATE.ON_GROUND);
  const here = lastPlace
    ? { latDeg: lastPlace.lat!, lonDeg: lastPlace.lon! }
    : position
      ? place(position.lat, position.lon)
      : null;
  const home = homeAt ? place(homeAt.latitude, homeAt.longitude) : null;

  return {
    state: stateOf(heartbeat?.fields.system_status ?? 0, armed, airborne),
    heartbeatAgeMs,
    autopilot,
    vehicleType,
    customMode,
    mode: autopilot === null || customMode === null ? null : modeName(autopilot, customMode, vehicleType),
    task: flightTask(autopilot, customMode, vehicleType),
    armed,
    airborne,
    landed: LANDED_WORDS[landedState] ?? null,
    place: here,
    headingDeg: position && position.hdg !== UNKNOWN_U16 ? position.hdg / 100 : (hud?.heading ?? null),
    altRelM,
    altAmslM: position ? position.alt / 1000 : null,
    groundSpeedMps: motion ? motion.groundspeed : position ? Math.hypot(position.vx, position.vy) / 100 : null,
    climbMps: motion ? motion.climb : position ? -position.vz / 100 : null,
    throttlePercent: hud?.throttle ?? null,
    batteryPercent: system && system.battery_remaining >= 0 ? system.battery_remaining : null,
    batteryV: system && system.voltage_battery !== UNKNOWN_U16 ? system.voltage_battery / 1000 : null,
    batteryA: system && system.current_battery >= 0 ? system.current_battery / 100 : null,
    batteryTime: beside.batteryTime,
    batteryCharge: beside.batteryCharge ?? null,
    wind: wind ? { fromDeg: (wind.direction + 360) % 360, mps: wind.speed } : null,
    estimator: estimatorHealth(telemetry.newest('EKF_STATUS_REPORT')?.fields, system),
    gpsFix: gps ? (GPS_WORDS[gps.fixType] ?? 'other') : null,
    gpsNumber: gps?.number ?? null,
    satellites: gps?.satellites ?? null,
    rollDeg: attitude ? degrees(attitude.roll) : null,
    pitchDeg: attitude ? degrees(attitude.pitch) : null,
    home,
    homeDistanceM: here && home ? distanceM(here, home) : null,
    targetDistanceM: here && beside.target ? distanceM(here, beside.target) : null,
    airborneMs: beside.airborneSinceMs === null ? null : nowMs - beside.airborneSinceMs,
    linkRttMs: beside.online ? (beside.link?.rtt_ms ?? null) : null,
    linkLossPercent: beside.online && beside.link ? beside.link.loss * 100 : null,
    ekfIsHealthy: estimator ? isHealthy(estimator) : null,
    positionAgeMs: lastPlace ? lastAgeMs : positionCame ? nowMs - positionCame.atMs : null,
    batteryAgeMs: systemHeard ? nowMs - systemHeard.atMs : null,
  };
}

/** ArduPilot's own limit for "EKF variance"; above it the failsafe is near. */
const EKF_VARIANCE_LIMIT = 0.8;
const EKF_NEEDED = EKF_STATUS_FLAGS.EKF_ATTITUDE | EKF_STATUS_FLAGS.EKF_VELOCITY_VERT;

function isHealthy(report: {
  flags: number;
  velocity_variance: number;
  pos_horiz_variance: number;
  pos_vert_variance: number;
  compass_variance: number;
}): boolean {
  const worst = Math.max(
    report.velocity_variance,
    report.pos_horiz_variance,
    report.pos_vert_variance,
    report.compass_variance,
  );
  return worst < EKF_VARIANCE_LIMIT && (report.flags & EKF_NEEDED) === EKF_NEEDED;
}

function stateOf(systemStatus: number, armed: boolean | null, airborne: boolean | null): DroneState {
  if (armed === null) return 'lost';
  if (systemStatus === MAV_STATE.CRITICAL || systemStatus === MAV_STATE.EMERGENCY) return 'alert';
  if (airborne) return 'flying';
  return armed ? 'armed' : 'idle';
}
