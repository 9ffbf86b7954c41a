/** ArduCopter 4.5 to 4.7: loops, motors and flight modes. The format is that of ../facts.ts; the texts are our own. */

interface Loop {
  readonly prefix: string;
  readonly of: string;
}

/** What every loop has beside P, I and D; omits those that a line above describes. */
const REST: readonly (readonly [string, string, string])[] = [
  ['D_FF', 'feed forward of change', 'Adds output while the target changes.'],
  ['FF', 'feed forward', 'Output for the target itself, before there is an error.'],
  ['FLTD', 'filter of D', 'Above this frequency the D part is damped.'],
  ['FLTE', 'filter of the error', 'Above this frequency the error is damped; 0 for none.'],
  ['FLTT', 'filter of the target', 'Above this frequency the target is damped; 0 for none.'],
  ['IMAX', 'limit of I', 'As much as the I part may give.'],
  ['NEF', 'notch for the error', 'Number of the FILT filter that the error goes through; 0 for none.'],
  ['NTF', 'notch for the target', 'Number of the FILT filter that the target goes through; 0 for none.'],
  ['PDMX', 'limit of P and D', 'As much as P and D may give together; 0 for no limit.'],
  ['SMAX', 'slew limit', 'P and D are lowered while the output swings faster than this; 0 for never.'],
];

const rest = ({ prefix, of }: Loop, but: readonly string[] = []): string =>
  REST.filter(([suffix]) => !but.includes(suffix))
    .map(([suffix, title, text]) => `${prefix}_${suffix} | ${of}: ${title} | ${text}`)
    .join('\n');
const gains = ({ prefix, of }: Loop, suffixes: readonly string[]): string =>
  suffixes
    .map((suffix) => {
      const text = {
        P: 'Output for the error now.',
        I: 'Output for an error that stays.',
        D: 'Damps: output for an error that changes.',
      };
      return `${prefix}_${suffix} | ${of}: ${suffix} | ${text[suffix as 'P' | 'I' | 'D']}`;
    })
    .join('\n');

const RATE_LOOPS: readonly Loop[] = [
  { prefix: 'ATC_RAT_RLL', of: 'Roll rate' },
  { prefix: 'ATC_RAT_PIT', of: 'Pitch rate' },
  { prefix: 'ATC_RAT_YAW', of: 'Yaw rate' },
];
const CLIMB: Loop = { prefix: 'PSC_ACCZ', of: 'Vertical acceleration' };
const CLIMB_RATE: Loop = { prefix: 'PSC_VELZ', of: 'Climb rate' };
const SPEED: Loop = { prefix: 'PSC_VELXY', of: 'Speed over ground' };
/** Names in 4.7. */
const NEW_LOOPS: readonly Loop[] = [
  { prefix: 'PSC_D_ACC', of: 'Vertical acceleration' },
  { prefix: 'PSC_D_VEL', of: 'Climb rate' },
  { prefix: 'PSC_NE_VEL', of: 'Speed over ground' },
];

export const ARDUCOPTER_CONTROL = `
// Attitude and rates
${RATE_LOOPS.map((loop) => rest(loop)).join('\n')}
ATC_RATE_FF_ENAB | Feed forward of rates | Whether turning rates that are wanted go to the motors at once, before there is an error.
ATC_ANGLE_BOOST | Throttle while leaning | Whether the throttle rises as the drone leans, to keep its height.
ATC_ANG_LIM_TC | Lean limit for height: time | Time in which leaning is given up where the motors cannot keep the height as well.
ATC_RATE_R_MAX | Fastest roll | Rate of roll that is never exceeded; 0 for no limit.
ATC_RATE_P_MAX | Fastest pitch | Rate of pitch that is never exceeded; 0 for no limit.
ATC_RATE_Y_MAX | Fastest yaw | Rate of yaw that is never exceeded; 0 for no limit.
ATC_RATE_WPY_MAX | Fastest yaw in missions | Rate of yaw that missions keep to.
ATC_ANGLE_MAX | Maximum lean | The drone never leans further than this.
ATC_LAND_R_MULT | Roll gain on the ground | Part of the roll gain that is left while landed, against a resonance of the legs.
ATC_LAND_P_MULT | Pitch gain on the ground | Part of the pitch gain that is left while landed, against a resonance of the legs.
ATC_LAND_Y_MULT | Yaw gain on the ground | Part of the yaw gain that is left while landed, against a resonance of the legs.
ATC_THR_MIX_MIN | Attitude before thrust, landing | How far attitude goes before thrust while landing.
ATC_THR_MIX_MAX | Attitude before thrust, flying | How far attitude goes before thrust in flight.
ATC_THR_G_BOOST | Gains at fast throttle | Raises the gains for roll and pitch while the throttle moves fast; 0 for not at all.

// Place and height
${rest(CLIMB)}
${rest(CLIMB_RATE, ['D_FF', 'FLTT', 'NEF', 'NTF', 'PDMX', 'SMAX'])}
${gains(CLIMB, ['D'])}
${gains(CLIMB_RATE, ['I', 'D'])}
${rest(SPEED, ['D_FF', 'FLTT', 'NEF', 'NTF', 'PDMX', 'SMAX'])}
${NEW_LOOPS.map((loop) => `${gains(loop, ['P', 'I', 'D'])}\n${rest(loop)}`).join('\n')}
PSC_D_POS_P | Height: P | Climb rate for a metre of error in height.
PSC_NE_POS_P | Place: P | Speed for a metre of error in place.
PSC_ANGLE_MAX | Lean of the autopilot | Maximum lean that flight by itself asks for; 0 for the pilot's own limit.
PSC_JERK_XY | Jerk over ground | How fast acceleration over ground may change.
PSC_JERK_Z | Jerk up and down | How fast acceleration up and down may change.
PILOT_THR_FILT | Filter of the throttle stick | Above this frequency the stick is damped where height is flown by hand; 0 for none.
PILOT_Y_RATE_TC | Yaw stick: softness | Time in which the yaw rate follows the stick.

// Acro
ACRO_BAL_ROLL | Roll comes back level | How fast roll levels by itself, with a trainer.
ACRO_BAL_PITCH | Pitch comes back level | How fast pitch levels by itself, with a trainer.
ACRO_TRAINER | Trainer | How far acro helps: levelling, and a limit of the lean.
ACRO_OPTIONS | Acro options | Changes to the usual behaviour.
ACRO_THR_MID | Throttle in the middle | Output at mid stick in acro; 0 for the throttle that hovers.
ACRO_RP_RATE | Fastest roll and pitch | Rate at full stick.
ACRO_RP_EXPO | Roll and pitch: curve | The higher, the gentler near the middle of the stick.
ACRO_RP_RATE_TC | Roll and pitch: softness | Time in which the rate follows the stick.
ACRO_Y_RATE | Fastest yaw | Rate at full stick.
ACRO_Y_EXPO | Yaw: curve | The higher, the gentler near the middle of the stick.
ACRO_Y_RATE_TC | Yaw: softness | Time in which the rate follows the stick.

// Motors
MOT_BAT_CURR_MAX | Most current | The throttle is limited above this current; 0 for no limit.
MOT_BAT_CURR_TC | Most current: time | Time over which the current is averaged for that limit.
MOT_BAT_IDX | Battery of the motors | Which battery's voltage the thrust is corrected by.
MOT_BOOST_SCALE | Booster motor | Output of a booster motor as a part of the throttle; 0 for none.
MOT_OPTIONS | Motor mixer options | Changes to the usual behaviour.
MOT_SLEW_UP_TIME | Fastest rise of output | Minimum time from none to full; 0 for no limit.
MOT_SLEW_DN_TIME | Fastest fall of output | Minimum time from full to none; 0 for no limit.
MOT_SAFE_TIME | Wait after arming | Time for ESCs to come up where they had no signal before.
MOT_SPOOL_TIM_DN | Spinning down | Time from idle to a stop; 0 for the time of spinning up.
ESC_CALIBRATION | Calibration of the ESCs | What the ESCs are taught at the next start; it is set by the calibration itself.
KDE_NPOLE | KDE motors: poles | Poles of the motors, to make turns of what the ESCs tell.
ESC_TLM_MAV_OFS | ESC numbers over MAVLink | What is taken off an ESC's number before it is told.
GND_EFFECT_COMP | Ground effect | Whether the pressure near the ground is allowed for at take-off and landing.
DEV_OPTIONS | For developers | Behaviour that is still being tried out.
SCHED_DEBUG | Messages of the scheduler | How much it says about tasks that take too long.
SCHED_OPTIONS | Scheduler options | Whether the time that each task takes is recorded.
FSTRATE_ENABLE | Fast rate loop | Whether rates are controlled in a thread of their own, as often as the gyro tells.
FSTRATE_DIV | Fast rate loop: divisor | The gyro's rate divided by this is the loop's.

// Take-off and landing
TKOFF_SLEW_TIME | Throttle rises in | Time in which the throttle rises at take-off.
TKOFF_RPM_MIN | Slowest motors at take-off | No take-off before all motors turn this fast; 0 for no check.
TKOFF_RPM_MAX | Fastest motors at take-off | No take-off while a motor turns faster; 0 for no check.
TKOFF_THR_MAX | Throttle at take-off | Above this it counts as flying.
TKOFF_GNDEFF_ALT | Ground effect up to | Height up to which the ground effect is allowed for.
WP_NAVALT_MIN | Level until | Height up to which take-off and landing in a mission keep level; 0 for none.
PLDP_THRESH | Placing a load: touches down | Part of the thrust below which the load counts as standing.
PLDP_RNG_MAX | Placing a load: height | Maximum height by the range finder at which it may count as standing; 0 for no check.
PLDP_DELAY | Placing a load: waits | Time from letting go to the climb.
PLDP_SPEED_DN | Placing a load: sinks | Speed down; 0 for the landing speed.

// Modes
TUNE | Tuned by a knob | Which gain a knob of the radio moves in flight.
TUNE_MIN | Knob: lowest | Value at the lower end of the knob.
TUNE_MAX | Knob: highest | Value at the upper end of the knob.
TUNE#_PARAM | Tuned by knob # | Which gain knob # moves in flight.
AUTOTUNE_MIN_D | Lowest D | Autotune goes no lower.
AUTOTUNE_GMBK | Autotune: back off | Part by which the gains that were found are lowered.
FHLD_XY_P | Flow hold: P | Lean for the flow that is seen.
FHLD_XY_I | Flow hold: I | Lean for a flow that stays.
FHLD_XY_IMAX | Flow hold: limit of I | As much as the I part may lean.
FHLD_XY_FILT_HZ | Flow hold: filter | Above this frequency the input of the loop is damped.
FHLD_FLOW_MAX | Flow hold: most flow | Faster flow counts as this.
FHLD_FILT_HZ | Flow hold: filter of the flow | Above this frequency the sensor's flow is damped.
FHLD_QUAL_MIN | Flow hold: quality | Flow of a lower quality is not used.
FHLD_BRAKE_RATE | Flow hold: braking | How hard it brakes when the stick is let go.
FOLL_ENABLE | Follow | Whether the drone can follow another one by itself; its other parameters appear then.
SID_AXIS | System identification | Which input is shaken to measure the drone; its other parameters appear then.
ZIGZ_AUTO_ENABLE | Zigzag by itself | Whether zigzag flies its lines by itself.
SRTL_OPTIONS | SmartRTL options | Changes to the usual behaviour.
SURFTRAK_MODE | Follows a surface | Whether height is held above the ground, or below a ceiling, by the range finder.
SURFTRAK_TC | Surface: softness | Time in which the height follows the surface.
WVANE_ENABLE | Nose into the wind | Whether the drone turns into the wind by itself; its other parameters appear then.
THROW_MOT_START | Throw: motors before | Whether the motors turn before the throw.
THROW_ALT_MIN | Throw: lowest | A throw counts above this height; 0 for any.
THROW_ALT_MAX | Throw: highest | A throw counts below this height; 0 for any.
THROW_ALT_DCSND | Throw: sinks by | How far it sinks after it was dropped.
THROW_ALT_ACSND | Throw: climbs by | How far it climbs after it was thrown.
THROW_NEXTMODE | Throw: mode afterwards | Mode once it flies by itself.
THROW_TYPE | Throw or drop | Whether it is thrown up or dropped.
FLTMODE_GCSBLOCK | Modes kept from ground stations | Modes that a ground station may not choose.
CC_TYPE | Controller of one's own | Which controller flies in place of the usual one.
FS_EKF_FILT | Estimator failsafe: filter | Above this frequency the estimator's doubts are damped before they count.
FENCE_OPTIONS | Fence options | Changes to the usual behaviour.
FENCE_TOTAL | Points of the fence | How many are on board; the autopilot counts them itself.
FENCE_NTF_FREQ | Fence: how often it warns | Messages a second while the drone is near the fence.
RALLY_TOTAL | Rally points | How many are on board; the autopilot counts them itself.
MIS_TOTAL | Mission items | How many are on board; the autopilot counts them itself.
MIS_OPTIONS | Mission options | Changes to the usual behaviour.

// Obstacles
AVOID_ANGLE_MAX | Lean away from obstacles | Maximum lean to avoid something in modes without a place.
AVOID_DIST_MAX | Avoids from | Distance at which modes without a place begin to avoid.
AVOID_BEHAVE | At an obstacle | Whether the drone stops or slides along.
AVOID_BACKUP_SPD | Backs off over ground | Speed away from what is too near; 0 for not at all.
AVOID_BACKZ_SPD | Backs off in height | Speed up or down away from what is too near; 0 for not at all.
AVOID_BACKUP_DZ | Backs off behind | How much nearer than the margin before it backs off.
AVOID_ALT_MIN | Avoids above | Height below which sensors around do not count.
AVOID_ACCEL_MAX | Avoids as hard as | Maximum acceleration to avoid something; 0 for no limit.
AVD_ENABLE | Avoids aircraft | Whether the drone avoids aircraft that it hears by ADS-B; its other parameters appear then.
OA_TYPE | Way around obstacles | How a way around is looked for.
`;
