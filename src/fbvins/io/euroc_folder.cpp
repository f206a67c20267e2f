// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <utility>

#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/aiding_folders.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/imu_axes_fields.hpp"
#include "fbvins/io/imu_file.hpp"
#include "fbvins/io/mask_fields.hpp"
#include "fbvins/io/png_encode.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRowsHeader = "#timestamp [ns],filename\n";

Error cannot_write(const fs::path& path) {
  return Error{ErrorCode::unwritable, fmt::format("{}: cannot be written", path.string())};
}

Result<void> write_file(const fs::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return cannot_write(path);
  return {};
}

std::string matrix_text(const Quat& q, const Vec3& p) {
  const Mat3 R = q.toRotationMatrix();
  std::string text = "T_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int r = 0; r < 3; ++r) text += fmt::format("{}, {}, {}, {},\n         ", R(r, 0), R(r, 1), R(r, 2), p[r]);
  return text + "0.0, 0.0, 0.0, 1.0]\n";
}

std::string lens_text(const Camera& camera) {
  const KalibrCamera c = kalibr_camera(camera);
  return fmt::format(
      "resolution: [{}, {}]\ncamera_model: {}\nintrinsics: [{}]\ndistortion_model: {}\ndistortion_coefficients: [{}]\n",
      camera.width(), camera.height(), c.model, fmt::join(c.intrinsics, ", "),
      c.distortion == "radtan" ? "radial-tangential" : c.distortion, fmt::join(c.coefficients, ", "));
}

std::string camera_yaml(const StereoRig& rig, int number, const std::string& origin) {
  const auto& [camera, T_BC] = rig.mounted(number);
  const auto [time_offset_s, line_delay_s] = rig.times(number);
  const bool on_time = time_offset_s == 0 && rig.time_offset_s == 0;  // without the key it is camera 0's
  const std::string offset = on_time ? "" : fmt::format("timeshift_cam_imu: {}\n", time_offset_s);
  const std::string rolling = line_delay_s == 0 ? "" : fmt::format("line_delay_us: {}\n", 1e6 * line_delay_s);
  return fmt::format("sensor_type: camera\ncomment: {}\n\n", origin) + matrix_text(T_BC.q, T_BC.p) +
         fmt::format("\nrate_hz: {}\n", rig.image_rate_hz) + lens_text(camera) + offset + rolling + mask_text(camera);
}

std::string imu_yaml(const ImuNoise& n, const std::string& origin) {
  std::string range;
  const ImuNoise usual;
  if (n.max_gyro_radps != usual.max_gyro_radps || n.max_accel_mps2 != usual.max_accel_mps2)
    range = fmt::format("gyroscope_range: {}\naccelerometer_range: {}\n", n.max_gyro_radps, n.max_accel_mps2);
  return fmt::format("sensor_type: imu\ncomment: {}\n\n", origin) + matrix_text(Quat::Identity(), Vec3::Zero()) +
         fmt::format("rate_hz: {}\n\n", n.rate_hz) + imu_noise_text(n, "", "{}") + range + imu_axes_text(n.axes, "", true);
}

std::string truth_csv(const std::vector<TrajectoryPoint>& truth) {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
      "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  for (const TrajectoryPoint& s : truth) {
    const Vec3& p = s.T_WB.p;
    const Quat& q = s.T_WB.q;
    text += fmt::format("{},{:.7f},{:.7f},{:.7f},{:.9f},{:.9f},{:.9f},{:.9f}", s.t.ns, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(),
                        q.z());
    if (s.v_WB && s.bias) {  // a truth of poses alone is one of eight columns: zeros would say that it is at rest
      const Vec3 &v = *s.v_WB, &bg = s.bias->gyro_radps, &ba = s.bias->accel_mps2;
      text += fmt::format(",{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.6f},{:.6f},{:.6f}", v.x(), v.y(), v.z(), bg.x(), bg.y(),
                          bg.z(), ba.x(), ba.y(), ba.z());
    }
    text += "\n";
  }
  return text;
}

std::string depth_yaml(const DepthSensor& sensor, const std::string& origin) {
  const auto& own = sensor.own;
  return fmt::format("sensor_type: depth\ncomment: {}, {}in millimetres\n\n", origin,
                     own ? "" : "registered to cam0 pixel by pixel, ") +
         (own ? matrix_text(own->T_BC.q, own->T_BC.p) + lens_text(own->camera) : "") + depth_sensor_text(sensor, "");
}

std::string depth_png(const std::vector<float>& depth_m, int width, int height) {
  std::vector<std::uint16_t> mm;
  for (float z : depth_m) mm.push_back(static_cast<std::uint16_t>(std::clamp(z * 1000.0f + 0.5f, 0.0f, 65535.0f)));
  return encode_png16(mm, width, height);
}

/// Makes the folders and writes the calibrations.
Result<void> write_calibrations(const StereoRig& rig, const fs::path& mav0, const std::string& origin, bool depth) {
  std::vector<std::string> folders{"imu0", "state_groundtruth_estimate0"};
  for (int i = 0; i < rig.camera_count(); ++i) folders.push_back(fmt::format("cam{}/data", i));
  if (depth) folders.push_back("depth0");
  if (rig.depth) folders.push_back("depth0/data");
  for (const std::string& folder : folders) {
    std::error_code error;
    fs::create_directories(mav0 / folder, error);
    if (error) return cannot_write(mav0 / folder);
  }
  for (int i = 0; i < rig.camera_count(); ++i) {
    const fs::path path = mav0 / fmt::format("cam{}/sensor.yaml", i);
    if (Result<void> done = write_file(path, camera_yaml(rig, i, origin)); !done) return done;
  }
  if (rig.depth)
    if (Result<void> done = write_file(mav0 / "depth0/sensor.yaml", depth_yaml(*rig.depth, origin)); !done) return done;
  for (const auto& [path, text] :
       {std::pair{mav0 / "imu0/sensor.yaml", imu_yaml(rig.imu_noise, origin)},
        {mav0 / "state_groundtruth_estimate0/sensor.yaml",
         fmt::format("sensor_type: visual-inertial\ncomment: {}\n", origin) + matrix_text(Quat::Identity(), Vec3::Zero())},
        {mav0 / "body.yaml", fmt::format("comment: {}\n", origin)}})
    if (Result<void> done = write_file(path, text); !done) return done;
  return {};
}

struct Images {
  StereoFrame frame;
  Time right_stamp;
  std::vector<float> depth_left_m;
};

/// Writes a frame's images, of the cameras that delivered one; may run while the next frame is made.
Result<void> write_images(const Images& images, const fs::path& mav0) {
  const StereoFrame& frame = images.frame;
  const std::string left = fmt::format("{}.png", frame.t.ns);
  for (int i = 0; i < static_cast<int>(frame.images.size()); ++i) {
    const Time stamp = i == 1 ? images.right_stamp : frame.t + frame.offsets.of(i);
    const fs::path path = mav0 / fmt::format("cam{}/data/{}.png", i, stamp.ns);
    if (const auto& image = frame.image(i))
      if (Result<void> done = write_file(path, encode_png(*image)); !done) return done;
  }
  if (!images.depth_left_m.empty()) {
    const std::string depth = depth_png(images.depth_left_m, frame.left()->width(), frame.left()->height());
    if (Result<void> done = write_file(mav0 / "depth0" / left, depth); !done) return done;
  }
  if (const DepthImage* depth = frame.depth.get(); depth != nullptr) {
    const std::string png = encode_png16(depth->mm, depth->width, depth->height);
    if (Result<void> done = write_file(mav0 / "depth0/data" / left, png); !done) return done;
  }
  return {};
}

}  // namespace

struct EurocFolder::State {
  fs::path mav0;
  std::string origin;
  std::vector<std::string> rows;  ///< of each camera
  std::optional<std::string> depth_rows;
  std::future<Result<void>> writing;

  Result<void> wait() { return writing.valid() ? writing.get() : Result<void>{}; }
};

Result<EurocFolder> EurocFolder::create(const std::string& folder, const StereoRig& rig, const std::string& origin, bool depth) {
  const fs::path mav0 = fs::path(folder) / "mav0";
  if (fs::exists(mav0)) return Error{ErrorCode::unwritable, fmt::format("{} exists already", mav0.string())};
  if (Result<void> done = write_calibrations(rig, mav0, origin, depth); !done) return done.error();
  auto state = std::make_unique<State>();
  state->mav0 = mav0;
  state->origin = origin;
  state->rows.assign(static_cast<std::size_t>(rig.camera_count()), kRowsHeader);
  if (rig.depth) state->depth_rows = kRowsHeader;
  return EurocFolder(std::move(state));
}

EurocFolder::EurocFolder(std::unique_ptr<State> state) : state_(std::move(state)) {}
EurocFolder::~EurocFolder() = default;
EurocFolder::EurocFolder(EurocFolder&&) noexcept = default;
EurocFolder& EurocFolder::operator=(EurocFolder&&) noexcept = default;

Result<void> EurocFolder::add(StereoFrame frame, Time right_stamp, std::vector<float> depth_left_m) {
  for (std::size_t i = 0; i < state_->rows.size(); ++i) {
    const Time stamp = i == 1 ? right_stamp : frame.t + frame.offsets.of(static_cast<int>(i));
    if (frame.image(static_cast<int>(i))) state_->rows[i] += fmt::format("{0},{0}.png\n", stamp.ns);
  }
  if (!state_->depth_rows) frame.depth = nullptr;
  if (frame.depth) *state_->depth_rows += fmt::format("{0},{0}.png\n", frame.t.ns);
  if (Result<void> done = state_->wait(); !done) return done;
  state_->writing = std::async(std::launch::async, [images = Images{std::move(frame), right_stamp, std::move(depth_left_m)},
                                                    mav0 = state_->mav0] { return write_images(images, mav0); });
  return {};
}

Result<void> EurocFolder::add_aiding(const std::vector<AidingSample>& readings) {
  for (const AidingText& sensor : aiding_texts(readings, state_->origin)) {
    const fs::path folder = state_->mav0 / sensor.folder;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return cannot_write(folder);
    if (Result<void> done = write_file(folder / "sensor.yaml", sensor.sensor_yaml); !done) return done;
    if (Result<void> done = write_file(folder / "data.csv", sensor.csv); !done) return done;
  }
  return {};
}

Result<void> EurocFolder::finish(const std::vector<ImuSample>& readings, const std::vector<TrajectoryPoint>& truth) {
  if (Result<void> done = state_->wait(); !done) return done;
  const fs::path& mav0 = state_->mav0;
  for (const auto& [path, text] : {std::pair{mav0 / "imu0/data.csv", imu_to_csv(readings)},
                                   {mav0 / "state_groundtruth_estimate0/data.csv", truth_csv(truth)}})
    if (Result<void> done = write_file(path, text); !done) return done;
  for (std::size_t i = 0; i < state_->rows.size(); ++i)
    if (Result<void> done = write_file(mav0 / fmt::format("cam{}/data.csv", i), state_->rows[i]); !done) return done;
  return state_->depth_rows ? write_file(mav0 / "depth0/data.csv", *state_->depth_rows) : Result<void>{};
}

}  // namespace fbvins
