// SPDX-License-Identifier: Apache-2.0
// Recordings and simulations as iterators of sensor events in order of time.
#include <fmt/format.h>

#include "bindings.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/sim/simulation.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

Recording open(const std::string& path, const std::string& calibration, const std::string& imu_calibration, int skip, int most,
               double start_s, double duration_s, const std::vector<std::string>& topics) {
  const RecordingOptions options{{.skip_frames = skip, .max_frames = most, .start_s = start_s, .duration_s = duration_s},
                                 calibration,
                                 imu_calibration,
                                 topics};
  return value_or_raise([&] {
    nb::gil_scoped_release released;
    return open_recording(path, options);
  }());
}

Recording simulate(const std::string& preset, int seed, double seconds) {
  auto options = value_or_raise(simulation_preset(preset));
  options.seed = seed;
  if (seconds > 0) options.flight.duration_s = seconds;
  auto contents = [&] {
    nb::gil_scoped_release released;
    return fbvins::simulate(options, fmt::format("{}-{}", preset, seed));
  }();
  return std::make_unique<Dataset>(value_or_raise(std::move(contents)), DatasetOptions{});
}

nb::object next(Dataset& data) {
  auto event = [&] {
    nb::gil_scoped_release released;
    return data.next();
  }();
  if (!event) throw nb::stop_iteration();
  return std::visit(
      Overloaded{[](AidingSample&& reading) { return std::visit([](auto&& r) { return nb::cast(r); }, std::move(reading)); },
                 [](auto&& value) { return nb::cast(std::forward<decltype(value)>(value)); }},
      std::move(*event));
}

PyTrajectory truth_of(const Dataset& data) {
  PyTrajectory truth;
  for (const TrajectoryPoint& p : data.ground_truth()) truth.poses.push_back({p.t, {p.T_WB.q, p.T_WB.p}});
  return truth;
}

nb::object pixels(const std::shared_ptr<const Image>& image) {
  if (!image) return nb::none();
  auto* kept = new std::shared_ptr<const Image>(image);
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::shared_ptr<const Image>*>(p); });
  const std::size_t shape[] = {static_cast<std::size_t>(image->height()), static_cast<std::size_t>(image->width())};
  return nb::cast(nb::ndarray<nb::numpy, const std::uint8_t>(image->row(0), 2, shape, owner));
}

nb::object depths(const std::shared_ptr<const DepthImage>& depth) {
  if (!depth) return nb::none();
  return nb::cast(to_array(depth->mm, {static_cast<std::size_t>(depth->height), static_cast<std::size_t>(depth->width)}));
}

void bind_measurements(nb::module_& m) {
  nb::class_<ImuSample>(m, "ImuSample", "One reading of the IMU, in B.")
      .def_prop_ro(
          "t", [](const ImuSample& s) { return s.t.ns; }, "ns of the sensors' clock")
      .def_prop_ro(
          "gyro", [](const ImuSample& s) { return to_array(s.gyro_radps); }, "(3,), rad/s")
      .def_prop_ro(
          "accel", [](const ImuSample& s) { return to_array(s.accel_mps2); }, "(3,), specific force, m/s^2: +g upwards at rest")
      .def("__repr__", [](const ImuSample& s) { return fmt::format("<fbvins.ImuSample t={} ns>", s.t.ns); });

  nb::class_<StereoFrame>(m, "StereoFrame", "Images taken at the same instant.")
      .def_prop_ro(
          "t", [](const StereoFrame& f) { return f.t.ns; }, "ns of the cameras' clock")
      .def_prop_ro(
          "left", [](const StereoFrame& f) { return pixels(f.left()); }, "uint8 (height, width), read-only; None: missing")
      .def_prop_ro(
          "right", [](const StereoFrame& f) { return pixels(f.right()); }, "uint8 (height, width), read-only; None: missing")
      .def_prop_ro(
          "more",
          [](const StereoFrame& f) {
            nb::list out;
            for (std::size_t i = 2; i < f.images.size(); ++i) out.append(pixels(f.images[i]));
            return out;
          },
          nb::sig("def more(self) -> list[numpy.ndarray | None]"), "the same of the cameras from number 2 on")
      .def_prop_ro(
          "offsets",
          [](const StereoFrame& f) {
            std::vector<std::int64_t> out;
            for (int i = 0; i < std::max(2, static_cast<int>(f.images.size())); ++i) out.push_back(f.offsets.of(i).ns);
            return out;
          },
          "how long after t each camera took its image, ns: zeros with a common trigger")
      .def_prop_ro(
          "depth", [](const StereoFrame& f) { return depths(f.depth); },
          "uint16 (height, width), mm, 0 where nothing was measured; None: no depth image")
      .def("__repr__", [](const StereoFrame& f) { return fmt::format("<fbvins.StereoFrame t={} ns>", f.t.ns); });
}

void bind_dataset(nb::module_& m) {
  nb::class_<Dataset>(
      m, "Recording",
      "A stereo-inertial recording, or a simulation: an iterator of ImuSample, StereoFrame and readings of other sensors in order "
      "of time. "
      "It can be iterated once: ValueError when it is begun again after its end.",
      nb::dynamic_attr())
      .def_prop_ro("rig", &Dataset::rig, "the calibration")
      .def_prop_ro("name", [](const Dataset& d) { return d.info().name; })
      .def_prop_ro("format", [](const Dataset& d) { return d.info().format; })
      .def_prop_ro(
          "warnings", [](const Dataset& d) { return d.info().warnings; }, "its faults, a sentence each")
      .def_prop_ro(
          "image_stamps",
          [](const Dataset& d) { return column<std::int64_t>(d.frames(), [](const FrameEntry& f) { return f.t.ns; }); },
          "int64 (N,), ns")
      .def_prop_ro("ground_truth", &truth_of, "Trajectory of B, empty where there is none")
      .def(
          "__len__", [](const Dataset& d) { return d.frames().size(); }, "stereo frames")
      .def(
          "__iter__",
          [](nb::handle self) {
            if (nb::cast<const Dataset&>(self).at_end())
              throw nb::value_error("this recording has been read to its end: open it again");
            return nb::borrow(self);
          },
          nb::sig("def __iter__(self) -> Recording"))
      .def("__next__", &next,
           nb::sig("def __next__(self) -> ImuSample | StereoFrame | RangeSample | VelocitySample | PressureSample"))
      .def("__repr__", [](const Dataset& d) {
        return fmt::format("<fbvins.Recording {} ({}), {} frames>", d.info().name, d.info().format, d.frames().size());
      });
}

}  // namespace

void bind_recording(nb::module_& m) {
  bind_measurements(m);
  bind_dataset(m);
  m.def("open", &open, "path"_a, "calibration"_a = "", "imu_calibration"_a = "", "skip_frames"_a = 0, "max_frames"_a = 0,
        "start_s"_a = 0.0, "duration_s"_a = 0.0, "topics"_a = std::vector<std::string>{});
  m.def("simulate", &simulate, "preset"_a = "normal", "seed"_a = 1, "seconds"_a = 0.0);
  m.def("simulation_presets", &simulation_presets, "Names of the simulator's presets.");
}

}  // namespace fbvins::python
