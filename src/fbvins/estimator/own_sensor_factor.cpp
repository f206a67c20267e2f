// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/own_sensor_factor.hpp"

#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kStep = 1e-5;  ///< of each number of a variable, for differences

BodyAtImage body_of(Time t, const NavState<G>& state, const Tilt& tilt, const Pose<B, B>& T_frame_image) {
  return {t, state.T_FB * T_frame_image, state.v_FB, state.bias, tilt.gravity_G(-1)};
}

}  // namespace

std::vector<Variable> OwnSensorFactor::variables() const {
  std::vector<Variable> out{Variable::pose_of(frame_)};
  if (measurement_->is_of_motion()) out.push_back(Variable::motion_of(frame_));
  out.push_back(Variable::tilt_of_gravity());
  if (number_ >= 0) out.push_back(Variable::own_one(number_));
  return out;
}

Eigen::VectorXd OwnSensorFactor::variable_of(const WindowProblem& w) const {
  return number_ < 0 ? Eigen::VectorXd() : w.own_variable(number_).value;
}

Eigen::VectorXd OwnSensorFactor::residual(const NavState<G>& state, const Tilt& tilt, const Eigen::VectorXd& variable) const {
  return measurement_->residual(body_of(t_, state, tilt, T_frame_image_), variable);
}

double OwnSensorFactor::cost(const WindowProblem& w) const {
  const Eigen::VectorXd r = residual(w.frame(frame_).state, w.tilt, variable_of(w));
  return huber(r.squaredNorm(), w.weights.huber_sigma).cost;
}

double OwnSensorFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const Eigen::VectorXd r = residual(w.frame(frame_).state, w.tilt, variable_of(w));
  const NavState<G> state = w.linearisation_point(w.index_of(frame_));
  const std::vector<Variable> variables = this->variables();
  int columns = 0;
  for (const Variable& v : variables) columns += w.size_of(v);
  Eigen::MatrixXd J(r.size(), columns);
  const auto moved = [&](const Variable& v, int k, double by) {
    Vec15 d = Vec15::Zero();
    Tilt tilt = w.tilt;
    Eigen::VectorXd variable = variable_of(w);
    if (v.kind == Variable::Kind::tilt) tilt.angle_rad(k) += by;
    else if (v.kind == Variable::Kind::own) variable(k) += by;
    else d(v.kind == Variable::Kind::pose ? k : 6 + k) = by;
    return residual(state.boxplus(d), tilt, variable);
  };
  int column = 0;
  for (const Variable& v : variables)
    for (int k = 0; k < w.size_of(v); ++k) J.col(column++) = (moved(v, k, kStep) - moved(v, k, -kStep)) / (2 * kStep);
  const RobustValue robust = huber(r.squaredNorm(), w.weights.huber_sigma);
  add_residual(w, variables, J, r, robust.weight, out);
  return robust.cost;
}

std::shared_ptr<const Factor> OwnSensorFactor::without(const DroppedFrame& d) const {
  if (measurement_->is_of_motion()) return nullptr;
  return std::make_shared<const OwnSensorFactor>(d.successor, t_, number_, measurement_, d.T_successor_dropped * T_frame_image_);
}

std::vector<std::shared_ptr<const Factor>> OwnSensorMaker::make(const NewFrame& f) {
  const Eigen::VectorXd first = sensor_->first_variable();
  if (first.size() > 0 && (number_ < 0 || f.window.own(number_) == nullptr)) number_ = f.window.add_own("own sensor", first);
  const Eigen::VectorXd variable = number_ < 0 ? Eigen::VectorXd() : f.window.own(number_)->value;
  std::vector<std::shared_ptr<const Factor>> out;
  for (auto& measurement : sensor_->measured(body_of(f.frame.t, f.frame.state, f.window.tilt(), {}), variable))
    if (measurement != nullptr)
      out.push_back(std::make_shared<const OwnSensorFactor>(f.frame.id, f.frame.t, number_, std::move(measurement)));
  return out;
}

}  // namespace fbvins
