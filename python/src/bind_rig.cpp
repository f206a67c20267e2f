// SPDX-License-Identifier: Apache-2.0
// Cameras, IMU and how they are joined.
#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/variant.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <variant>

#include "bindings.hpp"
#include "fbvins/bags/calibration.hpp"
#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/rig_text.hpp"

namespace fbvins::python {
namespace {

Camera make_camera(int width, int height, double fx, double fy, double cx, double cy, const std::string& model,
                   const std::vector<double>& distortion, nb::handle mask) {
  static const std::map<std::string, std::pair<std::string, std::size_t>> kModels = {{"radtan", {"pinhole-radtan", 4}},
                                                                                     {"equidistant", {"pinhole-equidistant", 4}},
                                                                                     {"ds", {"ds", 2}},
                                                                                     {"eucm", {"eucm", 2}},
                                                                                     {"omni", {"omni-radtan", 5}},
                                                                                     {"radtan5", {"pinhole-radtan5", 5}},
                                                                                     {"rational", {"pinhole-rational", 8}}};
  const auto known = kModels.find(model);
  if (known == kModels.end())
    throw nb::value_error(
        fmt::format("model: 'radtan', 'radtan5', 'rational', 'equidistant', 'ds', 'eucm' or 'omni' is expected, not '{}'", model)
            .c_str());
  const auto& [name, count] = known->second;
  const std::vector<double> k = distortion.empty() && count == 4 ? std::vector<double>(4, 0.0) : distortion;
  if (k.size() != count)
    throw nb::value_error(fmt::format("distortion: {} numbers are expected, not {}", count, distortion.size()).c_str());
  if (width < 1 || height < 1 || !(fx > 0) || !(fy > 0))
    throw nb::value_error("a camera has a size in pixels and positive focal lengths");
  const std::optional<LensModel> lens = lens_of(name, {fx, fy, cx, cy}, k);
  if (!lens) throw nb::value_error(fmt::format("distortion: {}", outside_of_model(model, k)).c_str());
  Camera camera(*lens, width, height);
  if (mask.is_none()) return camera;
  const auto seen = checked<std::uint8_t>(mask, "mask", {height, width});
  Image image(width, height);
  std::copy_n(seen.data, static_cast<std::size_t>(width) * height, image.row(0));
  camera.set_mask(std::make_shared<const Mask>(image));
  return camera;
}

nb::object mask_of(const Camera& camera) {
  if (!camera.mask()) return nb::none();
  const Image image = camera.mask()->image();
  std::vector<std::uint8_t> pixels(image.row(0), image.row(0) + static_cast<std::size_t>(image.width()) * image.height());
  return nb::cast(
      to_array(std::move(pixels), {static_cast<std::size_t>(image.height()), static_cast<std::size_t>(image.width())}));
}

std::string text_of(const Camera& camera) {
  const std::array<double, 4> f = camera.intrinsics();
  return fmt::format("<fbvins.Camera {} {}x{} px, f = ({:.1f}, {:.1f}), c = ({:.1f}, {:.1f})>", camera.model_name(),
                     camera.width(), camera.height(), f[0], f[1], f[2], f[3]);
}

/// A number of all cameras, or one of each.
using OneOrEach = std::variant<double, std::vector<double>>;

std::vector<double> of_each(const OneOrEach& given, const char* name, std::size_t cameras) {
  if (const double* one = std::get_if<double>(&given)) return std::vector<double>(cameras, *one);
  const auto& each = std::get<std::vector<double>>(given);
  if (each.size() != cameras)
    throw nb::value_error(fmt::format("{}: the rig has {} cameras, not {}", name, cameras, each.size()).c_str());
  return each;
}

StereoRig make_rig(const Camera& left, const Camera* right, nb::handle T_BC0, nb::handle T_BC1, const ImuNoise& imu_noise,
                   double image_rate_hz, const OneOrEach& time_offset_s, const DepthSensor* depth,
                   const std::vector<std::pair<Camera, nb::object>>& more, const OneOrEach& line_delay_s) {
  if ((right == nullptr) != T_BC1.is_none()) throw nb::value_error("right and T_BC1 go together: give both, or neither");
  std::vector<MountedCamera> cameras{{left, transform<B, C0>(T_BC0, "T_BC0")}};
  if (right != nullptr) cameras.push_back({*right, transform<B, C0>(T_BC1, "T_BC1")});
  if (right == nullptr && !more.empty()) throw nb::value_error("more: further cameras go with a left and a right one");
  for (const auto& [camera, T_BC] : more) cameras.push_back({camera, transform<B, C0>(T_BC, "more")});
  if (right != nullptr && depth != nullptr) throw nb::value_error("a depth sensor goes with one camera: without a right one");
  StereoRig rig = with_cameras({}, cameras);
  const auto count = static_cast<std::size_t>(rig.camera_count());
  const std::vector<double> offsets_s = of_each(time_offset_s, "time_offset_s", count),
                            delays_s = of_each(line_delay_s, "line_delay_s", count);
  std::vector<CameraTimes> times;
  for (std::size_t i = 0; i < count; ++i) times.push_back({offsets_s[i], delays_s[i]});
  rig = with_times(rig, times);
  if (depth != nullptr) rig = with_depth(rig, *depth);
  rig.imu_noise = imu_noise;
  rig.image_rate_hz = image_rate_hz;
  if (const Result<void> good = check_rig(rig, "the rig"); !good) throw nb::value_error(good.error().message.c_str());
  return rig;
}

std::vector<double> each_of(const StereoRig& rig, double CameraTimes::*figure) {
  std::vector<double> out;
  for (int i = 0; i < rig.camera_count(); ++i) out.push_back(rig.times(i).*figure);
  return out;
}

void bind_camera(nb::module_& m) {
  nb::class_<Camera>(m, "Camera", "A camera: image size and lens model. Lengths in pixels.")
      .def(
          nb::new_(&make_camera), "width"_a, "height"_a, "fx"_a, "fy"_a, "cx"_a, "cy"_a, "model"_a = "radtan",
          "distortion"_a = std::vector<double>{}, "mask"_a = nb::none(),
          "model and its distortion: 'radtan' (k1, k2, p1, p2; OpenCV's and Kalibr's), 'equidistant' (k1..k4; Kalibr's, OpenCV's\n"
          "fisheye), 'radtan5' (k1, k2, p1, p2, k3; ROS's plumb_bob), 'rational' (k1, k2, p1, p2, k3..k6; OpenCV's), 'ds' (xi,\n"
          "alpha), 'eucm' (alpha, beta) or 'omni' (xi, k1, k2, p1, p2; Kalibr's omni with radtan, MEI).\n"
          "mask: uint8 (height, width), 0 where the image does not show the world, 255 elsewhere; None: all of it is used.")
      .def_prop_ro("width", &Camera::width, "px")
      .def_prop_ro("height", &Camera::height, "px")
      .def_prop_ro("model", &Camera::model_name)
      .def_prop_ro("intrinsics", &Camera::intrinsics, "fx, fy, cx, cy in px")
      .def_prop_ro("distortion", &Camera::distortion, "the model's parameters, in the order above")
      .def_prop_ro("mask", &mask_of, "uint8 (height, width): 0 where the image does not show the world; None without a mask")
      .def("__repr__", &text_of);
}

void bind_imu_axes(nb::module_& m) {
  const auto matrix = [](const std::vector<std::vector<double>>& rows, const char* name) {
    Mat3 out;
    if (rows.size() != 3) throw nb::value_error(fmt::format("{} is not a matrix of 3 rows", name).c_str());
    for (int i = 0; i < 3; ++i) {
      if (rows[i].size() != 3) throw nb::value_error(fmt::format("{} is not a matrix of 3 columns", name).c_str());
      for (int j = 0; j < 3; ++j) out(i, j) = rows[i][j];
    }
    return out;
  };
  const auto rows = [](const Mat3& of) {
    std::vector<std::vector<double>> out(3);
    for (int i = 0; i < 3; ++i) out[i] = {of(i, 0), of(i, 1), of(i, 2)};
    return out;
  };
  nb::class_<ImuIntrinsics>(m, "ImuIntrinsics",
                            "Scale and axes of an IMU: it reads gyro @ rate + gyro_by_force @ force + gyro_bias, accel @ force + "
                            "accel_bias.")
      .def(
          "__init__",
          [matrix](ImuIntrinsics* self, const std::vector<std::vector<double>>& gyro,
                   const std::vector<std::vector<double>>& accel, const std::vector<std::vector<double>>& gyro_by_force,
                   std::array<double, 3> gyro_bias, std::array<double, 3> accel_bias) {
            ImuIntrinsics axes{matrix(gyro, "gyro"),
                               matrix(accel, "accel"),
                               matrix(gyro_by_force, "gyro_by_force"),
                               {Vec3(gyro_bias.data()), Vec3(accel_bias.data())}};
            if (const Result<void> good = check_imu({.axes = axes}, "axes"); !good)
              throw nb::value_error(good.error().message.c_str());
            new (self) ImuIntrinsics(axes);
          },
          nb::kw_only(), "gyro"_a = rows(Mat3::Identity()), "accel"_a = rows(Mat3::Identity()),
          "gyro_by_force"_a = rows(Mat3::Zero()), "gyro_bias"_a = std::array<double, 3>{},
          "accel_bias"_a = std::array<double, 3>{})
      .def_prop_ro("gyro", [rows](const ImuIntrinsics& a) { return rows(a.gyro); })
      .def_prop_ro("accel", [rows](const ImuIntrinsics& a) { return rows(a.accel); })
      .def_prop_ro(
          "gyro_by_force", [rows](const ImuIntrinsics& a) { return rows(a.gyro_by_force); }, "rad/s for each m/s^2")
      .def_prop_ro(
          "gyro_bias",
          [](const ImuIntrinsics& a) {
            return std::array{a.bias.gyro_radps.x(), a.bias.gyro_radps.y(), a.bias.gyro_radps.z()};
          },
          "rad/s")
      .def_prop_ro(
          "accel_bias",
          [](const ImuIntrinsics& a) {
            return std::array{a.bias.accel_mps2.x(), a.bias.accel_mps2.y(), a.bias.accel_mps2.z()};
          },
          "m/s^2");
}

void bind_imu_noise(nb::module_& m) {
  nb::class_<ImuNoise>(m, "ImuNoise", "Continuous-time noise of an IMU, as in calibration files.")
      .def(
          "__init__",
          [](ImuNoise* self, double gyro, double accel, double gyro_walk, double accel_walk, double rate_hz,
             const ImuIntrinsics* axes) {
            for (const double figure : {gyro, accel, gyro_walk, accel_walk, rate_hz})
              if (!(figure > 0 && std::isfinite(figure)))
                throw nb::value_error("noise densities, random walks and the rate are positive");
            ImuNoise imu{gyro, accel, gyro_walk, accel_walk, rate_hz};
            if (axes != nullptr) imu.axes = *axes;
            new (self) ImuNoise(imu);
          },
          nb::kw_only(), "gyro_noise_density"_a = ImuNoise{}.gyro_noise_density_radps_rthz,
          "accel_noise_density"_a = ImuNoise{}.accel_noise_density_mps2_rthz,
          "gyro_random_walk"_a = ImuNoise{}.gyro_random_walk_radps2_rthz,
          "accel_random_walk"_a = ImuNoise{}.accel_random_walk_mps3_rthz, "rate_hz"_a = ImuNoise{}.rate_hz,
          "axes"_a.none() = nb::none())
      .def_ro("gyro_noise_density", &ImuNoise::gyro_noise_density_radps_rthz, "rad/s/sqrt(Hz)")
      .def_ro("accel_noise_density", &ImuNoise::accel_noise_density_mps2_rthz, "m/s^2/sqrt(Hz)")
      .def_ro("gyro_random_walk", &ImuNoise::gyro_random_walk_radps2_rthz, "rad/s^2/sqrt(Hz)")
      .def_ro("accel_random_walk", &ImuNoise::accel_random_walk_mps3_rthz, "m/s^3/sqrt(Hz)")
      .def_ro("rate_hz", &ImuNoise::rate_hz)
      .def_ro("axes", &ImuNoise::axes, "scale and axes");
}

void bind_depth_sensor(nb::module_& m) {
  nb::class_<DepthSensor>(
      m, "DepthSensor",
      "A sensor of depth images that are registered to the left camera, pixel by pixel, or have a lens and a pose "
      "of their own.")
      .def(
          "__init__",
          [](DepthSensor* self, double noise_at_1m, double nearest, double farthest, double scale_sigma, const Camera* camera,
             nb::handle T_BD) {
            if ((camera == nullptr) != T_BD.is_none())
              throw nb::value_error("camera and T_BD go together: give both, or neither");
            std::optional<MountedCamera> own;
            if (camera != nullptr) own = MountedCamera{*camera, transform<B, C0>(T_BD, "T_BD")};
            new (self) DepthSensor{noise_at_1m, nearest, farthest, scale_sigma, own};
          },
          nb::kw_only(), "noise_at_1m"_a = DepthSensor{}.noise_at_1m_m, "nearest"_a = DepthSensor{}.nearest_m,
          "farthest"_a = DepthSensor{}.farthest_m, "scale_sigma"_a = DepthSensor{}.scale_sigma, "camera"_a.none() = nb::none(),
          "T_BD"_a = nb::none(),
          "noise_at_1m: standard deviation at one metre, m; it grows with the square of the distance. nearest, farthest: what is\n"
          "used, m. scale_sigma: relative standard deviation of what all distances are wrong by together.\n"
          "camera, T_BD: of a sensor whose images are not registered, in whose pixels they are and along whose z it measures;\n"
          "float64 (4, 4), takes its coordinates to the IMU's, m.")
      .def_ro("noise_at_1m", &DepthSensor::noise_at_1m_m, "m")
      .def_ro("nearest", &DepthSensor::nearest_m, "m")
      .def_ro("farthest", &DepthSensor::farthest_m, "m")
      .def_ro("scale_sigma", &DepthSensor::scale_sigma)
      .def_prop_ro(
          "camera", [](const DepthSensor& sensor) { return sensor.own ? std::optional(sensor.own->camera) : std::nullopt; },
          "its own; None: the images are registered to the left camera")
      .def_prop_ro(
          "T_BD",
          [](const DepthSensor& sensor) { return sensor.own ? nb::cast(to_array(sensor.own->T_BC)) : nb::object(nb::none()); },
          nb::sig("def T_BD(self) -> numpy.ndarray | None"), "(4, 4), its own pose; None without");
}

void bind_stereo_rig(nb::module_& m) {
  nb::class_<StereoRig>(
      m, "Rig",
      "One to eight cameras and an IMU, rigidly joined. B is the IMU, C0 and C1 are the left and right camera. A\n"
      "rig of one camera has it as the left one, without a right one and T_BC1; its right one is 0 px wide then.")
      .def(
          nb::new_(&make_rig), "left"_a, "right"_a.none() = nb::none(), "T_BC0"_a = nb::none(), "T_BC1"_a = nb::none(),
          "imu_noise"_a = ImuNoise{}, "image_rate_hz"_a = 20.0, "time_offset_s"_a = 0.0, "depth"_a.none() = nb::none(),
          "more"_a = std::vector<std::pair<Camera, nb::object>>{}, "line_delay_s"_a = 0.0,
          "T_BC0, T_BC1: float64 (4, 4), take camera to IMU coordinates, metres. time_offset_s: t_imu = t_image + offset. depth:\n"
          "a DepthSensor, with one camera. more: the cameras from number 2 on, each (Camera, T_BC). line_delay_s: of a rolling\n"
          "shutter, from row to row. time_offset_s and line_delay_s: one number, or one of each camera.")
      .def_prop_ro("left", &StereoRig::left)
      .def_prop_ro("right", &StereoRig::right)
      .def_prop_ro(
          "T_BC0", [](const StereoRig& rig) { return to_array(rig.T_BC0()); }, "(4, 4), left camera to IMU, m")
      .def_prop_ro(
          "T_BC1", [](const StereoRig& rig) { return to_array(rig.T_BC1()); }, "(4, 4), right camera to IMU, m")
      .def_prop_ro(
          "more",
          [](const StereoRig& rig) {
            nb::list out;
            for (int i = 2; i < rig.camera_count(); ++i) out.append(nb::make_tuple(rig.camera(i), to_array(rig.T_BC(i))));
            return out;
          },
          nb::sig("def more(self) -> list[tuple[Camera, numpy.ndarray]]"),
          "The cameras from number 2 on, each with its T_BC, (4, 4), m")
      .def_prop_ro(
          "depth", [](const StereoRig& rig) { return rig.depth; }, "the DepthSensor; None without")
      .def_ro("imu_noise", &StereoRig::imu_noise)
      .def_ro("image_rate_hz", &StereoRig::image_rate_hz)
      .def_ro("time_offset_s", &StereoRig::time_offset_s, "t_imu = t_image + time_offset_s, of camera 0")
      .def_prop_ro(
          "time_offsets_s", [](const StereoRig& rig) { return each_of(rig, &CameraTimes::time_offset_s); }, "of each camera")
      .def_prop_ro(
          "line_delays_s", [](const StereoRig& rig) { return each_of(rig, &CameraTimes::line_delay_s); },
          "of each camera: of a rolling shutter, from row to row; 0 for a global one")
      .def("__reduce__", [](const StereoRig& rig) { return reduced("rig", nb::cast(rig_to_yaml(rig))); })
      .def("__repr__", [](const StereoRig& rig) {
        if (!rig.has_right()) return fmt::format("<fbvins.Rig {}, IMU {:g} Hz>", text_of(rig.left()), rig.imu_noise.rate_hz);
        if (rig.camera_count() > 2)
          return fmt::format("<fbvins.Rig {} and {} further cameras, IMU {:g} Hz>", text_of(rig.left()), rig.camera_count() - 1,
                             rig.imu_noise.rate_hz);
        return fmt::format("<fbvins.Rig {} and {}, baseline {:.4f} m, IMU {:g} Hz>", text_of(rig.left()), text_of(rig.right()),
                           rig.T_C1C0().p.norm(), rig.imu_noise.rate_hz);
      });
}

}  // namespace

void bind_rig(nb::module_& m) {
  bind_camera(m);
  bind_imu_axes(m);
  bind_imu_noise(m);
  bind_depth_sensor(m);
  bind_stereo_rig(m);
  m.def("_restore_rig", [](const std::string& yaml) { return value_or_raise(parse_rig(yaml, "the rig")); });

  m.def(
      "load_calibration",
      [](const std::string& path, const std::string& imu) { return value_or_raise(load_calibration(path, imu)); }, "path"_a,
      "imu"_a = "");
  m.def(
      "load_camera_info",
      [](const std::string& left, const std::string& right, nb::handle T_BC0) {
        return value_or_raise(load_camera_info(left, right, transform<B, C0>(T_BC0, "T_BC0")));
      },
      "left"_a, "right"_a, "T_BC0"_a);
}

}  // namespace fbvins::python
