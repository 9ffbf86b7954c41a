/** ArduCopter 4.5 to 4.7: estimator and sensors. The format is that of ../facts.ts; the texts are our own. */

const AXES = ['X', 'Y', 'Z'] as const;
const WHERE = { X: 'forward', Y: 'to the right', Z: 'down' } as const;

/** One line for each axis; `@` is the axis, `~` its direction. */
const axes = (line: string): string =>
  AXES.map((axis) => line.replaceAll('@', axis).replaceAll('~', WHERE[axis])).join('\n');

export const ARDUCOPTER_SENSORS = `
// Estimator
EK2_ENABLE | Older estimator | Whether the estimator before EKF3 runs beside it.
EK3_VELNE_M_NSE | GPS speed over ground: noise | Minimum error that the speed is taken to have; more of it trusts it less.
EK3_VELD_M_NSE | GPS climb rate: noise | Minimum error that the climb rate is taken to have; more of it trusts it less.
EK3_VEL_I_GATE | GPS speed: gate | How far off a speed may be before it is refused, in hundredths of its spread.
EK3_POSNE_M_NSE | GPS place: noise | Minimum error that the place is taken to have; more of it trusts it less.
EK3_POS_I_GATE | GPS place: gate | How far off a place may be before it is refused, in hundredths of its spread.
EK3_GLITCH_RAD | GPS jump | How unsure its own place may become before the estimator starts again from the GPS.
EK3_ALT_M_NSE | Height: noise | Error that heights are taken to have; more of it trusts them less.
EK3_HGT_I_GATE | Height: gate | How far off a height may be before it is refused, in hundredths of its spread.
EK3_HGT_DELAY | Height: delay | How late heights come.
EK3_MAG_M_NSE | Compass: noise | Error that the compass is taken to have; more of it trusts it less.
EK3_MAG_CAL | Compass: when in three axes | When the whole magnetic field is learned, and not the heading alone used.
EK3_MAG_I_GATE | Compass: gate | How far off the compass may be before it is refused, in hundredths of its spread.
EK3_MAG_MASK | Compass: heading alone | Which lanes use the heading of the compass and nothing else.
EK3_MAG_EF_LIM | Compass: field of the earth | How far the learned field may be from the earth's known one; 0 for no limit.
EK3_MAGE_P_NSE | Field of the earth: drift | How fast its estimate may change.
EK3_MAGB_P_NSE | Field of the drone: drift | How fast its estimate may change.
EK3_EAS_M_NSE | Airspeed: noise | Error that airspeed is taken to have; more of it trusts it less.
EK3_EAS_I_GATE | Airspeed: gate | How far off airspeed may be before it is refused, in hundredths of its spread.
EK3_RNG_M_NSE | Range finder: noise | Error that it is taken to have; more of it trusts it less.
EK3_RNG_I_GATE | Range finder: gate | How far off it may be before it is refused, in hundredths of its spread.
EK3_RNG_USE_HGT | Range finder for height below | Part of its maximum range below which height comes from it; -1 for never.
EK3_RNG_USE_SPD | Range finder for height: speed | Height comes from it below this speed over ground.
EK3_TERR_GRAD | Slope of the ground | Steepest slope to be expected.
EK3_MAX_FLOW | Optical flow: maximum | Faster flow is not used.
EK3_FLOW_M_NSE | Optical flow: noise | Error that it is taken to have; more of it trusts it less.
EK3_FLOW_I_GATE | Optical flow: gate | How far off it may be before it is refused, in hundredths of its spread.
EK3_FLOW_DELAY | Optical flow: delay | How late it comes.
EK3_FLOW_USE | Optical flow is for | Whether it is used for speed, for the height of the ground, or not.
EK3_GYRO_P_NSE | Gyros: noise | Error that they are taken to have; more of it trusts other sensors more.
EK3_ACC_P_NSE | Accelerometers: noise | Error that they are taken to have; more of it trusts other sensors more.
EK3_GBIAS_P_NSE | Gyro bias: drift | How fast its estimate may change.
EK3_ABIAS_P_NSE | Accelerometer bias: drift | How fast its estimate may change.
EK3_ACC_BIAS_LIM | Accelerometer bias: maximum | Its estimate stays within this.
EK3_WIND_P_NSE | Wind: drift | How fast its estimate may change.
EK3_WIND_PSCALE | Wind: drift with climb | How much faster it may change while climbing or sinking.
EK3_GPS_CHECK | GPS checks | What must be well before GPS is used.
EK3_CHECK_SCALE | GPS checks: scale | 100 for the usual limits; more of it is laxer.
EK3_GPS_VACC_MAX | GPS height: worst accuracy | GPS gives no height while it is less sure than this; 0 for no check.
EK3_NOAID_M_NSE | Without a place: drift | How far the drone may be taken to drift while no sensor tells where it is.
EK3_BETA_MASK | Sideslip | When it is assumed that there is none: for vehicles with wings.
EK3_YAW_M_NSE | Heading: noise | Error that the heading is taken to have; more of it trusts it less.
EK3_YAW_I_GATE | Heading: gate | How far off the heading may be before it is refused, in hundredths of its spread.
EK3_TAU_OUTPUT | Smoothing of the output | Time in which the output follows the filter.
EK3_HRT_FILT | Climb rate: filter | Below this frequency the climb rate follows the height sensor, above it the accelerometers.
EK3_BCN_M_NSE | Beacons: noise | Error that their ranges are taken to have; more of it trusts them less.
EK3_BCN_I_GTE | Beacons: gate | How far off a range may be before it is refused, in hundredths of its spread.
EK3_BCN_DELAY | Beacons: delay | How late their ranges come.
EK3_OGN_HGT_MASK | Correction of the origin's height | When the height of the origin is corrected by GPS.
EK3_VIS_VERR_MIN | Visual odometry: minimum error | Error of its speed at its best quality.
EK3_VIS_VERR_MAX | Visual odometry: maximum error | Error of its speed at its worst quality.
EK3_WENC_VERR | Wheel odometry: error | Error that its speed is taken to have.
EK3_GSF_RUN_MASK | Heading by flight runs in | Which lanes estimate the heading from how the drone flies.
EK3_GSF_USE_MASK | Heading by flight is used in | Which lanes may use that heading.
EK3_GSF_RST_MAX | Heading by flight: how often | How often the heading may be set anew by it.
EK3_ERR_THRESH | Change of lane | How much better another lane must be for a while.
EK3_AFFINITY | Lanes and sensors | Which sensors each lane takes its own of.
EK3_SRC_OPTIONS | Source options | How the sources of speed are used together.
EK3_DRAG_BCOEF_X | Drag forward | Mass by drag along the nose; with the next two it lets the wind be estimated.
EK3_DRAG_BCOEF_Y | Drag sideways | Mass by drag across the nose.
EK3_DRAG_MCOEF | Drag of the propellers | How much they brake as the air comes.
EK3_DRAG_M_NSE | Drag: noise | Error that the acceleration of drag is taken to have.
EK3_OGNM_TEST_SF | At rest: scale | More of it lets the drone count as at rest with more vibration.
EK3_GND_EFF_DZ | Ground effect: dead zone | Pressure errors of this size near the ground are passed over.
EK3_PRIMARY | First lane | Lane that is flown by from the start.
EK3_LOG_LEVEL | How much it logs | Which of the estimator's records a log has.
EK3_OPTIONS | EKF3 options | Changes to the usual behaviour.
AHRS_GPS_GAIN | Simple estimator: GPS | How much GPS corrects the attitude of the simple estimator.
AHRS_GPS_USE | Simple estimator: place | Whether the simple estimator takes place and height from GPS.
AHRS_YAW_P | Simple estimator: heading | How fast its heading follows compass or GPS.
AHRS_RP_P | Simple estimator: level | How fast the accelerometers correct its attitude.
AHRS_WIND_MAX | Most wind | Maximum difference between airspeed and speed over ground that is believed; 0 for any.
AHRS_TRIM_Z | Level trim: yaw | Not used.
AHRS_COMP_BETA | Simple estimator: speed | How airspeed and GPS speed are mixed.
AHRS_GPS_MINSATS | Simple estimator: satellites | Fewer than this, and GPS does not correct the attitude.
AHRS_OPTIONS | AHRS options | What happens when the chosen estimator fails.

// Inertial sensors
${axes('INS_ACCOFFS_@ | Accelerometer: offset @ | Found by calibration.')}
${axes('INS_ACCSCAL_@ | Accelerometer: scale @ | Found by calibration.')}
${axes('INS_GYROFFS_@ | Gyro: offset @ | Found at the start, while the drone stands still.')}
${axes('INS_GYR#OFFS_@ | Gyro #: offset @ | Found at the start, while the drone stands still.')}
${axes('INS_ACC#OFFS_@ | Accelerometer #: offset @ | Found by calibration.')}
${axes('INS_ACC#SCAL_@ | Accelerometer #: scale @ | Found by calibration.')}
${axes('INS_POS#_@ | Inertial sensor #: place @ | How far ~ of the centre it is mounted.')}
INS_ACC_ID | Accelerometer: identity | Which sensor the calibration belongs to.
INS_ACC#_ID | Accelerometer #: identity | Which sensor the calibration belongs to.
INS_GYR_ID | Gyro: identity | Which sensor the calibration belongs to.
INS_GYR#_ID | Gyro #: identity | Which sensor the calibration belongs to.
INS_ACC#_CALTEMP | Accelerometer #: temperature | At which it was calibrated.
INS_GYR#_CALTEMP | Gyro #: temperature | At which it was calibrated.
INS_USE | Inertial sensor 1 | Whether it is used for flying.
INS_USE# | Inertial sensor # | Whether it is used for flying.
INS_ENABLE_MASK | Inertial sensors at all | Which are started; those left out cannot be used.
INS_STILL_THRESH | At rest | Vibration below which the drone counts as standing still.
INS_GYR_CAL | Gyros are calibrated | When that is done by itself.
INS_TRIM_OPTION | Calibration sets the trim | From which position of the calibration the level trim is taken.
INS_ACC_BODYFIX | Sensor fixed to the frame | Which accelerometer's level is the drone's.
INS_FAST_SAMPLE | Fast sampling | Which sensors are read as fast as they can be.
INS_GYRO_RATE | Fast sampling: rate | How often such gyros are filtered.
INS_LOG_BAT_CNT | Raw records: length | Samples in a batch, for a look at vibration.
INS_LOG_BAT_MASK | Raw records: of | Sensors that batches are logged of; 0 for none.
INS_LOG_BAT_OPT | Raw records: how | Before or after the filters, at which rate.
INS_LOG_BAT_LGIN | Raw records: pause | Time between two parts of a batch going to the log.
INS_LOG_BAT_LGCT | Raw records: part | Samples that go to the log at once.
INS_RAW_LOG_OPT | Raw log of gyros | Which gyros are logged raw, before or after the filters.
INS_HNTC#_ENABLE | Harmonic notch # | Whether a notch damps the motors' vibration; its other parameters appear then.
INS_TCAL#_ENABLE | Temperature calibration # | Whether sensor # is corrected by its temperature, or learns that.
INS_TCAL_OPTIONS | Temperature calibration: ways | Whether it outlives new firmware.
TCAL_ENABLED | Temperature of the barometer | Whether pressure is corrected by the board's temperature, or that is learned.
FILT#_TYPE | Filter # | Kind of filter that loops can use; its other parameters appear then.
FFT_ENABLE | Frequency analysis | Whether vibration is analysed in flight; its other parameters appear then.
CUST_ROT_ENABLE | Rotations of one's own | Whether mountings at any angle can be set.

// Compass
COMPASS_DEC | Declination | Angle between true and magnetic north; found by itself unless COMPASS_AUTODEC says no.
${axes('COMPASS_OFS_@ | Compass: offset @ | Takes out the magnetism of the drone; found by calibration.')}
${axes('COMPASS_OFS#_@ | Compass #: offset @ | Takes out the magnetism of the drone; found by calibration.')}
${axes('COMPASS_DIA_@ | Compass: scale @ | Takes out how iron bends the field; found by calibration.')}
${axes('COMPASS_DIA#_@ | Compass #: scale @ | Takes out how iron bends the field; found by calibration.')}
${axes('COMPASS_ODI_@ | Compass: skew @ | Takes out how iron turns the field; found by calibration.')}
${axes('COMPASS_ODI#_@ | Compass #: skew @ | Takes out how iron turns the field; found by calibration.')}
${axes('COMPASS_MOT_@ | Compass: motors @ | Field of the motors by throttle or current; found by a test with running motors.')}
${axes('COMPASS_MOT#_@ | Compass #: motors @ | Field of the motors by throttle or current; found by a test with running motors.')}
COMPASS_MOTCT | Motors' field by | Whether it is taken out by throttle or by current.
COMPASS_PMOT_EN | Field of each motor | Whether it is taken out for each motor by itself.
COMPASS_DEV_ID | Compass: identity | Which sensor the calibration belongs to.
COMPASS_DEV_ID# | Compass #: identity | Which sensor the calibration belongs to.
COMPASS_PRIO#_ID | Compass of rank # | Identity of the compass that is used in place #.
COMPASS_EXTERNAL | Compass is outside | Whether it is mounted away from the board.
COMPASS_EXTERN# | Compass # is outside | Whether it is mounted away from the board.
COMPASS_ORIENT# | Compass #: mounted | How it is turned to the nose, if it is outside.
COMPASS_SCALE | Compass: scale | By what its field is multiplied; 0 for no change.
COMPASS_SCALE# | Compass #: scale | By what its field is multiplied; 0 for no change.
COMPASS_CAL_FIT | Calibration: how strict | The lower, the better a calibration must fit.
COMPASS_OFFS_MAX | Maximum offset | Calibrations with more are refused.
COMPASS_DISBLMSK | Compasses not looked for | Kinds of compass that are not started.
COMPASS_FLTR_RNG | Outliers | Samples further from the average, in percent, are left out; 0 for none.
COMPASS_AUTO_ROT | Mounting found by itself | Whether a calibration finds how the compass is turned.
COMPASS_OPTIONS | Compass options | Changes to the usual behaviour.
ARMING_MAGTHRESH | Compass before arming | How far its field may be from the earth's; 0 for no check.

// Height and ground
BARO_ALT_OFFSET | Height offset | Metres added to the height by pressure, for weather that changed since the start.
BARO_GND_TEMP | Temperature on the ground | As somebody has measured it; 0 for the sensor's.
BARO_PRIMARY | First barometer | Which one is used.
BARO_EXT_BUS | Barometer outside | Bus of a barometer on I2C; -1 for none.
BARO_FLTR_RNG | Outliers | Samples further from the average, in percent, are left out; 0 for none.
BARO_PROBE_EXT | Barometers looked for | Kinds of barometer outside that are looked for.
BARO_FIELD_ELV | Height of the field | Above the sea, as somebody knows it; 0 for the GPS's.
BARO_ALTERR_MAX | Against GPS | Maximum difference between both heights before arming; 0 for no check.
BARO_OPTIONS | Barometer options | Changes to the usual behaviour.
BARO#_GND_PRESS | Barometer #: pressure | On the ground; measured at the start.
BARO#_DEVID | Barometer #: identity | Which sensor it is.
BARO#_WCF_ENABLE | Barometer #: wind | Whether wind is taken out of its pressure; its other parameters appear then.
RNGFND_FILT | Filter | Above this frequency distances are damped; 0 for none.
RNGFNDA_TYPE | Kind (range finder 10) | Kind of the tenth range finder.
PRX#_TYPE | Sensors around: kind # | What looks around the drone; its other parameters appear then.
PRX_IGN_GND | Ignores the ground | Whether what is near the ground below does not count.
PRX_LOG_RAW | Raw distances in the log | Whether they are logged before the filter.
PRX_FILT | Filter | Above this frequency distances around are damped.
PRX_ALT_MIN | Looks around above | Height below which distances around do not count.
TERRAIN_SPACING | Grid of the ground | Metres between two points of the map of heights.
TERRAIN_OPTIONS | Terrain options | Whether the autopilot asks for no heights of the ground.
TERRAIN_MARGIN | Grid: margin | How far a grid of another distance may be off and is still taken.
TERRAIN_OFS_MAX | Height of home: correction | As far as the map is moved so that the drone stands on it.
TERRAIN_CACHE_SZ | Blocks in memory | How much of the map is kept in memory.
ARSPD_ENABLE | Airspeed | Whether there is a sensor; its other parameters appear then.
BCN_TYPE | Beacons | Kind of beacons for the place; their other parameters appear then.
VISO_TYPE | Visual odometry | What camera tells how the drone moves; its other parameters appear then.
EAHRS_TYPE | Estimator outside | Which device estimates attitude and place in place of the autopilot.
PLND_ENABLED | Precise landing | Whether a sensor leads to the landing mark; its other parameters appear then.
RPM#_TYPE | Turns #: kind | What measures turns; its other parameters appear then.
TEMP#_TYPE | Temperature #: kind | Sensor of temperature; its other parameters appear then.
TEMP_LOG | Temperatures in the log | Which are logged.

// Satellites
GPS_NAVFILTER | How it moves | Motion that the receiver reckons with.
GPS_SBAS_MODE | SBAS | Whether correction satellites are used.
GPS_MIN_ELEV | Lowest satellite | Angle above the horizon; lower ones are not used. -100 leaves it to the receiver.
GPS_INJECT_TO | Corrections go to | Which receiver gets corrections from a ground station.
GPS_SBP_LOGMASK | Swift messages in the log | Which messages of a Swift receiver are logged.
GPS_RAW_DATA | Raw data in the log | When raw measurements are logged.
GPS_SAVE_CFG | Settings kept in the receiver | Whether the receiver is told to keep its settings.
GPS_AUTO_CONFIG | Sets up the receiver | Whether the autopilot does that.
GPS_BLEND_MASK | Mixed by | Which accuracies decide how two receivers are mixed.
GPS_DRV_OPTIONS | GPS driver options | Changes to the usual behaviour.
GPS_PRIMARY | First receiver | Which one is used unless it is chosen by itself.
GPS#_GNSS_MODE | Receiver #: systems | Satellite systems that it uses; 0 as it is.
GPS#_RATE_MS | Receiver #: interval | Time between two places.
${axes('GPS#_POS_@ | Antenna #: place @ | How far ~ of the centre it is mounted.')}
GPS#_DELAY_MS | Receiver #: delay | How late its places come; 0 for the known delay of its kind.
GPS#_COM_PORT | Receiver #: its own port | Port of the receiver that talks with the autopilot.
GPS#_MB_TYPE | Receiver #: heading by two | Whether two antennas give the heading.
GPS#_CAN_NODEID | Receiver #: node | Node that it was found at on the CAN bus.
GPS#_CAN_OVRIDE | Receiver #: wanted node | Node that it shall be; 0 for the first one.
`;
