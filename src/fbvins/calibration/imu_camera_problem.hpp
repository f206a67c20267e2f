// SPDX-License-Identifier: Apache-2.0
// Private to calibration: the least-squares problem of camera-IMU calibration (docs/derivations/calibration.md, C1-C14).
// Unknowns: the path's knots and the biases over time, each coupled to its neighbours, and the calibration, coupled to all.
//
//   ImuCameraProblem problem(data, state, setup);
//   minimise(problem, options);                   // optim/levenberg_marquardt.hpp
//   Eigen::MatrixXd P = problem.calibration_covariance();
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/calibration/pose_spline.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/optim/skyline_system.hpp"

namespace fbvins {

struct WeightedCorner {
  int index = 0;
  Vec3 p_T;
  Vec2 pixel;
  double row = 0;  ///< from the image's middle downwards, px
  bool used = true;
};

/// What one camera sees at one instant; with a rolling shutter, in a group of neighbouring rows.
struct CalibrationView {
  int camera = 0;
  double t_s = 0;  ///< image's stamp since the path's start, without the offset
  double row = 0;  ///< from the image's middle downwards, exposed line_delay * row later (U4)
  double noise_factor = 1;
  int sharing = 1;  ///< views with this stamp
  std::vector<WeightedCorner> corners;
};

struct CalibrationReading {
  double t_s = 0;  ///< since the path's start
  Vec3 gyro_radps, accel_mps2;
  bool used = true;
};

struct CalibrationData {
  std::vector<Camera> cameras;
  std::vector<CalibrationView> views;
  std::vector<CalibrationReading> readings;
};

struct CalibrationState {
  PoseSpline path;
  int intervals_per_bias = 25;  ///< the bias is linear in time between nodes so far apart
  std::vector<ImuBias> biases;  ///< one every so many intervals of the path, from its start
  std::vector<Pose<B, Cn>> T_BC;
  double time_offset_s = 0, line_delay_s = 0;
  std::vector<double> later_s = {};  ///< of each camera beside the time offset; 0 of camera 0
  Vec3 gravity_T = Vec3(0, 0, -9.81);
  double board_scale = 1;
  ImuTriads axes;

  ImuBias bias_at(double t_s) const;
};

struct CalibrationSetup {
  double corner_sigma_px = 0.2;
  /// What moves all corners of an image together (its stamp, the lens, the rig) over what each corner's noise explains (C11).
  double image_factor = 1;
  double stamp_jitter_s = 0;                                ///< standard deviation of a stamp (C12)
  double gyro_sigma_radps = 1e-3, accel_sigma_mps2 = 1e-2;  ///< of a single reading
  double gyro_walk_radps2_rthz = 2e-5, accel_walk_mps3_rthz = 3e-3;
  double corner_huber = 2, reading_huber = 1e9;  ///< in sigmas
  double gravity_mps2 = 9.81, gravity_sigma_mps2 = 0.02;
  std::vector<Pose<Cn, C0>> T_CnC0;  ///< as given; empty: free
  double camera_sigma_m = 1e-6, camera_sigma_rad = 1e-6;
  bool free_board_scale = false, free_axes = false, free_line_delay = false, free_camera_offsets = false;
};

/// Where the calibration's unknowns lie, after those of the chain; -1: not estimated.
struct CalibrationLayout {
  std::vector<int> cameras;                                                          ///< six each: dp in B, dtheta in C
  int later = -1;                                                                    ///< of the cameras from 1 on
  int time_offset = -1, line_delay = -1, gravity = -1, board_scale = -1, axes = -1;  ///< axes: gyro by rows (9), accel (6)
  int begin = 0, end = 0;
};

/// Residuals of one kind, in sigmas, and the part of them that the unknowns have taken up.
struct ResidualSum {
  double chi2 = 0, rows = 0, taken_up = 0;
  /// Unbiased, where the noise is as assumed 1.
  double rms() const { return rows > taken_up ? std::sqrt(chi2 / (rows - taken_up)) : 0; }
};

struct ResidualSums {
  ResidualSum corners, gyro, accel;
  double stamp_jitter_s = 0;  ///< as the images' residuals along their motion show it
  ResidualSum images;         ///< of the corners' residuals the part that another pose of the image's camera would explain
};

class ImuCameraProblem {
 public:
  ImuCameraProblem(CalibrationData data, CalibrationState state, CalibrationSetup setup);

  // optim/levenberg_marquardt.hpp
  double linearise();
  bool solve(double lambda);
  double predicted_decrease() const { return predicted_; }
  double step_size() const;
  double apply_step();
  void undo_step() { state_ = before_; }

  const CalibrationState& state() const { return state_; }
  const CalibrationSetup& setup() const { return setup_; }
  const CalibrationData& data() const { return data_; }
  CalibrationData& data() { return data_; }
  void change(const CalibrationSetup& setup);
  /// The board's size is as its file says.
  void fix_board_scale() { state_.board_scale = 1; }
  const CalibrationLayout& layout() const { return layout_; }
  /// Of the cost by all unknowns, at the state last linearised.
  const Eigen::VectorXd& gradient() const { return system_->b(); }
  /// The cost after a step, which is taken back.
  double cost_after(Eigen::VectorXd step);

  /// Of the calibration's unknowns, at the state last linearised; nullopt where they are not determined.
  std::optional<Eigen::MatrixXd> calibration_covariance();
  /// How the calibration moves if the rig's lenses and extrinsics do, by one standard deviation (C15); after
  /// calibration_covariance().
  Eigen::VectorXd response(const RigVariation& variation);
  /// Standard deviations of the biases at node `index`, after calibration_covariance().
  ImuBias bias_sigma(int index) const;
  /// Degrees of freedom by random signs (C14), after calibration_covariance().
  ResidualSums residual_sums();

  /// Predicted minus seen, px, with the image taken `late_s` later; nullopt where the corner is not in front of the lens.
  std::optional<Vec2> corner_error(const CalibrationView& view, const WeightedCorner& corner, double late_s = 0) const;
  /// How much later the image fits best, s.
  double lateness_s(const CalibrationView& view) const;
  /// In sigmas: gyro, accelerometer.
  Vec6 reading_error(const CalibrationReading& reading) const;

 private:
  /// A view's normal equations by the motion of its own camera: d(position in C), d(rotation), and the line delay.
  struct ViewTerm {
    Eigen::Matrix<double, 7, 7> H = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> b = Eigen::Matrix<double, 7, 1>::Zero();
    double cost = 0, chi2 = 0;
    int rows = 0;
  };
  struct ViewMotion {
    Pose<T, B> T_TB;
    Pose<Cn, T> T_CT;
    Vec6 rate;  ///< of the camera, in C: velocity, angular rate
  };

  void lay_out();
  double evaluate(bool build);
  double add_view(const CalibrationView& view, bool build);
  double add_reading(const CalibrationReading& reading, bool build);
  double add_bias_walk(bool build);
  double add_smoothness(bool build);
  double add_priors(bool build);
  double add_images(bool build);  ///< what the rig's numbers enter
  double add_camera_prior(std::size_t camera, bool build);

  /// When a view was taken, since the path's start.
  double taken_s(const CalibrationView& view) const;
  ViewMotion view_motion(const CalibrationView& view, SplineJacobian* J) const;
  std::optional<Vec3> corner_in_camera(const CalibrationView& view, const WeightedCorner& corner, const ViewMotion& motion,
                                       double late_s = 0) const;
  /// With `signs`, b is that of residuals that are random signs.
  ViewTerm view_term(const CalibrationView& view, const ViewMotion& motion, Rng* signs) const;
  /// The same for a stamp that is not exact.
  ViewTerm with_jitter(ViewTerm term, const CalibrationView& view, const ViewMotion& motion) const;
  void view_columns(const CalibrationView& view, const ViewMotion& motion, const SplineJacobian& J);
  void reading_columns(const CalibrationReading& reading);
  void begin_local(int rows, int first_knot);
  int columns(int index, int count);  ///< of the local Jacobian, for `count` unknowns from `index`
  int knot_index(int knot) const { return knot_index_[static_cast<std::size_t>(knot)]; }
  double add_rows(bool build);  ///< half the square of r_; with J_ to the system

  CalibrationData data_;
  CalibrationState state_, before_;
  CalibrationSetup setup_;
  CalibrationLayout layout_;
  std::vector<int> knot_index_, bias_index_;  ///< of a knot: rotation, position; of a node: gyroscope, accelerometer
  std::optional<SkylineSystem> system_;
  Eigen::VectorXd step_;
  double predicted_ = 0;

  void add_image_sum(const ViewTerm& image, ResidualSum& sum) const;

  // The item being added: its unknowns, Jacobian by them, and residual.
  std::vector<int> index_;
  Eigen::MatrixXd J_;
  Eigen::VectorXd r_;
};

}  // namespace fbvins
