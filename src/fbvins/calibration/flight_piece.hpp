// SPDX-License-Identifier: Apache-2.0
// Some seconds of a flight as a least-squares problem: states of its keyframes, points that its cameras saw, the IMU's readings
// between keyframes, and the calibration that all of it is seen with. States and points are eliminated, so that what a piece says
// of the calibration is a small system of equations (docs/derivations/calibration.md). One thread at a time.
//
//   FlightPiece piece(keyframes, noise, gravity_mps2, rig);
//   CalibrationEquations e = piece.linearise(rig, 1e-6);
//   piece.move(step);                            // of the calibration: states and points follow
//   if (piece.cost(moved(rig, step)) > e.cost) piece.undo();
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <vector>

#include "fbvins/calibration/flight_tracks.hpp"
#include "fbvins/calibration/flight_view_term.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins {

/// Half the sum of squares at the minimum over states and points, to second order in a step of the calibration.
struct CalibrationEquations {
  double cost = 0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;
};

struct FlightNoise {
  double sigma_px = 0.6;       ///< of a coordinate of a view
  double gyro = 1, accel = 1;  ///< of readings between keyframes, over what the odometry assumed
  double spread = 1;           ///< variance of what pieces say of the calibration, over what their noise explains: 1 or more
};

class FlightPiece {
 public:
  /// Keyframes in order, each but the first with the readings since the one before. `given`: with which they were estimated.
  FlightPiece(std::vector<FlightKeyframe> keyframes, const ImuNoise& noise, double gravity_mps2, const FlightRig& given);

  int keyframes() const { return static_cast<int>(states_.size()); }
  int points() const { return static_cast<int>(points_.size()); }
  int views() const;
  double duration_s() const { return duration_s_; }

  void set_noise(const FlightNoise& noise);
  double cost(const FlightRig& rig) const;
  /// Distance of each view's coordinates from the prediction, px.
  std::vector<double> residuals_px(const FlightRig& rig) const;

  CalibrationEquations linearise(const FlightRig& rig, double lambda);
  /// At the last linearisation, a minimum: minus the logarithm of how likely the readings are, whatever states and points are,
  /// but for a constant. To be compared between noises of the readings.
  double unlikelihood() const;
  /// States and points after a step of the calibration, by the last linearisation.
  void move(const Eigen::VectorXd& step);
  void undo();

 private:
  struct View {
    int keyframe = 0, camera = 0;
    Vec2 pixel;
  };
  struct Point {
    Vec3 p_W;
    std::vector<View> views;
  };
  struct Step {
    std::vector<ImuSegment> segments;
    Preintegration between;
    Eigen::Matrix<double, 9, 15> by_axes;  ///< of the motion measured
  };
  /// The parameter of each column of ViewDerivatives::calibration.
  using Columns = std::array<int, ViewDerivatives::kColumns>;
  /// A point's equations, which are eliminated.
  struct PointEquations {
    Mat3 covariance = Mat3::Zero();  ///< with states and calibration known
    Vec3 gradient = Vec3::Zero();
    std::vector<int> keyframes;
    std::vector<Eigen::Matrix<double, 3, 9>> by_states;
    Eigen::Matrix<double, 3, Eigen::Dynamic> by_calibration;
  };

  ViewPlace place(const FlightRig& rig, int keyframe) const;
  void add_prior(double& cost);
  double prior_cost() const;
  void add_steps(const FlightRig& rig, double& cost);
  void add_point(const FlightRig& rig, double lambda, std::size_t point, double& cost);
  void add_calibration(const Columns& columns, const ViewDerivatives& d, const Vec2& r, Eigen::Index at, PointEquations& e);
  void eliminate(const PointEquations& e);

  double gravity_mps2_, given_offset_s_, duration_s_ = 0;
  ImuNoise assumed_;
  FlightNoise noise_;
  std::vector<NavState<W>> states_, states_before_;
  NavState<W> start_;
  std::vector<ReadingAt> readings_;
  std::vector<Step> steps_;
  std::vector<Point> points_;
  std::vector<Vec3> points_before_;
  // Of the last linearisation.
  std::vector<Columns> columns_;  ///< by camera
  int size_ = 0;                  ///< parameters of the calibration
  double cost_ = 0;
  Eigen::MatrixXd A_, B_, C_;
  Eigen::VectorXd gradient_, calibration_gradient_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  std::vector<PointEquations> eliminated_;
};

}  // namespace fbvins
