/** ArduCopter 4.6, the parameters that people change most. The format is that of ../facts.ts; the texts are our own. */

const MODES =
  '0 Stabilize, 1 Acro, 2 Altitude hold, 3 Auto, 4 Guided, 5 Loiter, 6 Return, 7 Circle, 9 Land, 11 Drift, 13 Sport, 14 Flip, 15 Autotune, 16 Position hold, 17 Brake, 18 Throw, 19 Avoid ADS-B, 20 Guided without GPS, 21 Return the way it came, 22 Flow hold, 23 Follow, 24 Zigzag, 25 System identification, 26 Helicopter autorotation, 27 Auto return';
const FAILSAFE_ACTIONS =
  '0 Nothing, 1 Land, 2 Return; else land, 3 Return the way it came; else return, 4 Return the way it came; else land, 5 Stop the motors, 6 Auto from its landing start; else return, 7 Brake; else land';
const PROTOCOLS =
  '-1 None, 1 MAVLink 1, 2 MAVLink 2, 3 FrSky D, 4 FrSky S.Port, 5 GPS, 7 Alexmos gimbal, 8 Gimbal, 9 Range finder, 10 FrSky passthrough, 11 Lidar 360, 13 Beacon, 14 Volz servos, 15 S.Bus servos, 16 ESC telemetry, 17 Devo telemetry, 18 Optical flow, 19 Robotis servos, 20 NMEA out, 21 Wind vane, 22 SLCAN, 23 Radio receiver, 24 Engine, 28 Scripting, 29 Crossfire, 30 Generator, 31 Winch, 32 MSP, 33 DJI FPV, 34 Airspeed, 35 ADS-B, 36 External AHRS, 37 SmartAudio, 38 FETtec ESCs, 39 Torqeedo, 40 AIS, 41 CoDev ESCs, 42 DisplayPort, 43 MAVLink at high latency, 44 IRC Tramp, 45 DDS';
const BAUDS =
  '1 1200, 2 2400, 4 4800, 9 9600, 19 19200, 38 38400, 57 57600, 100 100000, 111 111100, 115 115200, 230 230400, 256 256000, 460 460800, 500 500000, 921 921600, 1500 1500000, 2000 2000000';
const GPS_TYPES =
  '0 None, 1 Found by itself, 2 u-blox, 5 NMEA, 6 SiRF, 8 Swift Piksi, 9 DroneCAN, 10 Septentrio, 11 Trimble, 13 ERB, 14 MAVLink, 15 NovAtel, 16 Hemisphere, 17 u-blox moving base, 18 u-blox rover, 19 MSP, 20 AllyStar, 21 External AHRS, 22 DroneCAN moving base, 23 DroneCAN rover, 24 Unicore, 25 Unicore moving base';
const SERVO_FUNCTIONS =
  '-1 GPIO, 0 Off, 1 As the radio says, 6 Gimbal yaw, 7 Gimbal pitch, 8 Gimbal roll, 9 Gimbal retract, 10 Camera trigger, 12 Second gimbal yaw, 13 Second gimbal pitch, 14 Second gimbal roll, 22 Sprayer pump, 23 Sprayer spinner, 27 Parachute, 28 Gripper, 29 Landing gear, 30 Engine on, 33 Motor 1, 34 Motor 2, 35 Motor 3, 36 Motor 4, 37 Motor 5, 38 Motor 6, 39 Motor 7, 40 Motor 8, 51 Channel 1 of the radio, 52 Channel 2 of the radio, 53 Channel 3 of the radio, 54 Channel 4 of the radio, 55 Channel 5 of the radio, 56 Channel 6 of the radio, 57 Channel 7 of the radio, 58 Channel 8 of the radio, 82 Motor 9, 83 Motor 10, 84 Motor 11, 85 Motor 12, 88 Winch, 94 Script 1, 95 Script 2, 96 Script 3, 97 Script 4, 120 Lights';
const RC_OPTIONS =
  '0 Nothing, 2 Flip, 3 Simple mode, 4 Return, 5 Save the trim, 7 Save a waypoint, 9 Camera trigger, 10 Range finder, 11 Fence, 13 Super simple mode, 14 Acro trainer, 15 Sprayer, 16 Auto, 17 Autotune, 18 Land, 19 Gripper, 21 Parachute on, 22 Parachute release, 23 Parachute in three positions, 24 Start the mission anew, 25 Attitude feed forward, 26 Limit of accelerations, 27 Gimbal retract, 28 Relay 1, 29 Landing gear, 30 Sound of a lost vehicle, 31 Motors stop at once, 32 Motor interlock, 33 Brake, 34 Relay 2, 35 Relay 3, 36 Relay 4, 37 Throw, 38 Avoid ADS-B, 39 Precise loiter, 40 Avoid obstacles, 41 Arm and disarm (until 4.1), 42 Return the way it came, 46 Radio overrides allowed, 52 Acro, 55 Guided, 56 Loiter, 57 Follow, 58 Forget the mission, 60 Zigzag, 65 Without GPS, 68 Stabilize, 69 Position hold, 70 Altitude hold, 72 Circle, 90 Estimator source, 62 Learn the compass, 71 Flow hold, 73 Drift, 76 Standby, 81 Disarm, 84 AirMode, 99 Auto return, 100 Without inertial sensor 1, 101 Without inertial sensor 2, 110 Without inertial sensor 3, 151 Turtle, 153 Arm and disarm, 154 Arm and disarm with AirMode, 163 Gimbal locked, 165 Arm or motors stop, 166 Camera records, 167 Camera zoom, 169 Camera focus by itself, 171 Calibrate the compasses, 300 Script 1, 301 Script 2, 302 Script 3, 303 Script 4';
const BATTERIES =
  '0 None, 3 Voltage, 4 Voltage and current, 5 Solo, 6 Bebop, 7 SMBus generic, 8 DroneCAN, 9 ESCs, 10 Sum of others, 11 Fuel flow, 12 Fuel level by PWM, 13 SMBus SUI3, 14 SMBus SUI6, 15 NeoDesign, 16 SMBus Maxell, 17 Generator electricity, 18 Generator fuel, 19 Rotoye, 20 MPPT, 21 INA2xx, 22 LTC2946, 23 Torqeedo, 24 Fuel level analogue, 25 Synthetic current, 26 INA239, 27 EFI, 28 AD7091R5, 29 Script';
const STREAM = 'Messages a second that this port sends by itself, unless a ground station asks for others.';

export const ARDUCOPTER = `
// The whole
FRAME_CLASS | Kind of frame |  |  | 0 | reboot | How many motors there are and where; without it the motors cannot be armed.
  = 0 Not set, 1 Quad, 2 Hexa, 3 Octa, 4 Octa quad, 5 Y6, 6 Helicopter, 7 Tri, 8 Single copter, 9 Coax copter, 10 Two motors, 11 Helicopter with two rotors, 12 Dodeca hexa, 13 Helicopter quad, 14 Deca, 15 By script, 16 Six degrees of freedom by script, 17 Dynamic by script
FRAME_TYPE | Order of the motors |  |  | 1 | reboot | How the arms stand to the nose, and which motor turns which way.
  = 0 Plus, 1 X, 2 V, 3 H, 4 V tail, 5 A tail, 10 Y6B, 11 Y6F, 12 X as Betaflight, 13 X as DJI, 14 X clockwise, 15 I, 18 X as Betaflight reversed, 19 Y4
SYSID_THISMAV | MAVLink number of the drone |  | 1..255 | 1 |  | The system number that it speaks under. Behind the tower every drone may keep 1.
SYSID_MYGCS | MAVLink number of its ground station |  | 1..255 | 255 |  | Only this one's sticks and heartbeats count. Agent and console speak as 255.
SYSID_ENFORCE | Only its own ground station |  |  | 0 |  | Whether messages of other ground stations are left unread.
  = 0 All may speak, 1 Only its own
INITIAL_MODE | Mode after switching on |  |  | 0 |  | Flight mode before anybody chose one.
  = ${MODES}
SCHED_LOOP_RATE | Main loop | Hz | 50..400 | 400 | reboot | How often a second attitude is controlled.
BRD_SAFETY_DEFLT | Safety switch at the start |  |  | 1 | reboot | Whether the motors are locked by the safety switch when the board starts.
  = 0 Off, 1 On
LOG_BITMASK | What is logged |  |  | 176126 |  | Which records a flight log has.
  & 0 Fast attitude, 1 Attitude, 2 GPS, 3 Performance, 4 Control and altitude, 5 Navigation, 6 Radio in, 7 Inertial sensors, 8 Commands, 9 Battery, 10 Radio out, 11 Optical flow, 12 Control loops, 13 Compass, 15 Camera, 17 Motor batteries, 18 Fast inertial sensors, 19 Raw inertial sensors, 20 Video stabilisation, 21 Fast harmonics
LOG_BACKEND_TYPE | Where logs go |  |  | 1 |  | Where flight logs are written to.
  & 0 Memory card, 1 MAVLink, 2 Flash of the board
LOG_DISARMED | Log while disarmed |  |  | 0 |  | Whether a log is written with the motors at rest too.
  = 0 No, 1 Yes, 2 Yes; not on USB power, 3 Yes; kept only if it is armed
LOG_FILE_DSRMROT | New log after each flight |  |  | 0 |  | Whether disarming ends a log file.
  = 0 No, 1 Yes

// Arming
ARMING_CHECK | Checks before arming |  |  | 1 |  | What must be well before the motors may start. Leave bit 0, all of them, set.
  & 0 All, 1 Barometer, 2 Compass, 3 GPS, 4 Inertial sensors, 5 Parameters, 6 Radio, 7 Voltage of the board, 8 Battery, 10 Logging, 11 Safety switch, 12 GPS settings, 13 System, 14 Mission, 15 Range finder, 16 Camera, 17 Authorisation, 18 Vision, 19 FFT, 20 Generator
ARMING_REQUIRE | Arming needed |  |  | 1 |  | Whether motors wait for arming.
  = 0 No, 1 Yes; lowest throttle before, 2 Yes; no signal before
ARMING_RUDDER | Arming by stick |  |  | 2 |  | Whether yaw at its end with the throttle down arms.
  = 0 No, 1 Arms, 2 Arms and disarms
ARMING_MIS_ITEMS | Mission items needed |  |  | 0 |  | Items without which a mission is refused before arming.
  & 0 Land, 1 Aircraft landing, 2 Landing start, 3 Take-off, 4 Aircraft take-off, 5 Rally point, 6 Return
ARMING_ACCTHRESH | Accelerometers may differ by | m/s/s | 0.25..3 | 0.75 |  | Between two of them before arming.
DISARM_DELAY | Disarms by itself after | s | 0..127 | 10 |  | On the ground with the throttle down; 0 for never.

// Flight modes
FLTMODE_CH | Channel of the mode switch |  |  | 5 |  | Channel of the radio that chooses among the six modes.
  = 0 None, 5 Channel 5, 6 Channel 6, 7 Channel 7, 8 Channel 8, 9 Channel 9, 10 Channel 10, 11 Channel 11, 12 Channel 12, 13 Channel 13, 14 Channel 14, 15 Channel 15
FLTMODE# | Mode # of the switch |  |  |  |  | Chosen by position # of the mode switch on the radio.
  = ${MODES}
SIMPLE | Simple mode |  |  | 0 |  | In which positions of the mode switch the sticks count from where the nose was at arming.
  & 0 Position 1, 1 Position 2, 2 Position 3, 3 Position 4, 4 Position 5, 5 Position 6
SUPER_SIMPLE | Super simple mode |  |  | 0 |  | In which positions of the mode switch the sticks count from home.
  & 0 Position 1, 1 Position 2, 2 Position 3, 3 Position 4, 4 Position 5, 5 Position 6
GUID_TIMEOUT | Guided speeds lapse after | s | 0.1..5 | 3 |  | Without a new set-point of speed or attitude it stops; places to fly to do not lapse.
GUID_OPTIONS | Guided mode may |  |  | 0 |  | What guided mode allows.
  & 0 Be armed from the radio, 2 Ignore the pilot's yaw, 3 Take thrust as thrust, 4 Not hold its place, 5 Not hold its speed, 6 Fly by the path planner, 7 Turn the nose into the wind
AUTO_OPTIONS | Auto mode may |  |  | 0 |  | What a mission allows.
  & 0 Be armed in auto, 1 Take off without raised throttle, 2 Ignore the pilot's yaw, 7 Turn the nose into the wind
FLIGHT_OPTIONS | Options in flight |  |  | 0 |  | Rarely needed changes of how it flies.
  & 0 No thrust loss check, 1 No yaw imbalance warning, 2 Release the gripper on thrust loss
WP_YAW_BEHAVIOR | Where the nose looks |  |  | 2 |  | On missions and returns.
  = 0 As it was, 1 To the next waypoint, 2 To the next waypoint; on returns as it was, 3 Along the track over ground
ANGLE_MAX | Maximum tilt | cdeg | 1000..8000 | 3000 |  | In every mode but acro, hundredths of a degree.
PHLD_BRAKE_RATE | Position hold brakes with | deg/s | 4..12 | 8 |  | How fast it leans back when the sticks are let go.
PHLD_BRAKE_ANGLE | Position hold leans back | cdeg | 2000..4500 | 3000 |  | At most, hundredths of a degree.

// Return and landing
RTL_ALT | Height of the return | cm | 30..300000 | 1500 |  | It climbs to at least this height above home before it flies back.
RTL_ALT_FINAL | Ends the return at | cm | 0..1000 | 0 |  | Height above home at which it waits; 0 to land.
RTL_ALT_TYPE | The return's height is over |  |  | 0 |  | What RTL_ALT is counted from.
  = 0 Home, 1 The ground below
RTL_CLIMB_MIN | The return climbs at least | cm | 0..3000 | 0 |  | Even where it is high enough.
RTL_CONE_SLOPE | Cone near home |  | 0..10 | 3 |  | Near home it returns lower, below a cone of this slope; 0 for always the full height.
RTL_LOIT_TIME | Waits above home | ms | 0..60000 | 5000 |  | Before it comes down.
RTL_SPEED | Speed of the return | cm/s | 0..2000 | 0 |  | 0 for that of missions.
RTL_OPTIONS | Options of the return |  |  | 0 |  | Rarely needed.
  & 2 Ignore the pilot's yaw
SRTL_ACCURACY | Return the way it came, within | m | 0..10 | 2 | reboot | How closely the track is kept.
SRTL_POINTS | Return the way it came, points |  | 0..500 | 300 | reboot | How many it remembers; 0 for no such mode.
LAND_SPEED | Last metres of a landing | cm/s | 30..200 | 50 |  | How fast it sinks below LAND_ALT_LOW.
LAND_SPEED_HIGH | Landing from high up | cm/s | 0..500 | 0 |  | How fast it sinks before; 0 for WPNAV_SPEED_DN.
LAND_ALT_LOW | Slow landing from | cm | 100..10000 | 1000 |  | Height at which it goes on slowly.
LAND_REPOSITION | Pilot may shift a landing |  |  | 1 |  | Whether sticks move it sideways while it lands by itself.
  = 0 No, 1 Yes
PILOT_TKOFF_ALT | Take-off by the pilot to | cm | 0..1000 | 0 |  | To which height a raised throttle takes it.
RALLY_LIMIT_KM | Rally points count within | km |  | 0.3 |  | Further ones are not returned to; 0 for all.
RALLY_INCL_HOME | Home is a rally point too |  |  | 1 |  | Whether it returns home where that is nearer.
  = 0 No, 1 Yes
CIRCLE_RADIUS | Radius of circle mode | cm | 0..200000 | 1000 |  | 0 turns on the spot.
CIRCLE_RATE | Speed of circle mode | deg/s | -90..90 | 20 |  | Negative for anticlockwise.
CIRCLE_OPTIONS | Options of circle mode |  |  | 1 |  | How it flies its circle.
  & 0 Sticks change it, 1 Nose along the circle, 2 Start in the middle, 3 Gimbal looks at the middle

// Failsafes
FS_THR_ENABLE | When the radio is lost |  |  | 1 |  | What it does without its transmitter.
  = 0 Nothing, 1 Return, 2 Go on with a mission (no longer taken), 3 Land, 4 Return the way it came; else return, 5 Return the way it came; else land, 6 Auto from its landing start; else return, 7 Brake; else land
FS_THR_VALUE | Throttle of a lost radio | us | 910..1100 | 975 |  | A pulse below it means that the receiver has lost the transmitter.
FS_GCS_ENABLE | When the ground station is lost |  |  | 0 |  | What it does without heartbeats of SYSID_MYGCS. The agent beats only while somebody has the controls.
  = 0 Nothing, 1 Return, 2 Go on with a mission (no longer taken), 3 Return the way it came; else return, 4 Return the way it came; else land, 5 Land, 6 Auto from its landing start; else return, 7 Brake; else land
FS_GCS_TIMEOUT | Ground station counts as lost after | s | 2..120 | 5 |  | So long without a heartbeat.
FS_EKF_ACTION | When the estimator fails |  |  | 1 |  | What it does when it no longer knows where it is.
  = 0 Report only, 1 Land; if it needs a place, 2 Altitude hold; if it needs a place, 3 Land
FS_EKF_THRESH | Estimator has failed from |  | 0.6..1 | 0.8 |  | Variance of compass and speeds beyond which it is not believed.
FS_CRASH_CHECK | Motors stop after a crash |  |  | 1 |  | Whether they stop when it lies and does not turn as it should.
  = 0 No, 1 Yes
FS_VIBE_ENABLE | Against strong vibration |  |  | 1 |  | Whether it flies more carefully when the accelerometers are shaken.
  = 0 No, 1 Yes
FS_DR_ENABLE | Without any place |  |  | 2 |  | What it does when only dead reckoning is left.
  = 0 Nothing, 1 Land, 2 Return; else land, 3 Return the way it came; else return, 4 Return the way it came; else land, 6 Auto from its landing start; else return
FS_DR_TIMEOUT | Dead reckoning for | s | 0..120 | 30 |  | So long it flies on before it drops to that.
FS_OPTIONS | Failsafes make exceptions |  |  | 16 |  | Where a failsafe lets it go on.
  & 0 Mission goes on when the radio is lost, 1 Mission goes on when the ground station is lost, 2 Guided goes on when the radio is lost, 3 A landing goes on, 4 The pilot goes on when the ground station is lost, 5 The gripper is released
BATT_FS_LOW_ACT | When the battery is low |  |  | 0 |  | At BATT_LOW_VOLT or BATT_LOW_MAH.
  = ${FAILSAFE_ACTIONS}
BATT_FS_CRT_ACT | When the battery is nearly empty |  |  | 0 |  | At BATT_CRT_VOLT or BATT_CRT_MAH.
  = ${FAILSAFE_ACTIONS}

// Fence
FENCE_ENABLE | Fence |  |  | 0 |  | Whether it watches its fence.
  = 0 Off, 1 On
FENCE_TYPE | What the fence is |  |  | 7 |  | Which of its borders count.
  & 0 Maximum height, 1 Circle around home, 2 Drawn areas, 3 Minimum height
FENCE_ACTION | At the fence |  |  | 1 |  | What it does when it crosses a border.
  = 0 Report only, 1 Return; else land, 2 Land, 3 Return the way it came; else return; else land, 4 Brake; else land, 5 Return the way it came; else land
FENCE_ALT_MAX | Fence: maximum height | m | 10..1000 | 100 |  | Above home.
FENCE_ALT_MIN | Fence: minimum height | m | -100..100 | -10 |  | Above home; needs its bit in FENCE_TYPE.
FENCE_RADIUS | Fence: radius | m | 30..10000 | 300 |  | Around home.
FENCE_MARGIN | Fence: keeps away | m | 1..10 | 2 |  | By how much it keeps inside.
FENCE_AUTOENABLE | Fence by itself |  |  | 0 |  | When the fence comes on without being told.
  = 0 Never, 1 At automatic take-off, 2 At automatic take-off; off below its floor to land, 3 While armed

// Navigation
WPNAV_SPEED | Speed of missions | cm/s | 10..2000 | 1000 |  | Over the ground, between waypoints.
WPNAV_SPEED_UP | Climbs in missions | cm/s | 10..1000 | 250 |  | Between waypoints.
WPNAV_SPEED_DN | Sinks in missions | cm/s | 10..500 | 150 |  | Between waypoints, and to LAND_ALT_LOW.
WPNAV_RADIUS | Waypoint is reached within | cm | 5..1000 | 200 |  | Before it goes on to the next one.
WPNAV_ACCEL | Acceleration of missions | cm/s/s | 50..500 | 250 |  | Along the way.
WPNAV_ACCEL_Z | Acceleration of climbs | cm/s/s | 50..500 | 100 |  | In missions.
WPNAV_ACCEL_C | Acceleration in corners | cm/s/s | 0..500 | 0 |  | 0 for twice WPNAV_ACCEL.
WPNAV_JERK | Jerk of missions | m/s/s/s | 1..20 | 1 |  | How quickly acceleration may change.
WPNAV_RFND_USE | Range finder over ground |  |  | 1 |  | Whether missions over terrain use it.
  = 0 No, 1 Yes
WPNAV_TER_MARGIN | Terrain margin | m | 0.1..100 | 10 |  | By how much terrain and range finder may differ before it stops.
LOIT_SPEED | Speed of loiter | cm/s | 20..3500 | 1250 |  | With the stick at its end.
LOIT_ACC_MAX | Acceleration of loiter | cm/s/s | 100..981 | 500 |  | At most.
LOIT_ANG_MAX | Maximum tilt in Loiter | deg | 0..45 | 0 |  | 0 for two thirds of the pilot's maximum angle.
LOIT_BRK_ACCEL | Loiter brakes with | cm/s/s | 25..250 | 250 |  | When the sticks are let go.
LOIT_BRK_DELAY | Loiter brakes after | s | 0..2 | 1 |  | When the sticks were let go.
LOIT_BRK_JERK | Jerk of braking | cm/s/s/s | 500..5000 | 500 |  | How quickly braking may begin.
TERRAIN_ENABLE | Terrain heights |  |  | 1 |  | Whether terrain is asked for and stored on the card.
  = 0 No, 1 Yes
MIS_RESTART | A mission begins |  |  | 0 |  | When auto mode comes again.
  = 0 Where it was left, 1 Anew
PILOT_SPEED_UP | Maximum climb rate by the pilot | cm/s | 50..500 | 250 |  | With the throttle stick at its end.
PILOT_SPEED_DN | Maximum descent rate by the pilot | cm/s | 0..500 | 0 |  | 0 for PILOT_SPEED_UP.
PILOT_ACCEL_Z | Pilot's vertical acceleration | cm/s/s | 50..500 | 250 |  | When the throttle stick is moved.
PILOT_Y_RATE | Maximum yaw rate by the pilot | deg/s | 1..360 | 202.5 |  | With the yaw stick at its end.
PILOT_Y_EXPO | Yaw stick is softer in the middle |  | -0.5..1 | 0 |  | 0 for a straight line.
PILOT_THR_BHV | Throttle stick may |  |  | 0 |  | How the throttle stick behaves.
  & 0 Spring back to the middle, 1 End a landing when raised, 2 Disarm at its bottom when landed
THR_DZ | Throttle's dead zone | us | 0..300 | 100 |  | Around the middle: the height is held there.

// Battery
BATT_MONITOR | Battery sensor |  |  | 0 | reboot | How voltage and current are measured.
  = ${BATTERIES}
BATT#_MONITOR | Sensor of battery # |  |  | 0 | reboot | How voltage and current of battery # are measured.
  = ${BATTERIES}
BATT_CAPACITY | Capacity | mAh | 0.. | 3300 |  | Of a full battery; the percentage is counted from it.
BATT_LOW_VOLT | Low from | V | 0..120 | 10.5 |  | Voltage at which BATT_FS_LOW_ACT comes; 0 for never.
BATT_LOW_MAH | Low at a rest of | mAh | 0.. | 0 |  | Capacity at which BATT_FS_LOW_ACT comes; 0 for never.
BATT_LOW_TIMER | Low for | s | 0..120 | 10 |  | How long the voltage must be low before it counts.
BATT_CRT_VOLT | Nearly empty from | V | 0..120 | 0 |  | Voltage at which BATT_FS_CRT_ACT comes; 0 for never.
BATT_CRT_MAH | Nearly empty at a rest of | mAh | 0.. | 0 |  | Capacity at which BATT_FS_CRT_ACT comes; 0 for never.
BATT_ARM_VOLT | Arms from | V | 0..120 | 0 |  | Below this voltage it does not arm; 0 for any.
BATT_ARM_MAH | Arms with a rest of | mAh | 0.. | 0 |  | Below this capacity it does not arm; 0 for any.
BATT_VOLT_MULT | Volts a volt at the pin |  |  | 10.1 |  | Divider of the voltage sensor.
BATT_AMP_PERVLT | Amperes a volt at the pin | A/V |  | 17 |  | Of the current sensor.
BATT_AMP_OFFSET | Current sensor's zero | V |  | 0 |  | Its voltage without any current.
BATT_VOLT_PIN | Pin of the voltage |  |  |  | reboot | Where the board measures the battery.
BATT_CURR_PIN | Pin of the current |  |  |  | reboot | Where the board measures the current.

// Motors
MOT_SPIN_ARM | Motors turn when armed |  | 0..1 | 0.1 |  | Share of the full output while it stands.
MOT_SPIN_MIN | Minimum output in flight |  | 0..1 | 0.15 |  | Share of the full output; more than MOT_SPIN_ARM.
MOT_SPIN_MAX | Most output in flight |  | 0.9..1 | 0.95 |  | Share above which motors give no more thrust.
MOT_THST_EXPO | Thrust curve |  | -1..1 | 0.65 |  | 0 for a straight line, 1 for a square.
MOT_THST_HOVER | Throttle that hovers |  | 0.125..0.6875 | 0.35 |  | Learnt in flight, unless MOT_HOVER_LEARN says no.
MOT_HOVER_LEARN | Learns the hover throttle |  |  | 2 |  | Whether MOT_THST_HOVER follows what it needs.
  = 0 No, 1 Yes, 2 Yes; and stores it
MOT_PWM_TYPE | Signal to the ESCs |  |  | 0 | reboot | What the speed controllers understand.
  = 0 Pulses, 1 OneShot, 2 OneShot125, 3 Brushed, 4 DShot150, 5 DShot300, 6 DShot600, 7 DShot1200, 8 Pulses in the servo's range, 9 Pulses as angles
MOT_PWM_MIN | Minimum pulse | us | 0..2000 | 1000 |  | Of the speed controllers.
MOT_PWM_MAX | Longest pulse | us | 0..2000 | 2000 |  | Of the speed controllers.
MOT_SPOOL_TIME | Spools up in | s | 0..2 | 0.5 |  | From standing to flying.
MOT_BAT_VOLT_MAX | Full voltage | V | 6..53 | 0 |  | From which thrust is corrected; 0 for not at all.
MOT_BAT_VOLT_MIN | Minimum voltage | V | 6..42 | 0 |  | To which thrust is corrected; 0 for not at all.
MOT_YAW_HEADROOM | Kept for yaw | us | 0..500 | 200 |  | Of the pulse, whatever the throttle.
MOT_SAFE_DISARM | Signal while disarmed |  |  | 0 |  | Whether the motors get none at all.
  = 0 Minimum pulse, 1 None

// Control loops
ATC_ANG_RLL_P | Roll angle: P | 1/s | 3..12 | 4.5 |  | How fast a wrong angle is turned into a rate.
ATC_ANG_PIT_P | Pitch angle: P | 1/s | 3..12 | 4.5 |  | How fast a wrong angle is turned into a rate.
ATC_ANG_YAW_P | Yaw angle: P | 1/s | 3..12 | 4.5 |  | How fast a wrong heading is turned into a rate.
ATC_RAT_RLL_P | Roll rate: P |  | 0.01..0.5 | 0.135 |  | Answer to a wrong rate of roll.
ATC_RAT_RLL_I | Roll rate: I |  | 0.01..2 | 0.135 |  | Answer to a rate that stays wrong.
ATC_RAT_RLL_D | Roll rate: D |  | 0..0.05 | 0.0036 |  | Answer to a rate that changes.
ATC_RAT_PIT_P | Pitch rate: P |  | 0.01..0.5 | 0.135 |  | Answer to a wrong rate of pitch.
ATC_RAT_PIT_I | Pitch rate: I |  | 0.01..2 | 0.135 |  | Answer to a rate that stays wrong.
ATC_RAT_PIT_D | Pitch rate: D |  | 0..0.05 | 0.0036 |  | Answer to a rate that changes.
ATC_RAT_YAW_P | Yaw rate: P |  | 0.1..2.5 | 0.18 |  | Answer to a wrong rate of yaw.
ATC_RAT_YAW_I | Yaw rate: I |  | 0.01..1 | 0.018 |  | Answer to a rate that stays wrong.
ATC_RAT_YAW_D | Yaw rate: D |  | 0..0.02 | 0 |  | Answer to a rate that changes.
ATC_ACCEL_R_MAX | Roll acceleration | cdeg/s/s | 0..180000 | 110000 |  | At most; 0 for no limit.
ATC_ACCEL_P_MAX | Pitch acceleration | cdeg/s/s | 0..180000 | 110000 |  | At most; 0 for no limit.
ATC_ACCEL_Y_MAX | Yaw acceleration | cdeg/s/s | 0..72000 | 27000 |  | At most; 0 for no limit.
ATC_INPUT_TC | Softness of the sticks | s | 0..1 | 0.15 |  | Time in which it follows; less is sharper.
ATC_SLEW_YAW | Maximum yaw rate by itself | cdeg/s | 500..18000 | 6000 |  | In missions and guided mode.
ATC_THR_MIX_MAN | Attitude over throttle by hand |  | 0.1..0.9 | 0.1 |  | How much attitude counts against throttle when the pilot has it.
PSC_POSXY_P | Place: P | 1/s | 0.5..2 | 1 |  | How fast a wrong place is turned into a speed.
PSC_VELXY_P | Speed over ground: P |  | 0.1..6 | 2 |  | Answer to a wrong speed.
PSC_VELXY_I | Speed over ground: I |  | 0.02..1 | 1 |  | Answer to a speed that stays wrong.
PSC_VELXY_D | Speed over ground: D |  | 0..1 | 0.5 |  | Answer to a speed that changes.
PSC_POSZ_P | Height: P | 1/s | 0.5..4 | 1 |  | How fast a wrong height is turned into a climb.
PSC_VELZ_P | Climb: P | 1/s | 1..8 | 5 |  | Answer to a wrong climb.
PSC_ACCZ_P | Vertical acceleration: P |  | 0.01..0.5 | 0.5 |  | Answer in throttle.
PSC_ACCZ_I | Vertical acceleration: I |  | 0..3 | 1 |  | Answer in throttle that stays.
AUTOTUNE_AXES | Autotune tunes |  |  | 7 |  | Which axes.
  & 0 Roll, 1 Pitch, 2 Yaw, 3 Yaw with D
AUTOTUNE_AGGR | Autotune is |  | 0.05..0.1 | 0.1 |  | 0.05 soft, 0.1 sharp.
INS_GYRO_FILTER | Gyros: filter | Hz | 0..256 | 20 |  | What is quicker is filtered away.
INS_ACCEL_FILTER | Accelerometers: filter | Hz | 0..256 | 20 |  | What is quicker is filtered away.
INS_HNTCH_ENABLE | Notch filter |  |  | 0 | reboot | Takes the noise of the motors out of the gyros.
  = 0 Off, 1 On
INS_HNTCH_FREQ | Notch: frequency | Hz | 10..495 | 80 |  | Of the motors' noise.
INS_HNTCH_BW | Notch: width | Hz | 5..250 | 40 |  | Usually half the frequency.
INS_HNTCH_MODE | Notch follows |  |  | 1 |  | What tells it the frequency.
  = 0 Nothing, 1 Throttle, 2 Rotation sensor, 3 ESC telemetry, 4 FFT, 5 Second rotation sensor
INS_HNTCH_REF | Notch: reference |  | 0..1 | 0 |  | Throttle at which INS_HNTCH_FREQ was measured.

// Knowing where it is
AHRS_EKF_TYPE | Estimator |  |  | 3 |  | What works out attitude and place.
  = 0 DCM, 2 EKF2, 3 EKF3, 11 External AHRS
AHRS_ORIENTATION | How the board sits |  |  | 0 | reboot | Turned against the frame.
  = 0 Straight, 1 45° right, 2 90° right, 3 135° right, 4 180°, 5 135° left, 6 90° left, 7 45° left, 8 Upside down, 12 Nose down; 180° pitch, 16 On its side, 24 Nose up, 25 Nose down, 101 Own angles 1, 102 Own angles 2
AHRS_TRIM_X | Level: roll | rad | -0.1745..0.1745 | 0 |  | By how much the board is rolled against level.
AHRS_TRIM_Y | Level: pitch | rad | -0.1745..0.1745 | 0 |  | By how much the board is pitched against level.
EK3_ENABLE | EKF3 |  |  | 1 | reboot | Whether the third estimator runs.
  = 0 Off, 1 On
EK3_IMU_MASK | EKF3 uses |  |  | 7 | reboot | An instance for each inertial sensor.
  & 0 First, 1 Second, 2 Third, 3 Fourth, 4 Fifth, 5 Sixth
EK3_SRC#_POSXY | Place from (set #) |  |  |  |  | Where place comes from in set # of sources.
  = 0 None, 3 GPS, 4 Beacon, 6 External navigation
EK3_SRC#_VELXY | Speed from (set #) |  |  |  |  | Where speed over ground comes from in set # of sources.
  = 0 None, 3 GPS, 4 Beacon, 5 Optical flow, 6 External navigation, 7 Wheels
EK3_SRC#_POSZ | Height from (set #) |  |  |  |  | Where height comes from in set # of sources.
  = 0 None, 1 Barometer, 2 Range finder, 3 GPS, 4 Beacon, 6 External navigation
EK3_SRC#_VELZ | Climb from (set #) |  |  |  |  | Where climb comes from in set # of sources.
  = 0 None, 3 GPS, 4 Beacon, 6 External navigation
EK3_SRC#_YAW | Heading from (set #) |  |  |  |  | Where heading comes from in set # of sources.
  = 0 None, 1 Compass, 2 GPS, 3 GPS; else compass, 6 External navigation, 8 GSF
GPS#_TYPE | GPS receiver # |  |  |  | reboot | What receiver # is.
  = ${GPS_TYPES}
GPS_AUTO_SWITCH | Of several receivers |  |  | 1 |  | Which is believed.
  = 0 The first, 1 The best, 2 A blend, 4 The first while it has a 3D fix
GPS_HDOP_GOOD | GPS is good below |  | 100..900 | 140 |  | Hundredths of HDOP before arming.
GPS_GNSS_MODE | Satellites used |  |  | 0 | reboot | Systems of the first receiver; 0 leaves it as it is.
  & 0 GPS, 1 SBAS, 2 Galileo, 3 BeiDou, 4 IMES, 5 QZSS, 6 GLONASS
COMPASS_ENABLE | Compasses |  |  | 1 | reboot | Whether there are any.
  = 0 Off, 1 On
COMPASS_USE | First compass is used |  |  | 1 |  | For the heading.
  = 0 No, 1 Yes
COMPASS_USE# | Compass # is used |  |  | 1 |  | For the heading.
  = 0 No, 1 Yes
COMPASS_AUTODEC | Declination by itself |  |  | 1 |  | Worked out from where it is.
  = 0 No, 1 Yes
COMPASS_LEARN | Compass learns in flight |  |  | 0 |  | Whether its offsets are corrected while it flies.
  = 0 No, 2 By the estimator, 3 In flight
COMPASS_ORIENT | How the compass sits |  |  | 0 |  | Turned against the frame, where it is an outside one.
RNGFND#_TYPE | Range finder # |  |  | 0 | reboot | What range finder # is.
RNGFND#_MIN_CM | Range finder #: from | cm | 0..32000 | 20 |  | Nearest distance that counts.
RNGFND#_MAX_CM | Range finder #: to | cm | 0..32000 | 700 |  | Furthest distance that counts.
RNGFND#_ORIENT | Range finder # looks |  |  | 25 |  | Where to.
  = 0 Forward, 2 Right, 4 Back, 6 Left, 24 Up, 25 Down
FLOW_TYPE | Optical flow sensor |  |  | 0 | reboot | What it is.
AVOID_ENABLE | Stops before |  |  | 3 |  | What it keeps away from when flown by hand.
  & 0 Fence, 1 Proximity sensor, 2 Beacon fence
AVOID_MARGIN | Keeps away | m | 1..10 | 2 |  | From what AVOID_ENABLE names.
ADSB_TYPE | ADS-B receiver |  |  | 0 | reboot | What tells of aircraft nearby.
  = 0 None, 1 uAvionix by MAVLink, 2 Sagetech, 3 uAvionix UCP, 4 Sagetech MX

// Radio
RCMAP_ROLL | Channel of roll |  | 1..16 | 1 | reboot | On the radio.
RCMAP_PITCH | Channel of pitch |  | 1..16 | 2 | reboot | On the radio.
RCMAP_THROTTLE | Channel of throttle |  | 1..16 | 3 | reboot | On the radio.
RCMAP_YAW | Channel of yaw |  | 1..16 | 4 | reboot | On the radio.
RC#_MIN | Channel #: lowest | us | 800..2200 |  |  | Pulse of the stick at one end.
RC#_MAX | Channel #: highest | us | 800..2200 |  |  | Pulse of the stick at the other end.
RC#_TRIM | Channel #: middle | us | 800..2200 |  |  | Pulse of the stick let go.
RC#_DZ | Channel #: dead zone | us | 0..200 |  |  | Around the middle.
RC#_REVERSED | Channel # is turned round |  |  | 0 |  | Whether one end counts as the other.
  = 0 No, 1 Yes
RC#_OPTION | Switch on channel # |  |  | 0 | reboot | What a switch on this channel does.
  = ${RC_OPTIONS}
RC_OPTIONS | Options of the radio |  |  | 32 |  | Rarely needed.
  & 0 Ignore the receiver, 1 Ignore overrides, 2 Ignore the receiver's own failsafe, 3 FPort padding, 4 Log raw bytes, 5 Arming needs the throttle at zero, 6 Arming with sticks off the middle, 7 Reversed switches, 8 Crossfire telemetry as passthrough, 9 No rate messages of ELRS, 10 Several receivers, 11 Link quality of Crossfire as signal strength, 12 Star beside the mode when disarmed, 13 ELRS at 420 kBaud
RC_OVERRIDE_TIME | Overrides lapse after | s | 0..120 | 3 |  | Sticks of a ground station without a new message; 0 for none at all, -1 for never.
RC_SPEED | Pulses to the ESCs | Hz | 50..490 | 490 |  | How often a second.
RC_PROTOCOLS | Receivers understood |  |  | 1 |  | Which protocols are tried.
  & 0 All, 1 PPM, 2 I.Bus, 3 S.Bus, 4 S.Bus not inverted, 5 DSM, 6 SUMD, 7 SRXL, 8 SRXL2, 9 Crossfire, 10 ST24, 11 FPort, 12 FPort2, 13 Fast S.Bus, 14 DroneCAN, 15 Ghost, 16 MAVLink
SERVO#_FUNCTION | Output # drives |  |  |  | reboot | What is connected to output #.
  = ${SERVO_FUNCTIONS}
SERVO#_MIN | Output #: shortest pulse | us | 500..2200 | 1100 |  | At one end.
SERVO#_MAX | Output #: longest pulse | us | 800..2200 | 1900 |  | At the other end.
SERVO#_TRIM | Output #: middle | us | 800..2200 | 1500 |  | At rest.
SERVO#_REVERSED | Output # is turned round |  |  | 0 |  | Whether one end counts as the other.
  = 0 No, 1 Yes

// Ports
SERIAL#_PROTOCOL | Port # speaks |  |  |  | reboot | What is connected to serial port #.
  = ${PROTOCOLS}
SERIAL#_BAUD | Port #: speed |  |  |  |  | Bits a second.
  = ${BAUDS}
SERIAL#_OPTIONS | Port #: options |  |  | 0 | reboot | How its wires are driven.
  & 0 Receive inverted, 1 Send inverted, 2 Half duplex, 3 Receive and send swapped, 4 Receive pulled down, 5 Receive pulled up, 6 Send pulled down, 7 Send pulled up, 8 No DMA to receive, 9 No DMA to send, 10 MAVLink not forwarded, 11 No FIFO, 12 Streams not changed
SR#_RAW_SENS | Port #: sensors, raw | Hz | 0..50 |  | reboot | ${STREAM}
SR#_EXT_STAT | Port #: state | Hz | 0..50 |  | reboot | ${STREAM}
SR#_RC_CHAN | Port #: radio | Hz | 0..50 |  | reboot | ${STREAM}
SR#_POSITION | Port #: place | Hz | 0..50 |  | reboot | ${STREAM}
SR#_EXTRA1 | Port #: attitude | Hz | 0..50 |  | reboot | ${STREAM}
SR#_EXTRA2 | Port #: speeds | Hz | 0..50 |  | reboot | ${STREAM}
SR#_EXTRA3 | Port #: other things | Hz | 0..50 |  | reboot | ${STREAM}
SR#_PARAMS | Port #: parameters | Hz | 0..50 |  | reboot | ${STREAM}
CAN_P#_DRIVER | CAN port # |  |  | 0 | reboot | Which driver runs on it.
  = 0 None, 1 First, 2 Second, 3 Third
TELEM_DELAY | Telemetry waits | s | 0..30 | 0 |  | After switching on, so that a radio can start.

// Cameras
CAM1_TYPE | Camera trigger |  |  | 0 | reboot | How the first camera is released.
  = 0 None, 1 Servo, 2 Relay, 3 GoPro in Solo's gimbal, 4 Gimbal (Siyi), 5 MAVLink, 6 MAVLink camera protocol, 7 Script
MNT1_TYPE | Gimbal |  |  | 0 | reboot | What the first gimbal is.
  = 0 None, 1 Servos, 2 Solo, 3 Alexmos, 4 SToRM32 by MAVLink, 5 SToRM32 by serial port, 6 Gremsy, 7 Brushless by PWM, 8 Siyi, 9 Script, 10 Xacti, 11 Viewpro, 12 Topotek, 13 CADDX
`;
