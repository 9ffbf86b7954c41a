"""Choices and bits of parameters: published labels are names in many styles; sentences among them are in our words.

What is a name (a sensor, a protocol, a mode) stays one. Nothing else of a published description is taken.
"""

import re
from typing import Final

from parameter_labels_px4 import of_px4

LONGEST: Final = 4
"""Words that a name has at the most. What has more needs an entry in OURS, or loses its brackets and what follows."""

WORDS: Final = {
    "disabled": "Off",
    "disable": "Off",
    "enabled": "On",
    "enable": "On",
    "none": "None",
    "rtl": "Return",
    "smartrtl": "Return the way it came",
    "smart rtl": "Return the way it came",
    "althold": "Altitude hold",
    "alt hold": "Altitude hold",
    "alt_hold": "Altitude hold",
    "poshold": "Position hold",
    "auto rtl": "Auto return",
    "always rtl": "Return",
    "do nothing": "Nothing",
    "undefined": "Not set",
    "unassigned": "Not set",
    "notused": "Not used",
    "rcpassthru": "As the radio says",
}

OURS: Final = {
    "Accept MAVLink only from system IDs given by MAV_SYSID_GCS and MAV_SYSID_GCS_HI": "Only its own ground stations",
    "Add leading zero byte to requests": "Zero byte before requests",
    "Allow DroneCAN InfoAux to be from a different CAN node": "DroneCAN battery details from another node",
    "Allow DroneCAN dynamic node update on hot-swap": "DroneCAN node may change in flight",
    "Allow Precision Landing after manual reposition": "Precise landing after moving by hand",
    "Allow Takeoff Without Raising Throttle": "Take-off without raising the throttle",
    "Allow fast waypoints (Dijkastras only)": "Fast waypoints (Dijkstra)",
    "Allow missing DroneCAN compasses to be automaticaly replaced (calibration still required)": (
        "A missing DroneCAN compass may be replaced"
    ),
    "Allow union of inclusion areas": "Inside any area is inside",
    "Annotate CRSF flight mode with * on disarm": "CRSF: mode with * while disarmed",
    "Apply corrections to local position": "Local place corrected as well",
    "Arming check throttle for 0 input": "Throttle must be at its lowest",
    "Assume ACC_BODYFIX is perfectly aligned to the vehicle": "INS_ACC_BODYFIX is level with the drone",
    "Assume first orientation was level": "First position was level",
    "Auto DO_LAND_START/DO_RETURN_PATH_START or RTL": "Auto from its landing start, else return",
    "AutoEnableDisableFloorOnLanding": "On in flight, without the floor for landing",
    "AutoEnableOnlyWhenArmed": "On while armed",
    "Battery is for internal autopilot use only": "For the autopilot alone",
    "Clear all configurations not set by ardupilot (UBlox only)": "u-blox forgets other settings",
    "Continue if in Auto on GCS failsafe": "Ground station lost: goes on in Auto",
    "Continue if in Auto on RC failsafe": "Radio lost: goes on in Auto",
    "Continue if in Guided on RC failsafe": "Radio lost: goes on in Guided",
    "Continue if in pilot controlled modes on GCS failsafe": "Ground station lost: goes on by hand",
    "Continue if landing on any failsafe": "Goes on landing at any failsafe",
    "Convert feet to miles at 5280ft instead of 10000ft": "Miles from 5280 ft on",
    "Correct when using Baro height": "While height is by pressure",
    "Correct when using range finder height": "While height is by range finder",
    "Crash Dump arming check active": "Arms only without a crash dump",
    "Crash Dump arming check deactivated": "Arms with a crash dump",
    "DevOptionVFR_HUDRelativeAlt": "VFR_HUD tells the height above home",
    "Disable automatic full RTCM parsing when RTCM seen on more than one channel": (
        "RTCM of several links is not parsed"
    ),
    "Disable board arming gpio output change on arm/disarm": "Arming pin stays as it is",
    "Disable heap expansion on allocation failure": "Memory of scripts does not grow",
    "Disable mode change following fence action until fence breach is cleared": "No other mode until it is back inside",
    "Discard log on reboot if never armed": "A log without arming is dropped",
    "Do not calibrate on start up. Manual calibration must be performed once per boot.": "By hand after each start",
    "Do not land (just Hover) (Very Strict)": "Hovers, never lands",
    "Do not require offset calibration before flight. Manual calibration should be performed during initial setup.": (
        "Not before each flight"
    ),
    "Do not send status text on state change": "No texts about changes",
    "Do not stabilize PositionXY": "Place is not held",
    "Do not stabilize VelocityXY": "Speed is not held",
    "Don't forward mavlink to/from (moved to MAVn_OPTIONS >4.7)": "Forwards no MAVLink (until 4.6)",
    "Enable RTCM full parse even for a single channel": "RTCM of one link is parsed too",
    "Enable automatic configuration for DroneCAN as well": "DroneCAN as well",
    "Enable automatic configuration for Serial GPSes only": "Serial receivers only",
    "Enable set of internal parameters": "Further parameters appear",
    "Enabled Auto DO_LAND_START/DO_RETURN_PATH_START or RTL": "Auto from its landing start, else return",
    "Enabled Continue with Mission in Auto Mode (Removed in 4.0+)": "Goes on with the mission (before 4.0)",
    "RTL or Continue with Mission in Auto Mode (Removed in 4.0+-see FS_OPTIONS)": (
        "Return; a mission goes on (before 4.0)"
    ),
    "Enabled always Brake or Land": "Brake, else land",
    "Brake or Land": "Brake, else land",
    "SmartRTL or RTL": "Return the way it came, else return",
    "SmartRTL or Land": "Return the way it came, else land",
    "Enabled always SmartRTL or Land": "Return the way it came, else land",
    "Enabled always SmartRTL or RTL": "Return the way it came, else return",
    "External yaw sensor with compass fallback (Deprecated in 4.1+ see EK3_SRCn_YAW)": (
        "Outside heading, else compass (before 4.1)"
    ),
    "Use external yaw sensor (Deprecated in 4.1+ see EK3_SRCn_YAW)": "Outside heading (before 4.1)",
    "Face next waypoint except RTL": "Next waypoint, but not on return",
    "Force FPV (bf) lock on roll and pitch": "Roll and pitch always fixed to the drone",
    "Force UBlox Config Get/Set for configuration then automatic configuration for Serial GPSes only": (
        "Serial receivers; u-blox by its older commands"
    ),
    "Force safety on when the aircraft disarms": "Safety switch on after disarming",
    "Go to the last location where landing target was detected": "Where the mark was seen last",
    "Go towards the approximate location of the detected landing target": "About where the mark should be",
    "Ignore Receiver Failsafe bit but allow other RC failsafes if setup": "Receiver's own failsafe bit does not count",
    "Ignore Streamrate (moved to MAVn_OPTIONS >4.7)": "Stream rates are not set (until 4.6)",
    "Ignore status updates in CRSF and blindly set VTX options": "CRSF: sets without looking",
    "LockUASIDOnFirstBasicIDRx": "Keeps the first identification",
    "Log only instances with sensor source set to None": "Only sensors without a use",
    "Log only unsupported AIVDM messages": "Only AIVDM that is not understood",
    "Maintain high speed in final descent": "Stays fast to the ground",
    "Make Mount ROI the center of the circle": "Camera looks at the centre",
    "Mount Follows lead vehicle on mode enter": "Gimbal looks at the leader",
    "No Scripts to run message if all scripts have stopped": "Says when all scripts have ended",
    "No change in camera selection": "Camera as it is",
    "Nose or tail into wind": "Nose or tail into the wind",
    "Only log every five samples (uBlox only)": "Every fifth sample (u-blox)",
    "Only use during takeoffs or landing see weathervane takeoff and land override parameters": (
        "At take-off and landing only"
    ),
    "Optflow may use terrain alt": "Optical flow may use the map of heights",
    "Override GPS satellite health of L5 band from L1 health": "L5 counts as healthy as L1",
    "Prefix LQ with RF Mode": "Link quality with radio mode",
    "RC lock state from previous mode": "Lock as it was",
    "RC pitch and roll control radius and rate": "Sticks change radius and rate",
    "Rate D/Rate P(incl max gain)": "Rate P and D, to the most",
    "Recording Starts at arming and stops at disarming": "Records while armed",
    "Relative to alternate GPS instance": "To the other receiver",
    "Relative to lead vehicle heading": "To the leader's heading",
    "Release gripper on thrust loss": "Gripper opens when a motor fails",
    "Resume if AUTO else Loiter": "Goes on in Auto, else loiter",
    "Retry if stuck (Daiwa only)": "Tries again when stuck (Daiwa)",
    "Return to neutral angles on RC failsafe": "Neutral when the radio is lost",
    "Runtime messages for memory usage and execution time": "Messages about memory and time",
    "Save CRC of current scripts to loaded and running checksum parameters enabling pre-arm": (
        "Keeps these scripts as the right ones"
    ),
    "Send HIGH and NORMAL importance items": "Important and usual items",
    "Send only HIGH importance items": "Important items only",
    "Send resistance compensated voltage to GCS": "Tells the voltage at rest",
    "Sensor-Rate Logging (sample at full sensor rate seen by AP)": "At the sensor's own rate",
    "SetAttitudeTarget interprets Thrust As Thrust": "SET_ATTITUDE_TARGET: thrust is thrust",
    "Skip IMU consistency checks when ICE motor running": "Sensors are not compared while an engine runs",
    "Skip the arming check for neutral Roll/Pitch/Yaw sticks": "Sticks need not be centred",
    "SmartRTL or RTL or Land": "Return the way it came, else return, else land",
    "Squawk 7400 on GCS failsafe": "7400 when the ground station is lost",
    "Squawk 7400 on RC failsafe": "7400 when the radio is lost",
    "Start at center rather than on perimeter": "Begins in the centre",
    "Start-up and automatically calibrate ESCs": "Calibrates the ESCs at the next start",
    "Start-up in ESC Calibration mode if throttle high": "Calibration when the throttle is up",
    "Start-up in ESC Calibration mode regardless of throttle": "Calibration at the next start",
    "Stop logging when disarmed (SBF only)": "Ends with disarming (SBF)",
    "Sum monitor measures minimum voltage instead of average": "Sum tells the lowest voltage",
    "Suppress CRSF mode/rate message for ELRS systems": "No CRSF texts about rates (ELRS)",
    "Suppress logging scripts to dataflash": "Scripts are not logged",
    "Switch to AltHold mode if current mode requires position": "Altitude hold where the mode needs a place",
    "Switch to Land mode from all modes": "Land from any mode",
    "Switch to Land mode if current mode requires position": "Land where the mode needs a place",
    "Test autotuned gains after tune is complete": "New gains at once after tuning",
    "Transmit in traditional Mode 3A/C only and inhibit Mode-S and ES (ADSB) transmissions": "Mode A and C only",
    "Use 1 stop-bit in SmartAudio": "SmartAudio: one stop bit",
    "Use 420kbaud for ELRS protocol": "420000 baud for ELRS",
    "Use GPS for DCM position": "Place",
    "Use GPS for DCM position and height": "Place and height",
    "Use Link Quality for RSSI with CRSF": "CRSF: strength is link quality",
    "Use UART2 for moving baseline on ublox": "u-blox: corrections by its second port",
    "Use base station for GPS yaw on SBF": "SBF: heading by a base station",
    "Use baudrate 115200 on ublox": "u-blox: 115200 baud",
    "Use dedicated CAN port b/w GPSes for moving baseline": "Corrections by a CAN bus of their own",
    "Use ellipsoid height instead of AMSL": "Heights above the ellipsoid",
    "Use min freq on RPM source failure": "Lowest frequency when turns are unknown",
    "Use passthrough for CRSF telemetry": "CRSF: passthrough telemetry",
    "Use pitch when nose or tail-in for faster weathervaning": "Pitch counts too",
    "Use primary if 3D fix or better": "The first one while it has a 3D fix",
    "Use safety pins as profiled": "Safety pins as the board has them",
    "UseRecordedOriginForNonGPS": "Origin from before, without GPS",
    "Vector Nav use uncompensated values for accel gyro and mag": "VectorNav: raw sensors",
    "Voltage compensation uses raw voltage": "Thrust corrected by the raw voltage",
    "Waypoint navigation used for position targets": "Targets are flown to as waypoints",
    "Write protect bootloader flash on reboot": "Protects the boot loader",
    "Write protect firmware flash on reboot": "Protects the firmware",
    "forward mavlink packets that don't pass CRC": "Forwards frames with a wrong checksum",
    "hold open forever after release": "Stays open",
    "log runtime memory usage and execution time": "Logs memory and time",
    "select screen based on pwm ranges specified for each screen": "Page by the channel's range",
    "skip disarm before parachute release": "Parachute without disarming first",
    "switch to next screen after low to high transition and every 1s while channel value is high": (
        "Next page each second while high"
    ),
    "switch to next screen if channel value was changed": "Next page when the channel changes",
    "use same tolerance to auto rotate 45 deg rotations": "Mountings at 45 degrees found as strictly",
    "AlignExtNavPosWhenUsingOptFlow": "Outside place follows optical flow",
    "DontDisableAirspeedUsingEKF": "The estimator does not switch airspeed off",
    "All Channels neutral except Throttle is 950us": "Neutral, throttle 950 us",
    "Continue the mission even after comms are recovered "
    "(does not go to the mission item at the time comms were lost)": ("Stays on the way back when the link returns"),
    "Demix heli servos and send roll/pitch/collective/yaw": "Roll, pitch, collective and yaw unmixed",
    "Enable AFS for all autonomous modes (not just AUTO)": "In all modes that fly by themselves",
    "GPS 2D vel and 2D pos": "Speed and place over ground",
    "GPS 3D Vel and 2D Pos": "Speed in three axes, place over ground",
    "MPPT reports input voltage and current": "Tells voltage and current of the input",
    "Option to not jump to AFS_WP_COMMS if already in the return path": "No jump to AFS_WP_COMMS on the way back",
    "Read data from file and stop on EOF": "From a file, to its end",
    "SendPosAsNamedValueFloat": "Tells the place by NAMED_VALUE_FLOAT",
    "Swap first 4 and last 4 servos": "First four and last four exchanged",
    "2D + Terrain: Maintain constant altitude relative to terrain below and track XY position": (
        "Height above the ground below"
    ),
    "2D Tracking: Maintain constant altitude relative to home and track XY position only": "Height above home",
    "3D tracking: Maintain constant altitude relative to target altitude and track XY position": (
        "Height above who is followed"
    ),
    "Abort if terrain is not found (only allow mission landings)": "Aborts in missions without the ground in sight",
    "Apply the estimated scale after disarm": "Taken over after disarming",
    "Apply the estimated scale in air": "Taken over in flight",
    "Apply the new gains after disarm": "Taken over after disarming",
    "Apply the new gains in air": "Taken over in flight",
    "WARNING Apply the new gains in air": "Taken over in flight",
    "Do not apply the new gains (logging only)": "Logged only",
    "Do not automatically apply the estimated scale": "Not taken over",
    "Calculate landing glide slope relative to the terrain estimate": "Glide slope above the ground in sight",
    "Use the terrain estimate to trigger the flare": "Flare by the ground in sight",
    "Close the loop with gps speed": "By the speed of the GPS",
    "Enable airspeed setpoint via sticks in altitude and position flight mode": "Sticks set the airspeed",
    "Enabled if distance to ground above MPC_LAND_ALT1": "Above MPC_LAND_ALT1",
    "Enabled if distance to ground above MPC_LAND_ALT2": "Above MPC_LAND_ALT2",
    "Enforce Open Drone ID system presence": "No arming without Open Drone ID",
    "Only climb to at least RTL_DESCEND_ALT above destination": "To RTL_DESCEND_ALT above the goal",
    "Remove first failed motor from effectiveness": "Flies without the first motor that fails",
    "Require a takeoff and a landing": "Take-off and landing",
    "Require both a takeoff and a landing": "Take-off and landing",
    "Return to closest safe point other than home (mission landing pattern or rally point), via direct path": (
        "Straight to the nearest landing or rally point"
    ),
    "Save EKF2_MAG_DECL on disarm": "Kept with disarming",
    "Skip the controller and feedthrough the setpoints": "Goes past the controller",
}


ONE_WORD: Final = frozenset({"BeiDou", "NavIC", "DShot", "BLHeli", "SmartAudio", "DroneCAN", "MAVLink", "AirSpeed"})
"""Not taken apart."""


def label(published: str, *, identifier: bool = False) -> str:
    """What a choice or a bit is called here: one line without the signs that our lists are made of.

    `identifier`: several words may be written as one, as bits of ArduPilot are.
    """
    text = published.strip().strip(".")
    ours = of_px4(published.strip()) or OURS.get(published.strip()) or OURS.get(text) or WORDS.get(text.lower())
    if ours is None:
        ours = _name(text, identifier=identifier)
    return ours.replace("|", "/").replace(",", ";")


def _name(text: str, *, identifier: bool) -> str:
    words = text
    if identifier and " " not in text and text not in ONE_WORD:
        words = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z]{2})", " ", text.replace("_", " "))
    words = re.sub(r"\s+", " ", words).strip()
    if len(words.split()) > LONGEST:
        words = re.sub(r"\s*\([^)]*\)", "", words).partition(",")[0].strip() or words
    return words[:1].upper() + words[1:]
