/**
 * PX4 1.14 to 1.16: families of parameters. One line describes a whole family; units, ranges, choices and bits are in
 * the table of metadata. The format is that of ../facts.ts; the texts are our own.
 */

export const PX4_FAMILIES = `
TC_A#_* | Accelerometer #, temperature: * | Learned by the calibration of temperature.
TC_G#_* | Gyro #, temperature: * | Learned by the calibration of temperature.
TC_B#_* | Barometer #, temperature: * | Learned by the calibration of temperature.
TC_M#_* | Compass #, temperature: * | Learned by the calibration of temperature.
TC_* | Calibration of temperature: * | What is corrected by temperature.
CA_ROTOR#_* | Rotor #: * | Where it is, how it turns and how strong it is.
CA_SV_CS#_* | Control surface #: * | What it is, and how much it turns the vehicle.
CA_SV_TL#_* | Tilting servo #: * | How far it tilts.
CA_SP#_* | Swashplate #: * | Where its servos are.
CA_* | Frame: * | Which outputs move the vehicle, and how.
CAL_ACC#_* | Accelerometer #: * | Found by calibration.
CAL_GYRO#_* | Gyro #: * | Found by calibration.
CAL_MAG#_* | Compass #: * | Found by calibration.
CAL_BARO#_* | Barometer #: * | Found by calibration.
CAL_* | Calibration: * | Found by calibration.
EKF2_EV_* | Estimator, vision: * | How place and speed by cameras are used.
EKF2_GPS_* | Estimator, GPS: * | How GPS is checked and used.
EKF2_MAG_* | Estimator, compass: * | How the compass is used.
EKF2_RNG_* | Estimator, range finder: * | How it is used.
EKF2_BARO_* | Estimator, barometer: * | How it is used.
EKF2_OF_* | Estimator, optical flow: * | How it is used.
EKF2_* | Estimator: * | How attitude, place and speed are estimated.
ATT_* | Simple estimator: * | Of attitude alone.
LPE_* | Older estimator: * | Of place, without EKF2.
COM_FLTMODE# | Mode of position # | Flight mode in position # of the mode switch.
COM_ARM_* | Arming: * | What must be well before arming.
COM_RC_* | Sticks: * | Which are used, and when they count as lost.
COM_* | Commander: * | Modes, arming and failsafes.
MPC_* | Flight of a multicopter: * | Speeds, accelerations and loops of place and height.
MC_* | Attitude of a multicopter: * | Loops of attitude and rates, acro and autotune.
FW_* | Flight of a plane: * | Loops and limits of a plane.
NPFG_* | Course of a plane: * | How it follows a line.
RWTO_* | Runway take-off: * | Of planes.
LNDFW_* | Plane counts as landed: * | When.
LNDMC_* | Multicopter counts as landed: * | When.
LND_* | Landed: * | Counters of flight time.
VT_* | VTOL: * | Changes between hovering and flying.
VTO_* | VTOL take-off: * | Height and circle.
WV_* | Nose into the wind: * | Of VTOL.
RC#_* | Channel #: * | Calibration of the radio.
RC_MAP_* | Channel for: * | Which channel of the radio does it; 0 for none.
RC_* | Radio: * | Receiver and switches.
TRIM_* | Trim: * | Of the sticks.
MAN_* | By hand: * | Flight with the sticks.
MAV_#_* | MAVLink #: * | Port, rate and set of messages of link #.
MAV_* | MAVLink: * | Numbers and behaviour of all links.
UXRCE_* | ROS 2: * | Link to programs of ROS 2.
SENS_* | Sensors: * | Drivers and mountings.
IMU_* | Inertial sensors: * | Filters and rates.
ASPD_* | Airspeed: * | When it is believed, and wind.
GPS_* | Satellite receivers: * | How they are set up.
SYS_* | System: * | Which parts run.
SDLOG_* | Logs: * | What is logged, and when.
CBRK_* | Check is off: * | A number of its own switches a check off; leave it at 0.
MNT_* | Gimbal: * | How it is moved.
TRIG_* | Photographs: * | How a camera is released.
PWM_* | Outputs: * | Signal of motors and servos.
BAT#_* | Battery #: * | Cells, voltage and how it is measured.
BAT_* | Battery: * | When it counts as low.
ADSB_* | ADS-B: * | Transponder.
FD_* | Failures: * | When a motor or the attitude counts as failed.
NAV_* | Missions: * | Radii, traffic and what ends them.
MIS_* | Missions: * | Take-off, cameras and what a mission needs.
RTL_* | Return: * | Height, way and end.
PLD_* | Precise landing: * | How the mark is found and flown to.
LTEST_* | Landing mark: * | How its place is estimated.
FLW_TGT_* | Follow me: * | Distance, height and side.
HTE_* | Hovering throttle: * | How it is estimated.
CP_* | Avoids collisions: * | Distance and delay.
GF_* | Fence: * | Limits and what happens.
MBE_* | Compass bias: * | How it is learned.
OSD_* | Picture display: * | What it shows.
WEIGHT_* | Weight: * | For the estimate of airspeed.
EV_* | Vision: * | Place by cameras.
SIH_* | Simulation on board: * | Mass, inertia and forces.
SIM_* | Simulator: * | Of the simulated drone only.
TEST_* | Test: * | For developers only.
UUV_* | Under water: * | Of submarines.
GND_* | Rover: * | Of vehicles on the ground.
RDD_* | Rover with two sides: * | Of vehicles on the ground.
RD_* | Rover with two sides: * | Of vehicles on the ground.
UAVCAN_* | DroneCAN: * | Nodes on the CAN bus.
CYPHAL_* | Cyphal: * | Nodes on the CAN bus.
PD_* | USB power: * | Of boards that are charged.
THR_* | Thrust: * | Scale of the motors.
MOT_* | Motors: * | How their outputs change.
PCA9685_* | Outputs on I2C: * | Motors and servos at a PCA9685 chip.
RBCLW_* | RoboClaw: * | Motors of a rover at this controller.
TAP_ESC_* | TAP ESC: * | Motors at this controller.
MODAL_IO_* | ModalAI ESC: * | Motors at this controller.
MODALAI_* | ModalAI: * | Of its boards.
VOXL_ESC_* | VOXL ESC: * | Motors at this controller.
VOXL2_IO_* | VOXL2 outputs: * | Motors and servos at this board.
VTQ_* | Vertiq motors: * | Motors with a controller of their own.
VERTIQ_IO_* | Vertiq motors: * | Port that they are at.
UCAN1_* | Cyphal: * | Which ports of the CAN bus it uses; 65535 for none.
DSHOT_* | DShot: * | Digital signal of motors.
ESC_* | Motor controllers: * | Versions of what they run.
CAM_CAP_* | Camera's answer: * | Signal of a camera that took a photograph.
PPS_CAP_* | Time pulse: * | Of a satellite receiver.
RPM_* | Revolutions: * | How a turning rate is measured.
ICE_* | Combustion engine: * | How it is started and stopped.
ISBD_* | Iridium: * | Messages by satellite.
MSP_OSD_* | Picture display over MSP: * | Port that it is at.
ADC_* | Analogue inputs: * | Chips for them.
BATMON_* | Smart battery: * | How it is found.
INA220_* | Power meter INA220: * | Current range and shunt.
INA226_* | Power meter INA226: * | Current range and shunt.
INA228_* | Power meter INA228: * | Current range and shunt.
INA238_* | Power meter INA238: * | Current range and shunt.
VOXLPM_* | Power meter VOXL: * | Shunts.
PCF8583_* | Turn counter PCF8583: * | Magnets and when it is read.
SF45_* | Range finder SF45: * | Mounting and rate.
SF1XX_* | Range finder SF1xx: * | When it is used.
VN_* | VectorNav: * | What it is used for.
SEP_* | Septentrio receiver: * | Ports, rates and what it sends.
BMM350_* | Compass BMM350: * | Rate, averages and drive.
SCH16T_* | Inertial sensor SCH16T: * | Filters and rate.
SER_* | Serial port: * | Its speed.
TEL_* | Telemetry of radios: * | Port that it is at.
USB_* | USB: * | Which messages go there.
MXS_* | Sagetech transponder: * | Port and what it listens to.
CANNODE_* | CAN node: * | What it sends, while the board is one.
UWB_* | Ultra-wide band: * | Port, mounting and offset of its receiver.
PP_* | Rover, course: * | How far ahead it looks.
RA_* | Rover that steers: * | Of vehicles on the ground.
RM_* | Rover with mecanum wheels: * | Of vehicles on the ground.
RO_* | Rover: * | Speed and turning of vehicles on the ground.
ZENOH_* | Zenoh: * | Link to programs of ROS 2.
`;
