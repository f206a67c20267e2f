// SPDX-License-Identifier: Apache-2.0
// The thresholds of integrity in one table: of residual tests, propagation, doubt and health. Units are in the names. Beside each
// stands what flights without a fault ("clean") have, so how far away a false alarm is, and on which data. Numbers (I..) are
// those of docs/derivations/integrity.md.
//
// - A: 27 flights, 54 runs, 24,704 images after the start: 0 images degraded, 0 resets (docs/experiments/integrity.md,
//   "Twenty-seven flights without a fault"). At 20 images a second these are 21 minutes: with 95 % all tests together have
//   less than nine false alarms an hour. No clean data here are long enough to say less.
// - B: 20 runs, 9,665 images: 0 alarms of every test (the same page, "False alarms of each test").
//
// What no data was set on is marked as chosen.
#pragma once

#include <cstddef>

#include "fbvins/core/angle.hpp"

namespace fbvins::thresholds {

// ---- Each image against the prediction by the readings (I1 to I6). A, B: 0 alarms.

/// (I3) Median residual of a camera, in standard deviations of a feature. Clean (B): up to 0.7 of it. More after a longer time.
inline constexpr double kUsual_sigma = 1.5, kUsualFor_s = 0.06;
/// Times as much while the calibration is being found. Chosen: errors of extrinsics within their prior fit.
inline constexpr double kCalibrating = 6;
/// (I3a) And so many standard deviations of what the noise of readings and stamps moves all that is seen: 95 %.
inline constexpr double kSpread_sigma = 2;
inline constexpr double kNearest_m = 0.3;  ///< chosen: as near as cameras are used
/// (I3a) What all residuals of an image have in common, on average: EuRoC's MH_01, two cameras. A rig whose lens, axes and clocks
/// are known less well has more, and is given as many times the room, up to a limit; learned from images in no contradiction. One
/// camera on MH_01 has 0.13, simulated kits 0.2 to 0.29, a camera carried by hand 0.33 to 0.41.
inline constexpr double kUsualShift = 0.17, kMostRoom = 3, kLargestLearned = 1;
inline constexpr double kLearnedAtFirst_s = 2, kLearnedOver_s = 30;  ///< chosen
/// (I6) Where the images' own pose does not explain them much better, the prediction is not what is wrong. Chosen.
inline constexpr double kBetter = 0.6;
/// (I6) Share of the landmarks that agree with one pose where images can be right against the readings. Chosen: a clear majority.
inline constexpr double kAgreeing = 0.6;
/// (I4) CUSUM of (median / usual - 1): a contradiction from here on; no more is kept. One image of twice the usual.
inline constexpr double kContradiction = 1, kMost = 2;
/// (I4a) What all that a camera sees is off by, in one direction, added up with this memory. Clean: up to 2.3 (29 flights; B). A
/// gyroscope's axes may be off by this share of the turn.
inline constexpr double kDrift_sigma = 4, kDrift_s = 0.5, kScale = 0.005;
/// (I4b) A smaller drift that lasts: CUSUM of (drift / usual - 1) over time, s. Usual is this much, and this part of what the
/// axes explain, twice their standard deviation (W23). Clean (B): at most 0.15 s of the 0.5.
inline constexpr double kLasting_sigma = 1.5, kLastingScale = 0.4, kLasting_s = 0.5;
/// What is left of a sudden drift does not last: it is forgotten after this time, two memories of (I4a).
inline constexpr double kForgotten_s = 1;
/// (I4a) The other camera, where only one drifts. A camera that was excluded for drift alone is used again after this time: the
/// landmarks triangulated without it may be what is wrong. Chosen.
inline constexpr double kOther = 0.5, kReadmitted_s = 1;
/// A contradiction is over after so long without one; with images to compare missing for so long meanwhile it is unrecoverable.
/// Chosen.
inline constexpr double kCalm_s = 0.5, kBlind_s = 0.3;
/// After darkness of this length the velocity is unknown, and the first predictions are as wrong as it is. Chosen.
inline constexpr double kDark_s = 0.15;
inline constexpr int kSettling = 5;  ///< images
/// Two resets within a few seconds are no way to fly. Chosen. A: no reset at all.
inline constexpr double kNextReset_s = 5;
/// One camera that contradicts the readings for so long cannot be followed: its own motion has no scale. Images in between that
/// agree take as much time away. Chosen; ten starts of a camera carried by hand: none.
inline constexpr double kContradictedOneCamera_s = 2;
/// Images with readings after a gap, until velocity and attitude are known again. Chosen.
inline constexpr int kFramesAfterGap = 6;

// ---- The window's turns against the readings' (I4c).

/// In standard deviations, beyond what axes that are off by this share of the turn explain. Clean: up to 2.8 (21 simulated
/// flights), 2.5 (MH_01), 6.4 where images are rendered along a measured trajectory, which turns otherwise than the gyroscope
/// did. From the first on the readings count less, from the second on they contradict each other, until they are below the third.
inline constexpr double kTurnSuspected_sigma = 5, kTurn_sigma = 7, kTurnOver_sigma = 3, kTurnScale = 0.002;
/// By then the pose may have moved by about as much, in each direction.
inline constexpr double kTurnedAway_m = 0.1;

// ---- What contradictions leave in doubt (I10): more than a pose called good may be wrong by, as docs/experiments/integrity.md
// counts it.

inline constexpr double kLarge_m = 0.1, kLarge_rad = 3 * kDegree;

// ---- Gravity against the attitude, by the biases (I11 to I14).

/// A doubt has to be confirmed by biases that are where they were, for this time. 0.1 m/s^2 is a tilt of 0.6 degrees (I11).
inline constexpr double kDoubtedTilt_rad = 1 * kDegree, kConfirmed_s = 1.5, kAccelBack_mps2 = 0.1, kGyroBack_radps = 0.005;
/// (I14) No bias moves so far in so short a time. Clean, 38 flights: at most 2.6 (accelerometer) and 2.3 (gyroscope) of the 5.
inline constexpr double kJump_s = 2, kAccelJump_mps2 = 0.25, kGyroJump_radps = 0.005, kMoved_sigma = 5;
/// From here on such a move of the accelerometer's bias is suspected, and the angle to the tilt propagated from before it is
/// added to the covariance. Clean, the same 38 flights: at most 2.6. Twelve simulated single cameras as delivered: 3.5 and 5.4 in
/// two.
inline constexpr double kSuspectedMove_sigma = 3;
/// At the beginning, when the first errors of the start are found, they do. Chosen.
inline constexpr double kBegun_s = 2;
/// Nor is it another one after a restart that this has caused: unless it was younger than the second figure, when a bad start (a
/// wrong time offset, noisy stamps) is more likely than a fault. Chosen.
inline constexpr double kRefutedRemembered_s = 30, kSettled_s = 5;

// ---- Up, carried on by the gyroscope (I14a).

/// A fault has to be older than this to have spoiled what is carried on: (I14) sees those of two seconds.
inline constexpr double kBefore_s = 2;
inline constexpr double kUpRemembered_s = 30;  ///< chosen
/// No pose is good whose tilt is off by more; and by so many standard deviations of what is carried on. A, B: 0.
inline constexpr double kUpAway_rad = 3 * kDegree, kUpAway_sigma = 2;
/// After a restart in a contradiction images and readings have to agree for this time. Chosen: two of kCalm_s.
inline constexpr double kProven_s = 1;

// ---- The velocity, carried on by the readings (I14b). A, B: 0.

/// Landmarks that join one image to an earlier one, and how many of those in view they have to be. Chosen.
inline constexpr std::size_t kFewestLinked = 8;
inline constexpr double kLinked = 0.5;
/// Fewer landmarks in an image prove nothing: as of a camera, and for a pose (I2).
inline constexpr std::size_t kFewestToJudge = 15;
inline constexpr double kCarriedFor_s = 30;  ///< chosen
/// No good velocity is off by more; and by so many standard deviations of what is carried on.
inline constexpr double kVelocity_mps = 0.3, kVelocity_sigma = 5;
/// What scale, axes and vibration of an accelerometer add to its bias: 0.3 % of gravity.
inline constexpr double kAccel_mps2 = 0.03;
/// So long the readings are carried on while images contradict them. Chosen.
inline constexpr double kDisputed_s = 0.2;
/// As well as this a velocity is known in any case. Chosen.
inline constexpr double kKnown_mps = 0.1;
/// As in (I10).
inline constexpr double kMovedAlong_m = 0.1;

// ---- Health (health_decision.cpp).

/// Without readings for longer than this, attitude and velocity are not known any more. Ten readings at 200 Hz.
inline constexpr double kReadingsGap_s = 0.05;
/// Between images farther apart than this, and than this many periods of the camera, others are missing.
inline constexpr double kImageHole_s = 0.25, kImageHole_periods = 2.5;
inline constexpr int kFailedSolvesUntilLost = 3;  ///< chosen. A, B: no solve fails
/// Larger biases are implausible: above every sensor's data sheet (docs/simulator.md), six times what EuRoC's ADIS16448 has.
inline constexpr double kMaxGyroBias_radps = 0.5, kMaxAccelBias_mps2 = 2.5;
/// Of eight vehicles one shakes up to this in flight, the others half of it at most, and crashes three times as much.
inline constexpr double kGyroVibration_radps = 0.3;
/// A large correction so soon after a pose that was not good has to be confirmed by gravity. Chosen.
inline constexpr double kTrouble_s = 2;
/// Otherwise so many times what a good pose may owe is made up for at once (W24).
inline constexpr double kAtOnce = 2;

}  // namespace fbvins::thresholds
