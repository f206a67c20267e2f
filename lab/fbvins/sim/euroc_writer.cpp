// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/euroc_writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <future>

#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/output_file.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

std::string encode(const std::vector<const std::uint8_t*>& rows, int width, int depth) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, png_size_t size) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(data), size);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(rows.size()), depth, PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 1);
  png_set_filter(png, 0, PNG_FILTER_SUB);
  // Huffman coding alone: noisy images have no repetitions to search for, and it is far faster.
  png_set_compression_strategy(png, 2);
  png_write_info(png, info);
  for (const std::uint8_t* row : rows) png_write_row(png, row);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

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

std::string camera_yaml(const Camera& camera, const Quat& q, const Vec3& p, double rate_hz) {
  const KalibrCamera c = kalibr_camera(camera);
  return "# Rendered by fbvins simulate.\nsensor_type: camera\ncomment: simulated camera\n\n" + matrix_text(q, p) +
         fmt::format(
             "\nrate_hz: {}\nresolution: [{}, {}]\ncamera_model: {}\nintrinsics: [{}]\ndistortion_model: {}\n"
             "distortion_coefficients: [{}]\n",
             rate_hz, camera.width(), camera.height(), c.model, fmt::join(c.intrinsics, ", "),
             c.distortion == "radtan" ? "radial-tangential" : c.distortion, fmt::join(c.coefficients, ", "));
}

std::string imu_yaml(const ImuNoise& n) {
  return "# Simulated by fbvins simulate.\nsensor_type: imu\ncomment: simulated IMU\n\n" +
         matrix_text(Quat::Identity(), Vec3::Zero()) +
         fmt::format(
             "rate_hz: {}\n\ngyroscope_noise_density: {}\ngyroscope_random_walk: {}\naccelerometer_noise_density: {}\naccelerometer_random_walk: {}\n",
             n.rate_hz, n.gyro_noise_density_radps_rthz, n.gyro_random_walk_radps2_rthz, n.accel_noise_density_mps2_rthz,
             n.accel_random_walk_mps3_rthz);
}

std::string imu_csv(const std::vector<ImuSample>& samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& s : samples)
    text += fmt::format("{},{},{},{},{},{},{}\n", s.t.ns, s.gyro_radps.x(), s.gyro_radps.y(), s.gyro_radps.z(), s.accel_mps2.x(),
                        s.accel_mps2.y(), s.accel_mps2.z());
  return text;
}

std::string truth_csv(const std::vector<TrueState>& truth) {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
      "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  for (const TrueState& s : truth) {
    const auto &p = s.T_WB.p, &v = s.v_WB, &bg = s.bias.gyro_radps, &ba = s.bias.accel_mps2;
    const Quat& q = s.T_WB.q;
    text += fmt::format(
        "{},{:.7f},{:.7f},{:.7f},{:.9f},{:.9f},{:.9f},{:.9f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.6f},{:.6f},{:.6f}\n",
        s.t.ns, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z(), bg.x(), bg.y(), bg.z(), ba.x(), ba.y(),
        ba.z());
  }
  return text;
}

std::string landmarks_csv(const Simulation& s) {
  std::string text = "#p_x [m], p_y [m], p_z [m]\n";
  for (const Facet& f : s.world->facets)
    for (const Vec3& corner : {f.corner, Vec3(f.corner + f.u), Vec3(f.corner + f.u + f.v), Vec3(f.corner + f.v)}) {
      const Vec3 p = corner - s.world_from_flight;
      text += fmt::format("{:.5f},{:.5f},{:.5f}\n", p.x(), p.y(), p.z());
    }
  return text;
}

std::string depth_png(const std::vector<float>& depth_m, int width, int height) {
  std::vector<std::uint16_t> mm;
  for (float z : depth_m) mm.push_back(static_cast<std::uint16_t>(std::clamp(z * 1000.0f + 0.5f, 0.0f, 65535.0f)));
  return encode_png16(mm, width, height);
}

/// Makes the folders and writes the calibrations.
Result<void> write_calibrations(const StereoRig& rig, const fs::path& mav0, bool depth) {
  std::vector<const char*> folders{"cam0/data", "cam1/data", "imu0", "state_groundtruth_estimate0"};
  if (depth) folders.push_back("depth0");
  for (const char* folder : folders) {
    std::error_code error;
    fs::create_directories(mav0 / folder, error);
    if (error) return cannot_write(mav0 / folder);
  }
  const Pose<B, C0>& left = rig.T_BC0;
  const Pose<B, C1>& right = rig.T_BC1;
  for (const auto& [path, text] :
       {std::pair{mav0 / "cam0/sensor.yaml", camera_yaml(rig.left, left.q, left.p, rig.image_rate_hz)},
        {mav0 / "cam1/sensor.yaml", camera_yaml(rig.right, right.q, right.p, rig.image_rate_hz)},
        {mav0 / "imu0/sensor.yaml", imu_yaml(rig.imu_noise)},
        {mav0 / "state_groundtruth_estimate0/sensor.yaml",
         "sensor_type: visual-inertial\ncomment: the simulation's exact state\n" + matrix_text(Quat::Identity(), Vec3::Zero())},
        {mav0 / "body.yaml", std::string("comment: simulated by fbvins simulate\n")}})
    if (Result<void> done = write_file(path, text); !done) return done;
  return {};
}

/// Writes a frame's images, of the cameras that delivered one; may run while the next frame is rendered.
Result<void> write_images(const RenderedFrame& rendered, const fs::path& mav0) {
  const std::string left = fmt::format("{}.png", rendered.frame.t.ns), right = fmt::format("{}.png", rendered.right_stamp.ns);
  if (rendered.frame.left)
    if (Result<void> done = write_file(mav0 / "cam0/data" / left, encode_png(*rendered.frame.left)); !done) return done;
  if (!rendered.depth_left_m.empty())
    if (Result<void> done = write_file(mav0 / "depth0" / left, depth_png(rendered.depth_left_m, rendered.frame.left->width(),
                                                                         rendered.frame.left->height()));
        !done)
      return done;
  return rendered.frame.right ? write_file(mav0 / "cam1/data" / right, encode_png(*rendered.frame.right)) : Result<void>{};
}

}  // namespace

std::string encode_png(const Image& image) {
  std::vector<const std::uint8_t*> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(image.row(y));
  return encode(rows, image.width(), 8);
}

std::string encode_png16(const std::vector<std::uint16_t>& values, int width, int height) {
  std::vector<std::uint8_t> bytes;  // PNG has the high byte first
  for (std::uint16_t v : values)
    bytes.insert(bytes.end(), {static_cast<std::uint8_t>(v >> 8), static_cast<std::uint8_t>(v & 255)});
  std::vector<const std::uint8_t*> rows;
  for (int y = 0; y < height; ++y) rows.push_back(bytes.data() + static_cast<std::ptrdiff_t>(y) * width * 2);
  return encode(rows, width, 16);
}

struct EurocFolder::State {
  fs::path mav0;
  std::string left_rows = "#timestamp [ns],filename\n", right_rows = left_rows;
  std::future<Result<void>> writing;

  Result<void> wait() { return writing.valid() ? writing.get() : Result<void>{}; }
};

Result<EurocFolder> EurocFolder::create(const std::string& folder, const StereoRig& rig, bool depth) {
  const fs::path mav0 = fs::path(folder) / "mav0";
  if (fs::exists(mav0)) return Error{ErrorCode::unwritable, fmt::format("{} exists already", mav0.string())};
  if (Result<void> done = write_calibrations(rig, mav0, depth); !done) return done.error();
  auto state = std::make_unique<State>();
  state->mav0 = mav0;
  return EurocFolder(std::move(state));
}

EurocFolder::EurocFolder(std::unique_ptr<State> state) : state_(std::move(state)) {}
EurocFolder::~EurocFolder() = default;
EurocFolder::EurocFolder(EurocFolder&&) noexcept = default;
EurocFolder& EurocFolder::operator=(EurocFolder&&) noexcept = default;

Result<void> EurocFolder::add(RenderedFrame rendered) {
  if (rendered.frame.left) state_->left_rows += fmt::format("{0},{0}.png\n", rendered.frame.t.ns);
  if (rendered.frame.right) state_->right_rows += fmt::format("{0},{0}.png\n", rendered.right_stamp.ns);
  if (Result<void> done = state_->wait(); !done) return done;
  state_->writing = std::async(std::launch::async,
                               [rendered = std::move(rendered), mav0 = state_->mav0] { return write_images(rendered, mav0); });
  return {};
}

Result<void> EurocFolder::finish(const SimulatedImu& imu) {
  if (Result<void> done = state_->wait(); !done) return done;
  const fs::path& mav0 = state_->mav0;
  for (const auto& [path, text] : {std::pair{mav0 / "imu0/data.csv", imu_csv(imu.samples)},
                                   {mav0 / "state_groundtruth_estimate0/data.csv", truth_csv(imu.truth)},
                                   {mav0 / "cam0/data.csv", state_->left_rows},
                                   {mav0 / "cam1/data.csv", state_->right_rows}})
    if (Result<void> done = write_file(path, text); !done) return done;
  return {};
}

Result<void> write_euroc(Simulation& simulation, const std::string& folder, const EurocWriterOptions& options,
                         const std::function<void(int done, int all)>& progress) {
  Result<EurocFolder> recording = EurocFolder::create(folder, simulation.rig, options.depth);
  if (!recording) return recording.error();
  if (options.landmarks)
    if (Result<void> done = write_file(fs::path(folder) / "mav0/landmarks.csv", landmarks_csv(simulation)); !done) return done;
  int count = static_cast<int>(simulation.frames.size());
  if (options.max_frames > 0) count = std::min(count, options.max_frames);
  for (int i = 0; i < count; ++i) {
    if (Result<void> done = recording->add(render_frame(simulation, static_cast<std::size_t>(i), options.depth)); !done)
      return done;
    if (progress) progress(i + 1, count);
  }
  return recording->finish(simulation.imu);
}

}  // namespace fbvins
