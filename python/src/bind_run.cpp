// SPDX-License-Identifier: Apache-2.0
// A whole recording in one call, as `fbvins run` does it and by the same function.
#include <fmt/format.h>

#include <limits>

#include "apps/run_flight.hpp"
#include "bindings.hpp"
#include "fbvins/io/dataset.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

struct PyRun {
  Config config;
  app::Flight flight;
  app::RunSummary summary;
  std::vector<TrajectoryPoint> truth;

  const std::vector<Odometry>& odometry() const { return flight.run.odometry; }
  const std::vector<app::TrackedRecord>& tracked() const { return flight.run.tracked; }
};

/// Frames between two checks for signals and calls of `progress`.
constexpr int kFramesBetweenChecks = 16;

PyRun run(Dataset& data, const Config& config, bool threaded, bool loop, bool final_ba, bool boosted_map,
          const std::string& load_map, const std::string& save_map, const std::string& vocabulary, const std::string& imu_state,
          const std::string& positions, const std::string& tags, nb::handle progress) {
  if (data.begun()) throw nb::value_error("this recording has been iterated already: open it again");
  app::FlightArguments arguments;
  arguments.map = {loop, final_ba, boosted_map, load_map, save_map, vocabulary, positions, tags};
  arguments.imu_state = imu_state;
  arguments.threaded = threaded;
  const int all = static_cast<int>(data.frames().size());
  const auto on_frame = [&](int frames) {
    if (frames % kFramesBetweenChecks != 0 && frames != all) return;
    const nb::gil_scoped_acquire acquired;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (!progress.is_none()) progress(frames, all);
  };
  PyRun out;
  auto flight = [&] {
    nb::gil_scoped_release released;
    return app::run_flight(arguments, config, data, {.on_frame = on_frame});
  }();
  out.flight = value_or_raise(std::move(flight));
  if (out.flight.map && !out.flight.map->not_saved.empty()) raise(Error{ErrorCode::unwritable, out.flight.map->not_saved});
  out.config = config;
  out.summary = app::summarise(out.flight, data, config, arguments);
  out.truth = data.ground_truth();
  return out;
}

template <class Frame>
PyTrajectory plain(const Trajectory<Frame>& trajectory) {
  return trajectory;
}

/// One of the map's trajectories, or None.
template <Trajectory<M> app::MapRecord::*kWhich>
nb::object map_trajectory(const PyRun& run) {
  if (!run.flight.map) return nb::none();
  return nb::cast(plain((*run.flight.map).*kWhich));
}

std::vector<std::string> health_of(const PyRun& run, bool reason) {
  std::vector<std::string> out;
  for (const Odometry& o : run.odometry()) out.emplace_back(reason ? to_string(o.health.reason) : to_string(o.health.state));
  return out;
}

nb::object text_array(const std::vector<std::string>& texts) {
  return nb::module_::import_("numpy").attr("array")(nb::cast(texts), nb::arg("dtype") = "U");
}

nb::dict frontend_statistics(const PyRun& run) {
  nb::dict out;
  const auto add = [&]<class T>(const char* name, T FrontendStats::*field) {
    out[name] = column<T>(run.tracked(), [&](const app::TrackedRecord& r) { return r.stats.*field; });
  };
  out["t"] = column<std::int64_t>(run.tracked(), [](const app::TrackedRecord& r) { return r.t.ns; });
  using S = FrontendStats;
  add("tracked", &S::tracked), add("detected", &S::detected), add("stereo", &S::stereo), add("lost_flow", &S::lost_flow);
  add("lost_check", &S::lost_check), add("lost_epipolar", &S::lost_epipolar), add("expected", &S::expected);
  add("recognised", &S::recognised), add("median_motion_px", &S::median_motion_px);
  out["matches"] = column<int>(run.tracked(), [](const app::TrackedRecord& r) { return r.stats.matches.found; });
  out["match_inliers"] = column<int>(run.tracked(), [](const app::TrackedRecord& r) { return r.stats.matches.inliers; });
  out["frontend_ms"] = column<double>(run.tracked(), [](const app::TrackedRecord& r) { return r.stats.total_ms(); });
  return out;
}

nb::dict estimator_statistics(const PyRun& run) {
  nb::dict out;
  const auto add = [&]<class T>(const char* name, T EstimatorStats::*field) {
    out[name] = column<T>(run.odometry(), [&](const Odometry& o) { return o.stats.*field; });
  };
  using S = EstimatorStats;
  out["t"] = column<std::int64_t>(run.odometry(), [](const Odometry& o) { return o.t.ns; });
  add("frames_in_window", &S::frames_in_window), add("landmarks", &S::landmarks), add("known_landmarks", &S::known_landmarks);
  add("observations", &S::observations), add("iterations", &S::iterations), add("outliers", &S::outliers);
  add("initial_cost", &S::initial_cost), add("final_cost", &S::final_cost);
  out["keyframe"] = column<std::uint8_t>(run.odometry(), [](const Odometry& o) { return o.stats.keyframe; });
  out["standstill"] = column<std::uint8_t>(run.odometry(), [](const Odometry& o) { return o.stats.standstill; });
  out["estimator_ms"] = column<double>(run.odometry(), [](const Odometry& o) { return o.stats.total_ms(); });
  return out;
}

PyTrajectory truth_of(const PyRun& run) {
  PyTrajectory truth;
  for (const TrajectoryPoint& p : run.truth) truth.poses.push_back({p.t, {p.T_WB.q, p.T_WB.p}});
  return truth;
}

void bind_rows(nb::class_<PyRun>& c) {
  const auto rows = [&]<class Function>(const char* name, Function of, const char* doc) {
    const auto or_nan = [of](const Odometry& o) {
      auto value = of(o);
      if (!o.health.has_pose()) value.setConstant(std::numeric_limits<double>::quiet_NaN());
      return value;
    };
    c.def_prop_ro(
        name, [or_nan](const PyRun& r) { return columns(r.odometry(), or_nan); }, doc);
  };
  c.def_prop_ro(
      "t", [](const PyRun& r) { return column<std::int64_t>(r.odometry(), [](const Odometry& o) { return o.t.ns; }); },
      "int64 (N,), ns: one row per image, here and below");
  c.def_prop_ro(
      "has_pose",
      [](const PyRun& r) {
        return nb::cast(column<std::uint8_t>(r.odometry(), [](const Odometry& o) { return o.health.has_pose(); }))
            .attr("astype")("bool");
      },
      "bool (N,): where it is False, all numbers of the estimate are NaN", nb::sig("def has_pose(self) -> numpy.ndarray"));
  rows(
      "p", [](const Odometry& o) { return o.T_WB.p; }, "float64 (N, 3), p_WB, m in W");
  rows(
      "q", [](const Odometry& o) { return wxyz(o.T_WB.q); }, "float64 (N, 4), body to W, w first");
  rows(
      "v", [](const Odometry& o) { return o.v_WB; }, "float64 (N, 3), v_WB, m/s in W");
  rows(
      "w", [](const Odometry& o) { return o.w_WB_B; }, "float64 (N, 3), w_WB_B, rad/s in B");
  rows(
      "gyro_bias", [](const Odometry& o) { return o.bias.gyro_radps; }, "float64 (N, 3), rad/s");
  rows(
      "accel_bias", [](const Odometry& o) { return o.bias.accel_mps2; }, "float64 (N, 3), m/s^2");
  rows(
      "covariance", [](const Odometry& o) { return o.pose_covariance; },
      "float64 (N, 6, 6), of (dp in W [m], dtheta in B [rad])");
  rows(
      "velocity_covariance", [](const Odometry& o) { return o.velocity_covariance; }, "float64 (N, 3, 3), m^2/s^2");
  rows(
      "gyro_bias_covariance", [](const Odometry& o) { return o.gyro_bias_covariance; }, "float64 (N, 3, 3), rad^2/s^2");
  rows(
      "accel_bias_covariance", [](const Odometry& o) { return o.accel_bias_covariance; }, "float64 (N, 3, 3), m^2/s^4");
  c.def_prop_ro(
      "health", [](const PyRun& r) { return text_array(health_of(r, false)); }, "str (N,): initialising, good, degraded or lost",
      nb::sig("def health(self) -> numpy.ndarray"));
  c.def_prop_ro(
      "reason", [](const PyRun& r) { return text_array(health_of(r, true)); }, "str (N,)",
      nb::sig("def reason(self) -> numpy.ndarray"));
  c.def_prop_ro(
      "reset_counter",
      [](const PyRun& r) { return column<std::int64_t>(r.odometry(), [](const Odometry& o) { return o.reset_counter; }); },
      "int64 (N,): W is a new frame where it increases");
  c.def_prop_ro(
      "tilt_sigma_rad",
      [](const PyRun& r) {
        return column<double>(r.odometry(), [](const Odometry& o) {
          return o.health.has_pose() ? o.tilt_sigma_rad : std::numeric_limits<double>::quiet_NaN();
        });
      },
      "float64 (N,): standard deviation of the tilt about its less certain axis");
}

}  // namespace

void bind_run(nb::module_& m) {
  nb::class_<PyRun> c(m, "Run", "Result of a run: arrays with one row per image, trajectories, statistics.");
  bind_rows(c);
  c.def_prop_ro(
      "trajectory", [](const PyRun& r) { return plain(r.flight.run.poses()); }, "Trajectory in W: the images that have a pose");
  c.def_prop_ro("ground_truth", &truth_of, "Trajectory of the recording's ground truth, empty where there is none");
  c.def_prop_ro("odometry", &PyRun::odometry, "The list of Odometry.");
  c.def_prop_ro("map_trajectory", &map_trajectory<&app::MapRecord::final>, "Trajectory in M after the run; None without a map");
  c.def_prop_ro("map_adjusted", &map_trajectory<&app::MapRecord::adjusted>, "the same after bundle adjustment (final_ba)");
  c.def_prop_ro("map_causal", &map_trajectory<&app::MapRecord::causal>, "Trajectory in M as known at each moment");
  c.def_prop_ro("map_bounded", &map_trajectory<&app::MapRecord::bounded>, "the same by T_MW_smooth: without jumps");
  c.def_prop_ro("frontend_statistics", &frontend_statistics, "dict of (N,) arrays; frontend_ms is CPU time");
  c.def_prop_ro("estimator_statistics", &estimator_statistics, "dict of (N,) arrays; estimator_ms is CPU time");
  c.def_prop_ro(
      "config", [](const PyRun& r) { return r.config; }, "the effective Config");
  c.def_prop_ro(
      "summary", [](const PyRun& r) { return app::to_json_text(r.summary); }, "summary.json of `fbvins run`, as text");
  c.def(
      "save",
      [](const PyRun& r, const std::string& folder) { check(app::write_flight(r.flight, r.summary, r.config, r.truth, folder)); },
      "folder"_a, "Writes the files of `fbvins run --out FOLDER`, the same to the byte.");
  c.def("__str__", [](const PyRun& r) { return app::to_text(r.summary); });
  c.def("__repr__", [](const PyRun& r) {
    return fmt::format("<fbvins.Run of {} with {}: {} poses of {} images>", r.summary.dataset, r.summary.frontend,
                       r.summary.coverage.with_pose, r.summary.coverage.images);
  });

  m.def("run", &run, "recording"_a, "config"_a, "threaded"_a, "loop"_a, "final_ba"_a, "boosted_map"_a, "load_map"_a, "save_map"_a,
        "vocabulary"_a, "imu_state"_a, "positions"_a, "tags"_a, "progress"_a.none());
}

}  // namespace fbvins::python
