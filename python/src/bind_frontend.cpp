// SPDX-License-Identifier: Apache-2.0
// Frontends in Python (register_frontend). Their objects live in the interpreter: every call, and the end of each, holds the GIL.
#include <algorithm>

#include "bindings.hpp"
#include "fbvins/frontend/any_rig.hpp"
#include "fbvins/frontend/frontend_registry.hpp"
#include "fbvins/frontend/observe.hpp"
#include "kept.hpp"

namespace fbvins::python {
namespace {

/// Of newly_made_frontends().
std::vector<std::weak_ptr<Kept>>& made() {
  static std::vector<std::weak_ptr<Kept>> all;
  return all;
}

/// What a call in Python gives; its exception as one of C++, whose text the System's error has.
template <class Call>
auto called(Call&& call) {
  const nb::gil_scoped_acquire acquired;
  try {
    return call();
  } catch (nb::python_error& e) {
    throw std::runtime_error(e.what());
  }
}

class PyFrontend final : public Frontend {
 public:
  PyFrontend(const StereoRig& rig, nb::object frontend, double sigma_px)
      : rig_(rig), frontend_(std::make_shared<Kept>(std::move(frontend))), sigma_px_(sigma_px) {
    made().push_back(frontend_);
  }

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override {
    return called([&] {
      TrackedFrame out;
      const nb::object found = frontend_->get().attr("process")(packet, prior);
      if (!found.is_none()) out.features = features(found);
      out.stats.stereo = static_cast<int>(std::ranges::count_if(out.features, &TrackedFeature::by_several));
      return out;
    });
  }

 private:
  std::vector<TrackedFeature> features(nb::handle found) const {
    if (!nb::isinstance<nb::tuple>(found) || nb::len(found) != 3)
      throw nb::type_error("process() of a frontend returns (ids, left, right), or None");
    const auto ids = checked<std::int64_t>(found[0], "ids", {kAny});
    const auto n = static_cast<std::int64_t>(ids.rows());
    const auto left = checked<double>(found[1], "left", {n, 2});
    std::optional<CheckedArray<double>> right;
    if (const nb::object given = found[2]; !given.is_none()) right = checked<double>(given, "right", {n, 2});
    std::vector<TrackedFeature> out;
    for (std::int64_t i = 0; i < n; ++i) {
      TrackedFeature feature{TrackId{ids.data[i]}};
      feature.see(0, seen(rig_.left(), left.data + 2 * i));
      if (right && rig_.has_right()) feature.see(1, seen(rig_.right(), right->data + 2 * i));
      if (!feature.seen.empty()) out.push_back(feature);
    }
    return out;
  }
  /// Nothing outside the image, for a NaN, and where the lens has no ray.
  std::optional<Observation> seen(const Camera& camera, const double* px) const {
    const Vec2 at(px[0], px[1]);
    return camera.inside(at) ? observe(camera, at, sigma_px_) : std::nullopt;
  }

  StereoRig rig_;
  std::shared_ptr<Kept> frontend_;
  double sigma_px_;
};

/// What Python registered, to be let go before the interpreter ends.
std::vector<std::shared_ptr<Kept>>& makers() {
  static std::vector<std::shared_ptr<Kept>> all;
  return all;
}

void add_frontend(const std::string& name, nb::object make, const std::string& meaning, int max_features, double sigma_px) {
  if (!PyCallable_Check(make.ptr())) throw nb::type_error("make: not callable");
  if (max_features < 1 || !(sigma_px > 0)) throw nb::value_error("max_features and sigma_px are larger than 0");
  if (makers().empty())
    nb::module_::import_("atexit").attr("register")(nb::cpp_function([] {
      for (const std::shared_ptr<Kept>& maker : makers()) maker->reset();
    }));
  auto maker = std::make_shared<Kept>(std::move(make));
  const auto of_pair = [maker, sigma_px](const StereoRig& rig) -> std::unique_ptr<Frontend> {
    return called([&] { return std::make_unique<PyFrontend>(rig, maker->get()(rig), sigma_px); });
  };
  const auto of_rig = [of_pair, name, max_features](const StereoRig& rig,
                                                    const FrontendOptions&) -> Result<std::unique_ptr<Frontend>> {
    try {
      return for_any_rig(rig, max_features, of_pair);
    } catch (const std::exception& e) {
      return Error{ErrorCode::invalid_argument, "the frontend \"" + name + "\": " + e.what()};
    }
  };
  check(register_frontend({name, meaning, of_rig}));
  makers().push_back(std::move(maker));
}

Array<double> rows_of(const SensorPacket& packet, Vec3 ImuSample::*vector) {
  return columns(packet.imu.samples, [vector](const ImuSample& s) { return s.*vector; });
}

}  // namespace

std::vector<std::shared_ptr<Kept>> newly_made_frontends() {
  std::vector<std::shared_ptr<Kept>> out;
  for (const std::weak_ptr<Kept>& frontend : std::exchange(made(), {}))
    if (std::shared_ptr<Kept> alive = frontend.lock()) out.push_back(std::move(alive));
  return out;
}

void bind_frontend(nb::module_& m) {
  nb::class_<SensorPacket>(m, "SensorPacket", "A frame and the IMU's readings since the frame before: what a frontend is given.")
      .def_prop_ro(
          "frame", [](const SensorPacket& p) { return p.frame; }, "StereoFrame, of the cameras of the frontend's rig")
      .def_prop_ro(
          "imu_t",
          [](const SensorPacket& p) { return column<std::int64_t>(p.imu.samples, [](const ImuSample& s) { return s.t.ns; }); },
          "int64 (M,), ns")
      .def_prop_ro(
          "gyro", [](const SensorPacket& p) { return rows_of(p, &ImuSample::gyro_radps); }, "float64 (M, 3), rad/s in B")
      .def_prop_ro(
          "accel", [](const SensorPacket& p) { return rows_of(p, &ImuSample::accel_mps2); }, "float64 (M, 3), m/s^2 in B");
  nb::class_<StatePrior>(m, "StatePrior", "The estimator's newest state, usually of two frames ago, for predictions.")
      .def_ro("valid", &StatePrior::valid, "False before the first start")
      .def_prop_ro(
          "t", [](const StatePrior& s) { return s.t.ns; }, "ns")
      .def_prop_ro(
          "T_GB", [](const StatePrior& s) { return to_array(s.T_GB); }, "float64 (4, 4), in the window's own frame G")
      .def_prop_ro(
          "v", [](const StatePrior& s) { return to_array(s.v_GB); }, "float64 (3,), m/s in G")
      .def_prop_ro(
          "gyro_bias", [](const StatePrior& s) { return to_array(s.bias.gyro_radps); }, "float64 (3,), rad/s")
      .def_prop_ro(
          "gravity", [](const StatePrior& s) { return to_array(s.gravity_G); }, "float64 (3,), m/s^2 in G");
  m.def(
      "register_frontend", &add_frontend, "name"_a, "make"_a, "meaning"_a = "in Python", "max_features"_a = 150,
      "sigma_px"_a = 0.5,
      nb::sig("def register_frontend(name: str, make: typing.Callable[[Rig], typing.Any], meaning: str = 'in Python', "
              "max_features: int = 150, sigma_px: float = 0.5) -> None"),
      "A frontend of your own under a name, for `run`, `System` and configurations. make(rig) is called for each camera, or pair of\n"
      "cameras that overlap, and returns an object with process(packet, prior), called with a SensorPacket and a StatePrior for each\n"
      "frame. It returns (ids, left, right): int64 (N,), numbers that stay as long as a feature is followed, new ones larger than\n"
      "all before; float64 (N, 2), where it is in the left image, px, the top left pixel's centre being (0, 0), NaN where it is not\n"
      "seen; the same of the right image, or None. sigma_px: standard deviation of these positions. max_features: what it follows in\n"
      "a rig of two cameras. ValueError for a name that is taken. A frontend that raises ends the run: RuntimeError with its text.");
}

}  // namespace fbvins::python
