/**
 * ArduCopter 4.5 to 4.7: the board, links, logs and peripherals. The format is that of ../facts.ts; the texts are our
 * own.
 */

/** Each link's message rates in Hz, by the names of 4.7 (MAV) and before (SR). */
const streams = (prefix: string): string =>
  (
    [
      ['RAW_SENS', 'raw sensors'],
      ['EXT_STAT', 'states, battery and GPS'],
      ['RC_CHAN', 'radio and outputs'],
      ['RAW_CTRL', 'raw control'],
      ['POSITION', 'place'],
      ['EXTRA1', 'attitude'],
      ['EXTRA2', 'flight display'],
      ['EXTRA3', 'estimator, wind and others'],
      ['PARAMS', 'parameters'],
      ['ADSB', 'aircraft around'],
    ] as const
  )
    .map(
      ([suffix, of]) =>
        `${prefix}_${suffix} | Link #: ${of} | Messages a second by itself, unless a ground station asks for others.`,
    )
    .join('\n');

export const ARDUCOPTER_SYSTEM = `
// MAVLink
MAV_SYSID | MAVLink number of the drone | The system number that it speaks under. Behind the tower every drone may keep 1.
MAV_GCS_SYSID | MAVLink number of its ground station | Only this one's sticks and heartbeats count. Agent and console speak as 255.
MAV_GCS_SYSID_HI | Last number of its ground stations | Numbers from MAV_GCS_SYSID up to this count as its ground station; 0 for that one alone.
MAV_OPTIONS | MAVLink options | Whether other ground stations are left unread.
MAV_TELEM_DELAY | Links wait at the start | Time before the first message.
MAV#_OPTIONS | Link #: ways | Changes to the usual behaviour.
${streams('MAV#')}
GCS_PID_MASK | Loops told | Of which loops the parts are told while flying.
SERIAL_PASS# | Port handed through, end # | Two ports that are joined as if by a cable; -1 for none.
SERIAL_PASSTIMO | Handed through until | Seconds without traffic that end it; 0 for never.
NMEA_RATE_MS | NMEA: interval | Time between two sets of sentences.
NMEA_MSG_EN | NMEA: sentences | Which are sent.
MSP_OPTIONS | MSP: ways | What displays over MSP are told, and how.
MSP_OSD_NCELLS | MSP: cells | Cells of the battery; 0 as found by itself.
FRSKY_UPLINK_ID | FrSky: number for the way up | Sensor number that the radio speaks to.
FRSKY_DNLINK_ID | FrSky: number for the way down | Sensor number that the autopilot speaks under.
FRSKY_DNLINK#_ID | FrSky: further number # | Another sensor number for the way down.
FRSKY_OPTIONS | FrSky: ways | Changes to the usual behaviour.
NET_ENABLE | Network | Whether the board has a network; its other parameters appear then.
NET_P#_TYPE | Network port # | Protocol and side of port #; its other parameters appear then.
DID_ENABLE | Remote identification | Whether the drone says who it is by radio; its other parameters appear then.
RC_FS_TIMEOUT | Radio counts as lost after | Time without the radio.
RSSI_TYPE | Strength of the radio | Where it is measured.
VTX_ENABLE | Video transmitter | Whether the autopilot sets it; its other parameters appear then.

// Board
FORMAT_VERSION | Version of the memory | The autopilot's own; another number clears all parameters.
BRD_SERIAL_NUM | Number of the drone | Any number that its owner gives it.
BRD_SAFETY_MASK | Outputs without safety switch | Outputs that move while the safety switch is on.
BRD_SAFETYOPTION | Safety switch options | When its button does what.
BRD_RTC_TYPES | Clock is set by | Where the time of day may come from.
BRD_RTC_TZ_MIN | Time zone | Minutes from UTC.
BRD_VBUS_MIN | Minimum voltage of the board | Below it no arming; 0 for no check.
BRD_VSERVO_MIN | Minimum voltage of the servos | Below it no arming; 0 for no check.
BRD_OPTIONS | Board options | Watchdog, write protection and others.
BRD_BOOT_DELAY | Waits at the start | Time for sensors to come up.
BRD_SD_MISSION | Missions on the card | Room for them on the memory card; 0 for none there.
BRD_SD_FENCE | Fences on the card | Room for them on the memory card; 0 for none there.
CAN_D#_PROTOCOL | CAN driver #: protocol | What is spoken on the bus.
CAN_D#_PROTOCOL2 | CAN driver #: second protocol | Another one on the same bus, with short identifiers.
CAN_LOGLEVEL | CAN: how much it says | Which messages of the bus are kept.
STAT_BOOTCNT | Starts | How often it was switched on.
STAT_FLTTIME | Time in flight | Of all flights.
STAT_RUNTIME | Time switched on | Of all times.
STAT_RESET | Counted since | Seconds since 2016; 0 begins the counters anew.
STAT_FLTCNT | Flights | How many there were.
STAT_DISTFLWN | Distance flown | Of all flights.
SCR_ENABLE | Scripts | Whether scripts run on board; their other parameters appear then.
ARMING_OPTIONS | Arming options | Changes to the usual behaviour.
ARMING_NEED_LOC | Place needed | Whether no arming happens before the place is known.
BTN_ENABLE | Buttons | Whether buttons on the board's inputs are told; their other parameters appear then.

// Batteries
BATT_FS_VOLTSRC | Failsafe by | Whether the voltage under load counts, or that of the battery at rest.
BATT#_FS_VOLTSRC | Failsafe by | Whether the voltage under load counts, or that of the battery at rest.
BATT_OPTIONS | Battery options | Changes to the usual behaviour.
BATT_SERIAL_NUM | Number of the battery | Which of several on a bus; -1 for any.
BATT_VLT_OFFSET | Voltage offset | Volts that the measured voltage is off.
GEN_TYPE | Generator | Kind of generator on board.
EFI_TYPE | Engine | How an engine's computer is read; its other parameters appear then.

// Logs
LOG_FILE_BUFSIZE | Buffer of the card | Memory for records on their way to the card.
LOG_REPLAY | For replays | Whether all is logged that the estimator needs to run again.
LOG_MAV_BUFSIZE | Buffer of MAVLink | Memory for records on their way over a link.
LOG_FILE_TIMEOUT | Card counts as stuck after | Time after which writing to it ends.
LOG_FILE_MB_FREE | Room kept free | Old logs go when less is left.
LOG_FILE_RATEMAX | Most records, card | Of each kind that streams, a second; 0 for no limit.
LOG_MAV_RATEMAX | Most records, MAVLink | Of each kind that streams, a second; 0 for no limit.
LOG_BLK_RATEMAX | Most records, flash | Of each kind that streams, a second; 0 for no limit.
LOG_DARM_RATEMAX | Most records, disarmed | Of each kind that streams, a second; 0 for no limit.
LOG_MAX_FILES | Most logs | The oldest goes when there are more.

// Outputs
SERVO_RATE | Rate of the outputs | Pulses a second where nothing else sets it.
SERVO_VOLZ_MASK | Volz servos | Outputs that speak Volz.
SERVO_VOLZ_RANGE | Volz: range | Whole angle from 1000 to 2000.
SERVO_SBUS_RATE | S.Bus: rate | Frames a second on the S.Bus output.
SERVO_ROB_POSMIN | Robotis: lowest | Position at the lower end.
SERVO_ROB_POSMAX | Robotis: highest | Position at the upper end.
SERVO_FTW_MASK | FETtec ESCs | Outputs that speak FETtec.
SERVO_FTW_RVMASK | FETtec: reversed | Outputs whose motors turn the other way.
SERVO_FTW_POLES | FETtec: poles | Poles of the motors, to make turns of what the ESCs tell.
SERVO_DSHOT_RATE | DShot: rate | Frames for each loop; 0 for 1000 a second.
SERVO_DSHOT_ESC | DShot: kind of ESC | Which commands the ESCs take.
SERVO_GPIO_MASK | Outputs as pins | Outputs that switch and do not steer.
SERVO_RC_FS_MSK | At rest without radio | Outputs that pass the radio on, and go to their trim when it is lost.
SERVO_#_ENABLE | More outputs | Whether outputs above 16 can be set.
RELAY#_FUNCTION | Relay #: for | What switches it; its other parameters appear then.
RELAY#_PIN | Relay #: pin | Pin of the board that it is on; -1 for none.
RELAY#_DEFAULT | Relay #: at the start | How it is when the drone is switched on.
RELAY#_INVERTED | Relay #: inverted | Whether it is on when its pin is low.
RELAY_PIN | Relay 1: pin | Pin of the board that it is on; -1 for none.
RELAY_PIN# | Relay #: pin | Pin of the board that it is on; -1 for none.

// Lights, sounds and displays
NTF_LED_BRIGHT | Light: brightness | How bright the coloured light is.
NTF_LED_OVERRIDE | Light: who decides | Where its colour comes from.
NTF_LED_TYPES | Lights | Which kinds there are.
NTF_LED_LEN | Lights in a row | How many a serial row has.
NTF_BUZZ_TYPES | Sounds | Which kinds of buzzer there are.
NTF_BUZZ_PIN | Buzzer: pin | Pin of the board that it is on; -1 for none.
NTF_BUZZ_ON_LVL | Buzzer: level | Level of the pin at which it sounds.
NTF_BUZZ_VOLUME | Buzzer: loudness | 0 for silent.
NTF_DISPLAY_TYPE | Display | Kind of small display on the I2C bus.
OSD_TYPE | Picture display | What writes into the pilot's picture; its other parameters appear then.

// What is attached
CAM_AUTO_ONLY | By distance in missions alone | Whether photographs by distance are taken in AUTO alone.
CAM_MAX_ROLL | Photographs while level | No photograph at more roll; 0 for any.
CAM#_TYPE | Camera #: kind | How camera # is released; its other parameters appear then.
MNT#_TYPE | Gimbal #: kind | Which gimbal it is; its other parameters appear then.
CHUTE_ENABLED | Parachute | Whether there is one; its other parameters appear then.
LGR_ENABLE | Landing gear | Whether there is one that moves; its other parameters appear then.
GRIP_ENABLE | Gripper | Whether there is one; its other parameters appear then.
SPRAY_ENABLE | Sprayer | Whether there is one; its other parameters appear then.
WINCH_TYPE | Winch | Kind of winch; its other parameters appear then.
`;
