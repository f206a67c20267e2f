// SPDX-License-Identifier: Apache-2.0
// A sensor that the library does not know, as a factor of the window (docs/cpp.md#add-a-factor): an instrument that measures the
// speed, of a scale that nobody has calibrated. The scale is a variable that is estimated with the flight. Its readings are made
// of the recording's ground truth, as recordings with such an instrument are rare.
//
//   own_factor RECORDING [SCALE]      flies, and prints the scale that it found
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fbvins/estimator/own_sensor.hpp>
#include <fbvins/io/dataset.hpp>
#include <fbvins/pipeline/system.hpp>
#include <map>
#include <memory>

namespace {

constexpr double kSigma_mps = 0.03;

/// One reading at an image: scale * |v|. Rounded off at rest, where the magnitude has no derivative.
struct Reading : fbvins::OwnMeasurement {
  double speed_mps;
  explicit Reading(double speed) : speed_mps(speed) {}

  Eigen::VectorXd residual(const fbvins::BodyAtImage& body, const Eigen::VectorXd& scale) const override {
    const double speed = std::sqrt(body.v_GB.squaredNorm() + 1e-4);
    return Eigen::VectorXd::Constant(1, (scale(0) * speed - speed_mps) / kSigma_mps);
  }
  bool is_of_motion() const override { return true; }
};

class SpeedMeter : public fbvins::OwnSensor {
 public:
  SpeedMeter(const std::vector<fbvins::TrajectoryPoint>& truth, double scale) {
    for (const fbvins::TrajectoryPoint& p : truth)
      if (p.v_WB) readings_[p.t] = scale * p.v_WB->norm();
  }

  Eigen::VectorXd first_variable() const override { return Eigen::VectorXd::Constant(1, 1.0); }
  std::vector<std::shared_ptr<const fbvins::OwnMeasurement>> measured(const fbvins::BodyAtImage& predicted,
                                                                      const Eigen::VectorXd& scale) override {
    found_ = scale(0);
    const auto reading = readings_.lower_bound(predicted.t);
    if (reading == readings_.end()) return {};
    // What cannot be right is left out.
    const double expected_mps = found_ * predicted.v_GB.norm();
    if (std::abs(reading->second - expected_mps) > 0.3 * expected_mps + 0.2) return ++left_out_, Measurements{};
    return ++used_, Measurements{std::make_shared<const Reading>(reading->second)};
  }

  double scale() const { return found_; }
  int used() const { return used_; }
  int left_out() const { return left_out_; }

 private:
  using Measurements = std::vector<std::shared_ptr<const fbvins::OwnMeasurement>>;
  std::map<fbvins::Time, double> readings_;
  double found_ = 1;
  int used_ = 0, left_out_ = 0;
};

int fail(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return fail("usage: own_factor RECORDING [SCALE]");
  const double scale = argc > 2 ? std::atof(argv[2]) : 1.08;
  auto data = fbvins::open_dataset(argv[1]);
  if (!data) return fail(data.error().message);
  const auto meter = std::make_shared<SpeedMeter>((*data)->ground_truth(), scale);
  auto system = fbvins::System::create({}, (*data)->rig(), fbvins::RunMode::deterministic, {.sensors = {meter}});
  if (!system) return fail(system.error().message);
  int poses = 0;
  system->on_odometry([&](const fbvins::Odometry& o) { poses += o.health.has_pose(); });
  while (auto event = (*data)->next())
    if (auto taken = system->push(std::move(*event)); !taken) return fail(taken.error().message);
  if (auto end = system->finish(); !end) return fail(end.error().message);
  std::printf("%d poses, %d readings used, %d left out, scale %.4f\n", poses, meter->used(), meter->left_out(), meter->scale());
  return 0;
}
