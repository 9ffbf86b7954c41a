/**
 * ArduCopter 4.5 to 4.7: the names that 4.7 introduced, peripherals, and families of parameters that appear when a
 * feature is switched on: one line describes a whole family. The format is that of ../facts.ts; the texts are our own.
 */

export const ARDUCOPTER_FAMILIES = `
// Names of 4.7
WP_SPD | Speed in missions | Speed over ground that missions are flown at.
WP_SPD_UP | Climb in missions | Climb rate that missions are flown at.
WP_SPD_DN | Descent in missions | Speed down that missions are flown at.
WP_ACC | Acceleration in missions | Over ground.
WP_ACC_CNR | Acceleration in corners | Over ground, from one leg into the next; 0 for twice that of the legs.
WP_ACC_Z | Acceleration up and down | In missions.
WP_JERK | Jerk in missions | How fast acceleration over ground may change.
WP_RADIUS_M | Waypoint counts as reached | Distance at which it does.
WP_RFND_USE | Range finder in missions | Whether heights above the ground come from it.
WP_TER_MARGIN | Height above ground: margin | How far off the height may be before the drone stops on its way.
RTL_ALT_M | Height of the return | Minimum height above home on the way back.
RTL_ALT_FINAL_M | Height at the end of the return | Where it stays above home; 0 to land.
RTL_CLIMB_MIN_M | Climb before the return | It climbs at least this much first.
RTL_SPEED_MS | Speed of the return | Over ground; 0 for that of missions.
LOIT_SPEED_MS | Speed in Loiter | Fastest over ground.
LOIT_ACC_MAX_M | Acceleration in Loiter | Maximum over ground.
LOIT_BRK_ACC_M | Braking in Loiter | Maximum while it brakes.
LOIT_BRK_JRK_M | Braking in Loiter: jerk | How fast braking may change.
LOIT_OPTIONS | Loiter options | Changes to the usual behaviour.
LAND_SPD_MS | Speed of landing | Near the ground.
LAND_SPD_HIGH_MS | Speed of landing, high | Above the last metres; 0 for that of missions.
LAND_ALT_LOW_M | Last metres | Height from which it lands slowly.
PILOT_SPD_UP | Fastest climb by hand | At full stick.
PILOT_SPD_DN | Fastest descent by hand | At full stick; 0 for that of the climb.
PILOT_ACC_Z | Acceleration by hand | Up and down.
PILOT_TKO_ALT_M | Take-off by hand | Height that raising the stick takes off to; 0 for none.
CIRCLE_RADIUS_M | Radius of circles | 0 turns on the spot.
ATC_ACC_R_MAX | Acceleration of roll | Maximum; 0 for no limit.
ATC_ACC_P_MAX | Acceleration of pitch | Maximum; 0 for no limit.
ATC_ACC_Y_MAX | Acceleration of yaw | Maximum; 0 for no limit.
PSC_NE_JERK | Jerk over ground | How fast acceleration over ground may change.
PSC_D_JERK | Jerk up and down | How fast acceleration up and down may change.
PSC_ACC_XY_FILT | Acceleration: filter | Above this frequency acceleration over ground is damped.
FENCE_ALT_MAX_TP | Highest: measured from | What the maximum height of the fence is measured from.
FENCE_ALT_MIN_TP | Lowest: measured from | What the least height of the fence is measured from.
FENCE_MARGIN_XY | Margin over ground | Distance from the border at which the drone begins to slow down.
AVOID_ANG_MAX | Lean away from obstacles | Maximum lean to avoid something in modes without a place.
ARMING_SKIPCHK | Checks left out | Which checks before arming are not made. 0 makes them all.
ARMING_CRSDP_IGN | Arming with a crash dump | Whether the drone may arm though an earlier crash of the autopilot is stored.
MOT_IDLE_SEC | Idle before take-off | Time at idle after arming.
MOT_YAW_SV_ANGLE | Yaw servo: maximum | Maximum lean of a tricopter's servo.
PARAM_LOCK_ENAB | Parameters are locked | Whether nobody may change parameters.
AUTOTUNE_SEQ | Tuned one after the other | What autotune tunes.
AHRS_ORIG_* | Origin: * | Place of the origin that is used without GPS.
AHRS_ORIGIN_* | Last origin: * | Where the origin was at the last flight.
AHRS_CUSTOM_* | Board at an angle: * | How the board is turned to the drone, with AHRS_ORIENTATION for it.
COMPASS_CUS_* | Compass at an angle: * | How the compass is turned to the drone, with its mounting for it.

PLDP_RNG_MIN | Placing a load: minimum height | Minimum height by the range finder at which it may count as standing; 0 for no check.
EK3_FLOW_MAX | Optical flow: maximum | Faster flow is not used.

// Before 4.6
GPS_TYPE | Kind of receiver | How the first satellite receiver is attached.
GPS_TYPE2 | Kind of receiver (2) | How the second satellite receiver is attached.
GPS_POS#_* | Antenna #: place * | How far it is mounted from the centre.
GPS_MB#_* | Receiver #, heading by two: * | Where the other antenna is.
GPS#_MB_* | Receiver #, heading by two: * | Where the other antenna is.
GPS_DELAY_MS | Receiver 1: delay | How late its places come; 0 for the known delay of its kind.
GPS_DELAY_MS2 | Receiver 2: delay | How late its places come; 0 for the known delay of its kind.
GPS_RATE_MS | Receiver 1: interval | Time between two places.
GPS_RATE_MS2 | Receiver 2: interval | Time between two places.
GPS_COM_PORT | Receiver 1: its own port | Port of the receiver that talks with the autopilot.
GPS_COM_PORT2 | Receiver 2: its own port | Port of the receiver that talks with the autopilot.
GPS_CAN_NODEID# | Receiver #: node | Node that it was found at on the CAN bus.
GPS_MIN_DGPS | Corrected from | Kind of fix from which a place counts as corrected.

// The simulator
SIM_MAG_* | Simulated compass: * | Of the simulated drone only.
SIM_MAG#_* | Simulated compass #: * | Of the simulated drone only.
SIM_GPS_* | Simulated satellite receivers: * | Of the simulated drone only.
SIM_GPS#_* | Simulated satellite receiver #: * | Of the simulated drone only.
SIM_BARO_* | Simulated barometer: * | Of the simulated drone only.
SIM_BAR#_* | Simulated barometer #: * | Of the simulated drone only.
SIM_ACC#_* | Simulated accelerometer #: * | Of the simulated drone only.
SIM_GYR#_* | Simulated gyro #: * | Of the simulated drone only.
SIM_BATT_* | Simulated battery: * | Of the simulated drone only.
SIM_WIND_* | Simulated wind: * | Of the simulated drone only.
SIM_WAVE_* | Simulated waves: * | Of the simulated drone only.
SIM_SHIP_* | Simulated ship: * | Of the simulated drone only.
SIM_VICON_* | Simulated motion capture: * | Of the simulated drone only.
SIM_FLOW_* | Simulated optical flow: * | Of the simulated drone only.
SIM_SONAR_* | Simulated range finder: * | Of the simulated drone only.
SIM_RC_* | Simulated radio: * | Of the simulated drone only.
SIM_ENGINE_* | Simulated motors: * | Of the simulated drone only.
SIM_VIB_* | Simulated vibration: * | Of the simulated drone only.
SIM_PLD_* | Simulated landing mark: * | Of the simulated drone only.
SIM_* | Simulator: * | Of the simulated drone only.

// What is attached
BATT_SOC#_* | Charge by voltage, battery #: * | A script that tells the charge from voltage and cells.
BATT_SOC_* | Charge by voltage: * | A script that tells the charge from voltage and cells.
BATT_FL_* | Fuel level: * | How a sensor's voltage becomes a level of fuel.
BATT_ANX_* | ANX battery: * | A script for batteries on the CAN bus.
BATT_* | Battery: * | Of the kind of monitor that BATT_MONITOR names.
BATT#_* | Battery #: * | Of the kind of monitor that BATT#_MONITOR names.
BATTA_* | Battery 10: * | As those of the first battery.
BATTB_* | Battery 11: * | As those of the first battery.
BATTC_* | Battery 12: * | As those of the first battery.
BATTD_* | Battery 13: * | As those of the first battery.
BATTE_* | Battery 14: * | As those of the first battery.
BATTF_* | Battery 15: * | As those of the first battery.
BATTG_* | Battery 16: * | As those of the first battery.
RNGFND#_* | Range finder #: * | Where it is, how it is attached and what it measures.
RNGFNDA_* | Range finder 10: * | Where it is, how it is attached and what it measures.
PRX#_* | Sensor around #: * | Where it is, how it is attached and what it leaves out.
ARSPD_* | Airspeed: * | How airspeed is measured and when it is believed.
ARSPD#_* | Airspeed sensor #: * | How it is attached and calibrated.
TEMP#_* | Temperature #: * | How it is attached and what it measures.
RPM#_* | Turns #: * | How turns are measured and scaled.
BARO#_* | Barometer #: * | How wind is taken out of its pressure.
INS_HNTC#_* | Harmonic notch #: * | Which vibration is damped, and how far.
INS_HNTCH_* | Harmonic notch: * | Which vibration is damped, and how far.
INS_TCAL#_* | Temperature calibration #: * | Learned by the sensor's own calibration.
INS_* | Inertial sensor: * | Of a further sensor; as those of the first.
INS#_* | Inertial sensor #: * | Of a further sensor; as those of the first.
COMPASS_PMOT#_* | Field of motor #: * | Learned for each motor by itself.
COMPASS_PMOT_* | Fields of the motors: * | Learned for each motor by itself.
EK2_* | Older estimator: * | Of the estimator before EKF3; as the same of EK3.
FFT_* | Frequency analysis: * | How vibration is looked for in flight.
FILT#_* | Filter #: * | Shape of a filter that loops can use.
CC_* | Own controller: * | Of a controller that replaces the usual one.
CC#_* | Own controller #: * | Of a controller that replaces the usual one.
CUST_ROT#_* | Own rotation #: * | Angles of a mounting.
EFI_* | Engine: * | How an engine's computer is read and scaled.
GEN_* | Generator: * | How a generator on board is watched.
ESC_HW_* | Hobbywing ESCs: * | How their reports are read.
CAM#_* | Camera #: * | How camera # is released, and what is told of its pictures.
CAM_RC_* | RunCam: * | How a camera with a menu is worked by the radio.
MNT#_* | Gimbal #: * | How far and how fast it turns, and what moves it.
LGR_* | Landing gear: * | When it goes in and out, and how that is known.
CHUTE_* | Parachute: * | How and when it is released.
GRIP_* | Gripper: * | How it opens and closes.
SPRAY_* | Sprayer: * | How much it sprays, by speed.
WINCH_* | Winch: * | How it is driven.
VTX_* | Video transmitter: * | Channel and power.
BTN_* | Buttons: * | Inputs of the board that are told or worked as switches.
RSSI_* | Strength of the radio: * | Where it is measured, and its scale.
RELAY#_* | Relay #: * | What switches it, and which pin.
SERVO_BLH_* | BLHeli: * | ESCs that are set and read by their own protocol.
SERVO_* | Outputs: * | How outputs are driven.
OSD_W_* | Picture display, warns of: * | From which value on it blinks.
OSD_* | Picture display: * | What writes into the pilot's picture, and when.
OSD#_PARAM#_* | Picture display, parameter on page #: * | A parameter that can be changed in the picture.
OSD#_* | Picture display, page #: * | Whether an item is shown (EN), and in which column (X) and line (Y).
NTF_* | Lights and sounds: * | What the drone shows and sounds.
VISO_* | Visual odometry: * | Where its camera is and how sure it is.
EAHRS_* | Estimator outside: * | How it is attached and what it is used for.
FLOW_* | Optical flow: * | How the sensor is mounted and scaled.
BCN_* | Beacons: * | Where they are.
PLND_* | Precise landing: * | How the landing mark is found and flown to.
TCAL_* | Temperature of the barometer: * | Learned by temperature.
CAN_* | CAN bus: * | Driver, speed and what is sent.
NET_* | Network: * | Addresses and ports.
DDS_* | DDS: * | Link to programs of ROS 2.
MSP_* | MSP: * | Displays that are told by MSP.
LTE_* | Mobile network modem: * | A script for a modem on a serial port.
DID_* | Remote identification: * | How the drone says who it is.
ADSB_* | ADS-B: * | Receiver and transmitter of aircraft around.
AIS_* | AIS: * | Receiver of ships around.
AVD_* | Avoids aircraft: * | When and how.
SCR_* | Scripts: * | Memory, folders and numbers of their own.
BRD_RADIO_* | Built-in radio: * | Of boards with a radio receiver.
BRD_HEAT_* | Heating of the sensors: * | Of boards that are heated.
BRD_* | Board: * | Pins, buses and behaviour of the board.
SR#_* | Link #: * | Messages a second by itself, unless a ground station asks for others.

// Modes
OA_* | Way around obstacles: * | How a way around is looked for.
FOLL_* | Follow: * | Which drone is followed, from where and how.
FOLLP_* | Follow by plane: * | A script of planes.
WVANE_* | Nose into the wind: * | When and how fast it turns.
SID_* | System identification: * | Which signal is put in.
ZIGZ_* | Zigzag: * | Lines, distances and pauses.
AUTOTUNE_* | Autotune: * | How it tunes.
TMODE_* | Two-stick flight: * | A simple way to fly by hand.
AFS_* | Advanced failsafe: * | What ends the flight.
AROT_* | Autorotation: * | Of helicopters.
H_* | Helicopter: * | Rotor, swashplate and governor.
IM_* | Collective: * | Of helicopters.
ATC_* | Attitude: * | Of helicopters.
PHLD_* | Position hold: * | How it brakes.
THR_* | Throttle: * | How it is filtered or stopped.
DR_* | Without GPS: * | A script that flies home by attitude alone when GPS fails.
QUIK_* | Quick tuning: * | A script that tunes in flight.
RTUN_* | Quick tuning of rovers: * | A script of rovers.
AEROM_* | Aerobatics: * | A script of planes.
TOFSENSE_* | TOFSense range finders: * | A script for range finders on the CAN bus.
SLUP_* | Slung load: * | A script that calms a load on a rope.
RCK_* | Radio lost: * | A script for a lost radio.
ESRC_* | Sources by quality: * | A script that changes the estimator's sources.
UM_* | UltraMotion servos: * | A script for servos on the CAN bus.
WEB_* | Web server: * | A script that serves logs over the network.
VID#_* | Camera #, video: * | What it tells of its video.
VIEP_* | ViewPro: * | A script for a gimbal.
TRIK_* | Tricks: * | A script of planes.
TERR_* | Terrain watch: * | A script that warns of the ground.
FOLT_* | Tells who follows: * | A script that tells the place to followers.
ALAND_* | Landing of planes: * | A script of planes.
ARM_* | Further checks before arming: * | A script that checks more before arming.
BTAG_* | Batteries that tell their age: * | A script for battery tags.
DJIR_* | DJI gimbal: * | A script for a gimbal on the CAN bus.
RK9_* | RockBlock modem: * | A script for a satellite modem.
SHIP_* | Landing on a ship: * | A script of planes.
TA_* | Terrain avoidance of planes: * | A script of planes.
TRQL_* | Torqeedo motors: * | A script for motors of boats.
POI_* | Point that is looked at: * | A script that tells where the camera looks.
PREV_* | Parameters put back: * | A script that undoes changes in flight.
`;
