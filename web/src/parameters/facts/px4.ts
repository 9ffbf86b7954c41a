/** PX4 1.15, the parameters that people change most. The format is that of ../facts.ts; the texts are our own. */

const LOSS_ACTIONS = '0 Nothing, 1 Hold, 2 Return, 3 Land, 5 Terminate, 6 Stop the motors';
const CHANNELS =
  '0 None, 1 Channel 1, 2 Channel 2, 3 Channel 3, 4 Channel 4, 5 Channel 5, 6 Channel 6, 7 Channel 7, 8 Channel 8, 9 Channel 9, 10 Channel 10, 11 Channel 11, 12 Channel 12, 13 Channel 13, 14 Channel 14, 15 Channel 15, 16 Channel 16, 17 Channel 17, 18 Channel 18';

export const PX4 = `
// The whole
MAV_SYS_ID | MAVLink number of the drone |  | 1..250 | 1 | reboot | The system number that it speaks under. Behind the tower every drone may keep 1.
MAV_COMP_ID | MAVLink number of the autopilot |  | 1..250 | 1 | reboot | The component number that it speaks under.
SYS_AUTOSTART | Airframe |  | 0..9999999 | 0 | reboot | Number of the airframe whose settings it starts with.
SYS_HITL | Simulated sensors |  |  | 0 | reboot | Whether it flies a simulation.
  = -1 By another program, 0 No, 1 With motors at rest, 2 On the board itself
SDLOG_MODE | When it logs |  |  | 0 | reboot | From when to when a flight log is written.
  = -1 Never, 0 While armed, 1 From the start until it is disarmed, 2 Always, 3 While a channel says so, 4 From arming on
CBRK_SUPPLY_CHK | Power check is off |  | 0..894281 | 0 | reboot | 894281 lets it arm without looking at its power supply.

// Arming and failsafes
COM_ARM_WO_GPS | Arming without a place |  |  | 1 |  | Whether it may arm when it does not know where it is.
  = 0 Refused, 1 Allowed; with a warning, 2 Allowed
COM_DISARM_LAND | Disarms after landing | s |  | 2 |  | So long after it landed; -1 for never.
COM_DISARM_PRFLT | Disarms without take-off | s |  | 10 |  | So long after arming; -1 for never.
COM_RC_IN_MODE | Who has the sticks |  |  | 3 |  | Radio, ground station, or both. A ground station's sticks need any value but 0 and 4. 5 to 8 are new in 1.17.
  = 0 Radio only, 1 Ground station only, 2 Either; the other one when lost, 3 Either; the first one stays, 4 Nobody, 5 Radio first; then ground station, 6 Ground station first; then radio, 7 Radio first; then the other ground station, 8 The other ground station first; then radio
COM_RC_LOSS_T | Sticks count as lost after | s | 0..35 | 0.5 |  | So long without any new ones.
COM_RC_OVERRIDE | Sticks end a mission |  | 0..3 | 1 |  | Where moving them gives the drone to the pilot.
  & 0 In missions and returns, 1 Offboard
COM_RC_STICK_OV | By so much | % | 5..80 | 30 |  | How far a stick must be moved for that.
COM_RCL_EXCEPT | Without sticks it goes on in |  | 0..7 | 0 |  | Where losing them does nothing.
  & 0 Missions, 1 Hold, 2 Offboard
NAV_RCL_ACT | When sticks are lost |  |  | 2 |  | What it does then.
  = 1 Hold, 2 Return, 3 Land, 5 Terminate, 6 Stop the motors
COM_DL_LOSS_T | Ground station counts as lost after | s | 5..300 | 10 |  | So long without a heartbeat of any ground station.
COM_DLL_EXCEPT | Without ground station it goes on in |  | 0..7 | 0 |  | Where losing it does nothing.
  & 0 Missions, 1 Hold, 2 Offboard
NAV_DLL_ACT | When the ground station is lost |  |  | 0 |  | What it does then.
  = ${LOSS_ACTIONS}
COM_FAIL_ACT_T | Holds before it acts | s | 0..25 | 5 |  | So long it waits in place before any failsafe, for the pilot to step in.
COM_OF_LOSS_T | Offboard counts as lost after | s | 0..60 | 1 |  | So long without a new set-point.
COM_OBL_RC_ACT | When offboard is lost |  |  | 0 |  | What it does then.
  = 0 Position mode, 1 Altitude mode, 2 By hand, 3 Return, 4 Land, 5 Hold, 6 Terminate, 7 Stop the motors
COM_LOW_BAT_ACT | When the battery is low |  |  | 0 |  | What it does at the second and third limit.
  = 0 Warn, 2 Land, 3 Return; land when nearly empty
COM_POSCTL_NAVL | When its place is lost |  |  | 0 |  | What position mode becomes.
  = 0 Altitude mode, 1 Land
COM_HOME_EN | Sets home by itself |  |  | 1 | reboot | At arming, where it stands.
  = 0 No, 1 Yes
GF_ACTION | At the fence |  | 0..5 | 2 |  | What it does when it crosses a border.
  = 0 Nothing, 1 Warn, 2 Hold, 3 Return, 4 Terminate, 5 Land
GF_MAX_HOR_DIST | Fence: radius | m | 0..10000 | 0 |  | Around home; 0 for none.
GF_MAX_VER_DIST | Fence: maximum height | m | 0..10000 | 0 |  | Above home; 0 for none.
BAT_LOW_THR | Low from |  | 0.12..0.5 | 0.15 |  | Share of a full battery.
BAT_CRIT_THR | Nearly empty from |  | 0.05..0.5 | 0.07 |  | Share of a full battery.
BAT_EMERGEN_THR | Empty from |  | 0.03..0.5 | 0.05 |  | Share of a full battery.
BAT#_CAPACITY | Capacity of battery # | mAh | -1..100000 | -1 | reboot | Of a full battery; -1 for not known.
BAT#_N_CELLS | Cells of battery # |  | 0..16 | 0 | reboot | In series.
BAT#_V_EMPTY | Empty cell of battery # | V |  | 3.6 | reboot | Voltage of a cell at which it counts as empty.
BAT#_V_CHARGED | Full cell of battery # | V |  | 4.05 | reboot | Voltage of a cell at which it counts as full.

// Return and missions
RTL_RETURN_ALT | Height of the return | m | 0.. | 60 |  | Height above home at which it flies back.
RTL_DESCEND_ALT | Ends the return at | m | 0.. | 30 |  | Height above home to which it comes down before it lands.
RTL_LAND_DELAY | Waits above home | s | -1.. | 0 |  | Before it lands; -1 to stay.
RTL_TYPE | Returns to |  |  | 0 |  | Where it flies to, and how.
  = 0 Home or a rally point; straight, 1 Rally point or landing of the mission; straight, 2 Along the mission, 3 Whichever is nearest
RTL_CONE_ANG | Cone near home | deg |  | 45 |  | Near home it returns lower, inside this half angle.
  = 0 No cone; always climb, 25 25°, 45 45°, 65 65°, 80 80°, 90 Only climb when below
MIS_TAKEOFF_ALT | Take-off to | m | 0..80 | 2.5 |  | Where nothing else says how high.
NAV_ACC_RAD | Waypoint is reached within | m | 0.05..200 | 10 |  | Sideways.
NAV_MC_ALT_RAD | Height is reached within | m | 0.05..200 | 0.8 |  | Up and down.

// Flying
MPC_XY_CRUISE | Speed of missions | m/s | 3..20 | 5 |  | Over the ground, where the mission says no other.
MPC_XY_VEL_MAX | Maximum speed | m/s | 0..20 | 12 |  | Over the ground, whoever flies.
MPC_VEL_MANUAL | Pilot's maximum speed | m/s | 3..20 | 10 |  | In position mode with the stick at its end.
MPC_Z_V_AUTO_UP | Climbs by itself | m/s | 0.5..8 | 3 |  | In missions and returns.
MPC_Z_V_AUTO_DN | Sinks by itself | m/s | 0.5..4 | 1.5 |  | In missions and returns.
MPC_Z_VEL_MAX_UP | Maximum climb rate | m/s | 0.5..8 | 3 |  | Whoever flies.
MPC_Z_VEL_MAX_DN | Maximum descent rate | m/s | 0.5..4 | 1.5 |  | Whoever flies.
MPC_ACC_HOR | Acceleration by itself | m/s/s | 2..15 | 3 |  | Over the ground.
MPC_ACC_HOR_MAX | Pilot's acceleration | m/s/s | 2..15 | 5 |  | Over the ground, at most.
MPC_ACC_UP_MAX | Acceleration of climbs | m/s/s | 2..15 | 4 |  | At most.
MPC_ACC_DOWN_MAX | Acceleration of sinking | m/s/s | 2..15 | 3 |  | At most.
MPC_LAND_SPEED | Lands with | m/s | 0.6.. | 0.7 |  | In the last metres.
MPC_TKO_SPEED | Takes off with | m/s | 1..5 | 1.5 |  | Upwards.
MPC_MAN_TILT_MAX | Maximum tilt by the pilot | deg | 1..70 | 35 |  | In stabilised and altitude mode.
MPC_TILTMAX_AIR | Maximum tilt | deg | 20..89 | 45 |  | Where it holds its place itself.
MPC_MAN_Y_MAX | Maximum yaw rate by the pilot | deg/s | 0..400 | 150 |  | With the yaw stick at its end.
MPC_HOLD_DZ | Dead zone of the sticks |  | 0..1 | 0.1 |  | Around the middle: there it holds its place.
MPC_THR_HOVER | Throttle that hovers |  | 0.1..0.8 | 0.5 |  | Share of the full output.
MPC_XY_P | Place: P |  | 0..2 | 0.95 |  | How fast a wrong place is turned into a speed.
MPC_Z_P | Height: P |  | 0.1..1.5 | 1 |  | How fast a wrong height is turned into a climb.
MPC_XY_VEL_P_ACC | Speed: P |  | 1.2..5 | 1.8 |  | Answer to a wrong speed.
MPC_XY_VEL_I_ACC | Speed: I |  | 0..60 | 0.4 |  | Answer to a speed that stays wrong.
MPC_XY_VEL_D_ACC | Speed: D |  | 0.1..2 | 0.2 |  | Answer to a speed that changes.
MC_ROLL_P | Roll angle: P |  | 0..12 | 6.5 |  | How fast a wrong angle is turned into a rate.
MC_PITCH_P | Pitch angle: P |  | 0..12 | 6.5 |  | How fast a wrong angle is turned into a rate.
MC_YAW_P | Yaw angle: P |  | 0..5 | 2.8 |  | How fast a wrong heading is turned into a rate.
MC_ROLLRATE_P | Roll rate: P |  | 0.01..0.5 | 0.15 |  | Answer to a wrong rate of roll.
MC_ROLLRATE_I | Roll rate: I |  | 0.. | 0.2 |  | Answer to a rate that stays wrong.
MC_ROLLRATE_D | Roll rate: D |  | 0..0.01 | 0.003 |  | Answer to a rate that changes.
MC_PITCHRATE_P | Pitch rate: P |  | 0.01..0.6 | 0.15 |  | Answer to a wrong rate of pitch.
MC_PITCHRATE_I | Pitch rate: I |  | 0.. | 0.2 |  | Answer to a rate that stays wrong.
MC_PITCHRATE_D | Pitch rate: D |  | 0.. | 0.003 |  | Answer to a rate that changes.
MC_YAWRATE_P | Yaw rate: P |  | 0..0.6 | 0.2 |  | Answer to a wrong rate of yaw.
MC_YAWRATE_I | Yaw rate: I |  | 0.. | 0.1 |  | Answer to a rate that stays wrong.
EKF2_HGT_REF | Height from |  |  | 1 | reboot | What height is measured against.
  = 0 Barometer, 1 GPS, 2 Range finder, 3 Vision
EKF2_GPS_CTRL | GPS is used for |  | 0..15 | 7 |  | By the estimator.
  & 0 Place, 1 Height, 2 Speed, 3 Heading of two antennas

// Radio
RC#_MIN | Channel #: lowest | us | 800..1500 | 1000 |  | Pulse of the stick at one end.
RC#_MAX | Channel #: highest | us | 1500..2200 | 2000 |  | Pulse of the stick at the other end.
RC#_TRIM | Channel #: middle | us | 800..2200 | 1500 |  | Pulse of the stick let go.
RC#_DZ | Channel #: dead zone | us | 0..500 | 10 |  | Around the middle.
RC#_REV | Channel # is turned round |  |  | 1 |  | Whether one end counts as the other.
  = -1 Yes, 1 No
RC_MAP_ROLL | Channel of roll |  | 0..18 | 0 |  | On the radio.
  = ${CHANNELS}
RC_MAP_PITCH | Channel of pitch |  | 0..18 | 0 |  | On the radio.
  = ${CHANNELS}
RC_MAP_THROTTLE | Channel of throttle |  | 0..18 | 0 |  | On the radio.
  = ${CHANNELS}
RC_MAP_YAW | Channel of yaw |  | 0..18 | 0 |  | On the radio.
  = ${CHANNELS}
RC_MAP_FLTMODE | Channel of the mode switch |  | 0..18 | 0 |  | On the radio.
  = ${CHANNELS}
`;
