// SPDX-License-Identifier: Apache-2.0
// The messages of `fbvins live --source socket:PATH`, for programs that send sensor data. C and C++; needs no other header of
// FB-VINS.
// docs/socket.md says what is sent when; examples/socket_sender.cpp is an example.
//
//   int connection = socket(AF_UNIX, SOCK_SEQPACKET, 0);          // every message is one packet
//   connect(connection, ...);
//   send a FbvinsSocketHello, with the images' memory as SCM_RIGHTS; wait for FbvinsSocketWelcome
//   send FbvinsSocketImu and FbvinsSocketFrame as the sensors deliver, take FbvinsSocketReleased, FbvinsSocketStatus,
//   FbvinsSocketMap
//
// Numbers are in this machine's byte order (both ends run on it). All fields are at multiples of their size: no padding.
// Reserved fields are 0.
#ifndef FBVINS_LIVE_SOCKET_PROTOCOL_HPP
#define FBVINS_LIVE_SOCKET_PROTOCOL_HPP

#include <stdint.h>

enum {
  FBVINS_SOCKET_MAJOR = 1,  ///< raised for incompatible changes
  FBVINS_SOCKET_MINOR = 9,  ///< raised when fields or messages are appended
  FBVINS_SOCKET_MOST_SLOTS = 64,
  FBVINS_SOCKET_MOST_CAMERAS = 8,
  FBVINS_SOCKET_MOST_READINGS = 512,
  FBVINS_SOCKET_LARGEST_MESSAGE = 32768  ///< bytes
};

/// FbvinsSocketHeader::type
enum {
  FBVINS_SOCKET_HELLO = 1,  ///< sender to estimator
  FBVINS_SOCKET_IMU = 2,
  FBVINS_SOCKET_FRAME = 3,
  FBVINS_SOCKET_GOODBYE = 4,   ///< either way
  FBVINS_SOCKET_POSITION = 5,  ///< sender to estimator, since version 1.1
  FBVINS_SOCKET_DEVICE = 6,    ///< sender to estimator, since version 1.4
  FBVINS_SOCKET_TAG = 7,       ///< sender to estimator, since version 1.5
  FBVINS_SOCKET_AIDING = 8,    ///< sender to estimator, since version 1.9
  FBVINS_SOCKET_WELCOME = 65,  ///< estimator to sender
  FBVINS_SOCKET_RELEASED = 66,
  FBVINS_SOCKET_STATUS = 67,
  FBVINS_SOCKET_MAP = 68  ///< since version 1.7
};

typedef struct FbvinsSocketHeader {
  uint32_t type;
  uint32_t size_bytes;  ///< of the whole message
} FbvinsSocketHeader;

/// FbvinsSocketCamera::model
enum {
  FBVINS_SOCKET_RADTAN = 0,
  FBVINS_SOCKET_EQUIDISTANT = 1,
  FBVINS_SOCKET_DOUBLE_SPHERE = 2,
  FBVINS_SOCKET_EXTENDED_UNIFIED = 3,
  // Since version 1.8, with FBVINS_SOCKET_HAS_LENSES:
  FBVINS_SOCKET_OMNI_RADTAN = 4,
  FBVINS_SOCKET_RADTAN5 = 5,
  FBVINS_SOCKET_RATIONAL = 6
};

typedef struct FbvinsSocketCamera {
  uint32_t model;
  uint32_t reserved;
  double focal_px[2];    ///< fx, fy
  double centre_px[2];   ///< cx, cy; the centre of the top-left pixel is (0, 0)
  double distortion[4];  ///< k1 k2 p1 p2 (radtan), k1 k2 k3 k4 (equidistant), xi alpha (ds), alpha beta (eucm); the first four
                         ///< of those that have more
  double T_BC[12];       ///< three rows of four, R | p: p_B = R * p_C + p; B is the IMU
} FbvinsSocketCamera;

typedef struct FbvinsSocketRig {
  FbvinsSocketCamera left, right;
  double gyro_noise_density_radps_rthz;
  double gyro_random_walk_radps2_rthz;
  double accel_noise_density_mps2_rthz;
  double accel_random_walk_mps3_rthz;
  double imu_rate_hz;
  double image_rate_hz;
  double time_offset_s;  ///< t_imu = t_image + time_offset_s, of all cameras unless there are FbvinsSocketTimes
} FbvinsSocketRig;

/// When a camera takes its images.
typedef struct FbvinsSocketTimes {
  double time_offset_s;  ///< t_imu = t_image + time_offset_s
  double line_delay_s;   ///< of a rolling shutter, from row to row; the stamp is the middle row's. 0: a global shutter
} FbvinsSocketTimes;

/// What the IMU's scale, axes and fixed biases make of what is true (docs/calibration.md): reading = gyro * (angular rate) +
/// gyro_by_force * (specific force) + gyro_bias, and accel * (specific force) + accel_bias. Matrices row by row.
typedef struct FbvinsSocketImuAxes {
  double gyro[9], accel[9];
  double gyro_by_force[9];  ///< rad/s for each m/s^2
  double gyro_bias_radps[3], accel_bias_mps2[3];
} FbvinsSocketImuAxes;

/// A depth sensor (docs/rigs.md).
typedef struct FbvinsSocketDepth {
  double noise_at_1m_m;  ///< standard deviation at a distance of one metre; it grows with the square of the distance
  double nearest_m, farthest_m;
  double scale_sigma;  ///< relative, of what all distances have in common
} FbvinsSocketDepth;

#define FBVINS_SOCKET_MAGIC "fb-vins"  ///< with its 0: eight bytes

/// FbvinsSocketHello::flags
enum {
  FBVINS_SOCKET_HAS_RIG = 1,
  FBVINS_SOCKET_HAS_CAMERAS = 2,  ///< since version 1.2: the fields from `cameras` on are filled; two cameras without it
  FBVINS_SOCKET_HAS_DEPTH =
      4,  ///< since version 1.3: one camera, with a depth sensor; those from `depth_offset_bytes` on are filled
  FBVINS_SOCKET_HAS_TIMES = 8,          ///< since version 1.4: `times` is filled
  FBVINS_SOCKET_HAS_DEPTH_CAMERA = 16,  ///< since version 1.6: with FBVINS_SOCKET_HAS_DEPTH, those from `depth_width_px` on are
  FBVINS_SOCKET_HAS_LENSES = 32,        ///< since version 1.8: `more_distortion` is filled
  FBVINS_SOCKET_HAS_IMU_AXES = 64       ///< since version 1.8: `imu_axes` is filled; without it the readings are corrected
};

/// The first message, with one file descriptor: a memfd of at least slots * slot_bytes, sealed with F_SEAL_SHRINK.
/// Slot k begins at k * slot_bytes: the left image, row after row, at right_offset_bytes the right one, and at
/// more_offset_bytes[i] that of camera 2 + i. All cameras have images of one size. At depth_offset_bytes, an even number, the
/// depth image: 16 bits a pixel, millimetres along z of the camera whose pixels they are, 0 where nothing was measured.
typedef struct FbvinsSocketHello {
  FbvinsSocketHeader header;
  char magic[8];
  uint16_t major, minor;
  uint32_t flags;
  char name[32];  ///< for messages to people; ends with a 0 unless full
  uint32_t width_px, height_px;
  uint32_t slots;
  uint32_t slot_bytes;
  uint32_t right_offset_bytes;
  uint32_t reserved;
  FbvinsSocketRig rig;  ///< with FBVINS_SOCKET_HAS_RIG; else 0
  // Since version 1.2, with FBVINS_SOCKET_HAS_CAMERAS; else 0 or left out:
  uint32_t cameras;  ///< 1 (`left`) to FBVINS_SOCKET_MOST_CAMERAS
  uint32_t reserved_too;
  uint32_t more_offset_bytes[FBVINS_SOCKET_MOST_CAMERAS - 2];
  FbvinsSocketCamera more[FBVINS_SOCKET_MOST_CAMERAS - 2];  ///< of the rig: cameras 2, 3 ...
  // Since version 1.3, with FBVINS_SOCKET_HAS_DEPTH; else 0 or left out:
  uint32_t depth_offset_bytes;
  uint32_t reserved_three;
  FbvinsSocketDepth depth;  ///< of the rig
  // Since version 1.4, with FBVINS_SOCKET_HAS_TIMES; else 0 or left out:
  FbvinsSocketTimes times[FBVINS_SOCKET_MOST_CAMERAS];  ///< of the rig's cameras 0, 1 ...
  // Since version 1.6, with FBVINS_SOCKET_HAS_DEPTH_CAMERA, of depth images that are not registered to the camera; else 0 or
  // left out:
  uint32_t depth_width_px, depth_height_px;
  FbvinsSocketCamera depth_camera;  ///< of the rig: the depth sensor's own lens and pose
  // Since version 1.8, with FBVINS_SOCKET_HAS_LENSES; else 0 or left out:
  /// Of cameras 0, 1 ... and, last, of the depth sensor: p2 (omni-radtan, whose first four are xi k1 k2 p1), k3 (radtan with
  /// five), k3 k4 k5 k6 (rational); both behind k1 k2 p1 p2.
  double more_distortion[FBVINS_SOCKET_MOST_CAMERAS + 1][4];
  // Since version 1.8, with FBVINS_SOCKET_HAS_IMU_AXES; else 0 or left out:
  FbvinsSocketImuAxes imu_axes;
} FbvinsSocketHello;

typedef struct FbvinsSocketReading {
  int64_t t_ns;
  double gyro_radps[3];  ///< in B
  double accel_mps2[3];  ///< specific force, in B: at rest +g upwards
} FbvinsSocketReading;

/// Only the first `count` readings are sent.
typedef struct FbvinsSocketImu {
  FbvinsSocketHeader header;
  uint32_t count;
  uint32_t reserved;
  FbvinsSocketReading readings[FBVINS_SOCKET_MOST_READINGS];
} FbvinsSocketImu;

/// FbvinsSocketFrame::images; camera i has bit i, the depth sensor the one behind those of all cameras (since version 1.3).
enum { FBVINS_SOCKET_LEFT = 1, FBVINS_SOCKET_RIGHT = 2, FBVINS_SOCKET_DEPTH = 256 };

typedef struct FbvinsSocketFrame {
  FbvinsSocketHeader header;
  int64_t t_ns;
  uint64_t sequence;  ///< +1 for each frame that the cameras made, sent or not: gaps are counted
  uint32_t slot;      ///< the estimator's until FbvinsSocketReleased
  uint32_t images;    ///< which of the cameras' images the slot holds
  // Since version 1.2, or left out:
  int64_t offset_ns[FBVINS_SOCKET_MOST_CAMERAS];  ///< camera i took its image at t_ns + offset_ns[i]
} FbvinsSocketFrame;

/// FbvinsSocketPosition::measured
enum { FBVINS_SOCKET_WHERE = 0, FBVINS_SOCKET_HEIGHT = 1 };

/// Where a point of the body is in the building, by a sensor outside (docs/maps.md, Anchors), or how high it is.
typedef struct FbvinsSocketPosition {
  FbvinsSocketHeader header;
  int64_t t_ns;             ///< of the cameras' clock
  double p_A[3];            ///< in the building's frame, m
  double covariance_m2[6];  ///< xx xy xz yy yz zz
  double p_B[3];            ///< the point of the body that is measured, m
  uint32_t measured;        ///< of a height alone only z and zz count
  uint32_t reserved;
} FbvinsSocketPosition;

/// A tag that a detector of the sender's saw (docs/maps.md, Anchors). Poses are a position in m and an orientation w, x, y, z;
/// the tag's frame has its origin in its middle, x to the right and y upwards as a viewer of the upright tag sees it, z towards
/// the viewer.
typedef struct FbvinsSocketTag {
  FbvinsSocketHeader header;
  int64_t t_ns;  ///< of the cameras' clock
  uint32_t id;
  uint32_t has_place;        ///< 0: where it hangs is not known; it is a landmark of the map
  double p_BT[3], q_BT[4];   ///< in the body
  double covariance_BT[21];  ///< upper triangle by rows, of (dp in the body in m, dtheta in the tag in rad)
  double p_AT[3], q_AT[4];   ///< in the building, where that is known
} FbvinsSocketTag;

/// FbvinsSocketAiding::sensor
enum { FBVINS_SOCKET_RANGE = 0, FBVINS_SOCKET_VELOCITY = 1, FBVINS_SOCKET_PRESSURE = 2 };

/// A reading of a sensor that aids images and IMU (docs/rangefinder.md, velocity.md, barometer.md). Fields that its sensor does
/// not have are 0.
typedef struct FbvinsSocketAiding {
  FbvinsSocketHeader header;
  int64_t t_ns;  ///< of the cameras' clock
  uint32_t sensor;
  uint32_t reserved;
  double value[3];               ///< of a range: m along x, infinite where it sees nothing; of a velocity: m/s; of a pressure: Pa
  double sigma[3];               ///< standard deviations of these; of a velocity 100 along an axis that is not measured
  double p_BS[3], q_BS[4];       ///< where the sensor sits in the body, m, and its axes: w, x, y, z; not of a pressure
  double nearest_m, farthest_m;  ///< of a range
} FbvinsSocketAiding;

/// What is known of the cameras' device, for `fbvins live --check` and for people. The newest one counts.
typedef struct FbvinsSocketDevice {
  FbvinsSocketHeader header;
  char text[2040];  ///< lines KEY=VALUE (docs/socket.md); ends with a 0 unless full
} FbvinsSocketDevice;

/// FbvinsSocketGoodbye::reason
enum {
  FBVINS_SOCKET_DONE = 0,
  FBVINS_SOCKET_WRONG_VERSION = 1,
  FBVINS_SOCKET_MALFORMED = 2,  ///< a message or the memory is not as this header says
  FBVINS_SOCKET_WRONG_RIG = 3,  ///< no calibration, or another one than the estimator runs with
  FBVINS_SOCKET_BUSY = 4,       ///< another sender is there
  FBVINS_SOCKET_TOO_SLOW = 5    ///< no hello in time
};

typedef struct FbvinsSocketGoodbye {
  FbvinsSocketHeader header;
  uint32_t reason;
  uint32_t reserved;
  char text[240];  ///< one sentence; ends with a 0 unless full
} FbvinsSocketGoodbye;

typedef struct FbvinsSocketWelcome {
  FbvinsSocketHeader header;
  uint16_t major, minor;
  uint32_t reserved;
} FbvinsSocketWelcome;

typedef struct FbvinsSocketReleased {
  FbvinsSocketHeader header;
  uint64_t slots;  ///< bit k: slot k is the sender's again
} FbvinsSocketReleased;

/// FbvinsSocketStatus::health
enum {
  FBVINS_SOCKET_UNKNOWN = 0,
  FBVINS_SOCKET_INITIALISING = 1,
  FBVINS_SOCKET_GOOD = 2,
  FBVINS_SOCKET_DEGRADED = 3,
  FBVINS_SOCKET_LOST = 4
};

/// Once a second, and when health changes. Counts are of this connection.
typedef struct FbvinsSocketStatus {
  FbvinsSocketHeader header;
  uint64_t frames;
  uint64_t frames_missed;  ///< gaps in FbvinsSocketFrame::sequence
  uint64_t readings;
  uint64_t readings_refused;  ///< not finite; impossible positions as well
  uint32_t slots_held;
  uint32_t health;
  uint32_t reset_counter;  ///< +1 whenever the estimator started again
  uint32_t reserved;
} FbvinsSocketStatus;

/// FbvinsSocketMap::flags
enum { FBVINS_SOCKET_LOCALISED = 1, FBVINS_SOCKET_ANCHORED = 2 };

/// Where W lies in the map (docs/maps.md), after a keyframe, where there is a map; the newest one counts. To senders whose hello
/// has version 1.7 or later. Poses are a position in m and an orientation w, x, y, z.
typedef struct FbvinsSocketMap {
  FbvinsSocketHeader header;
  int64_t t_ns;  ///< of the keyframe
  uint32_t reset_counter;
  uint32_t flags;                   ///< without FBVINS_SOCKET_LOCALISED the poses of W are not known, and 0
  double p_MW[3], q_MW[4];          ///< p_M = q_MW p_W + p_MW
  double p_smooth[3], q_smooth[4];  ///< the same at a bounded speed
  double p_MM0[3], q_MM0[4];        ///< from M as it was at the estimator's beginning to M now: M was levelled, or anchored
  uint32_t moves;                   ///< how often M has moved
  uint32_t reserved;
} FbvinsSocketMap;

#endif
