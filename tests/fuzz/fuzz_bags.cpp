// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <filesystem>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/foreign_files.hpp"
#include "fbvins/io/kalibr_imu.hpp"
#include "fbvins/io/mcap_format.hpp"
#include "fbvins/io/mcap_writer.hpp"
#include "fbvins/io/ros_messages.hpp"
#include "fbvins/io/yaml_reader.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/named_file.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/support/packed_bags.hpp"

namespace fbvins::fuzz {
namespace {

StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{9, 9, 4, 3}, 8, 6), {}});
  rig.cameras[1].T_BC.p.x() = 0.1;
  return rig;
}

/// A message in CDR. 1: an IMU reading; 2 and 3: an image; 4: a camera's calibration.
std::string small_message(int kind, Time t) {
  static const Image image(8, 6, std::uint8_t{7});
  std::string out;
  if (kind == 1) append_imu(out, ImuSample{t}, {});
  else if (kind == 4) append_camera_info(out, t, "left", Camera(DoubleSphere{9, 9, 4, 3, -0.2, 0.6}, 8, 6));
  else append_image(out, t, "left", &image);
  return out;
}

/// A camera_info whose images are rectified: R turns, P has another focal length and the baseline.
std::string rectified_message() {
  std::string out;
  append_camera_info(out, Time{1000}, "right", Camera(PinholeRadtan{9, 9, 4, 3, -0.1, 0.01, 0, 0}, 8, 6));
  const std::size_t P = out.size() - 25 - 12 * sizeof(double);  // before binning and region of interest
  overwrite_le(out, P, 8.0);
  overwrite_le(out, P + 3 * sizeof(double), -0.8);
  return out;
}

std::string small_mcap(const std::string& path) {
  auto bag = McapWriter::create(path, {},
                                {{"/imu", "sensor_msgs/msg/Imu", ""},
                                 {"/left", "sensor_msgs/msg/Image", ""},
                                 {"/right", "sensor_msgs/msg/Image", ""},
                                 {"/left/camera_info", "sensor_msgs/msg/CameraInfo", ""}});
  require(bag.ok());
  for (std::int64_t i = 0; i < 3; ++i) {
    for (const std::size_t topic : {0, 1, 2, 3}) {
      bag->begin_message(topic, Time{1000 * i}) += small_message(static_cast<int>(topic) + 1, Time{1000 * i});
      bag->end_message();
    }
    require(bag->flush().ok());
  }
  require(bag->finish().ok());
  std::string bytes = *read_file(path, 1u << 20u);
  // Without checksums: with them the reader would leave out every mutated chunk, and never parse what is in it.
  for (std::size_t at = kMcapMagic.size(); at + kMcapRecordHead_bytes < bytes.size();) {
    const auto kind = static_cast<McapRecord>(bytes[at]);
    const auto length = ByteCursor(std::string_view(bytes).substr(at + 1)).get<std::uint64_t>();
    if (kind == McapRecord::chunk) overwrite_le(bytes, at + kMcapRecordHead_bytes + 24, std::uint32_t{0});
    if (kind == McapRecord::footer) break;
    at += kMcapRecordHead_bytes + length;
  }
  return bytes;
}

void read_all(BagReader& bag) {
  const BagContents contents = read_contents(bag);
  for (const auto& [name, topic] : contents.images)
    for (const ImageRow& row : topic.rows) {
      const MessagePlace place = place_of(row.file);
      require(place_name(place) == row.file);
      require_sentence(image_of(bag.read(place), topic.encoding, topic.compressed));
    }
  const auto topics = choose_topics(contents, {}, {.depth = true});
  require_sentence(topics);
  if (topics) require_sentence(rig_of(contents, *topics));
}

}  // namespace

std::vector<std::string> bag_seeds() {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/flight.bag";
  auto bag = Ros1BagWriter::create(path, small_rig(), Time{0});
  const auto image = std::make_shared<const Image>(8, 6, std::uint8_t{7});
  for (std::int64_t i = 0; i < 3; ++i)
    require(bag->add(ImuSample{Time{1000 * i}}).ok() && bag->add(StereoFrame{Time{1000 * i}, {image, image}}).ok());
  require(bag->finish().ok());
  const std::string bag_bytes = *read_file(path, 1u << 20u), mcap = small_mcap(folder.path() + "/flight.mcap");
  return {bag_bytes,
          test::packed_ros1(bag_bytes, "lz4"),
          test::packed_ros1(bag_bytes, "bz2"),
          mcap,
          test::packed_mcap(mcap, "lz4"),
          test::packed_mcap(mcap, "zstd"),
          std::string(kMcapMagic)};
}

/// Reads a whole bag, then each message again by its position in the file, then a part of the bag by time.
void fuzz_bag(std::string_view bytes) {
  const bool mcap = bytes.substr(0, kMcapMagic.size()) == kMcapMagic;
  const auto open = [&] {
    auto source = bytes_in_memory(std::string(bytes));
    return mcap ? read_mcap_bag(std::move(source), "bag") : read_ros1_bag(std::move(source), "bag");
  };
  auto bag = open();
  require_sentence(bag);
  if (!bag) return;
  read_all(**bag);
  auto part = open();
  (*part)->only({1000}, {2000});
  read_contents(**part);
}

std::vector<std::string> sqlite_bag_seeds() {
  const test::TemporaryFolder folder;
  std::vector<std::string> out;
  for (
      const char* schema :
      {"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
       "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
       "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, "
       "offered_qos_profiles TEXT NOT NULL DEFAULT ''); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
       "timestamp INTEGER NOT NULL, data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);"}) {
    const std::string path = folder.path() + "/bag.db3";
    std::filesystem::remove(path);
    sqlite3* database = nullptr;
    require(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
    const auto run = [&](const std::string& sql) {
      require(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) == 0);
    };
    run("PRAGMA page_size = 512");
    run(schema);
    run("INSERT INTO topics(id, name, type, serialization_format) VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr'), "
        "(2, '/left', 'sensor_msgs/msg/Image', 'cdr'), (3, '/right', 'sensor_msgs/msg/Image', 'cdr')");
    for (std::int64_t i = 0; i < 3; ++i)
      for (const int topic : {1, 2, 3}) {
        std::string hex;
        for (const char c : small_message(topic, Time{1000 * i})) hex += fmt::format("{:02x}", static_cast<unsigned char>(c));
        run(fmt::format("INSERT INTO messages(topic_id, timestamp, data) VALUES ({}, {}, x'{}')", topic, 1000 * i, hex));
      }
    sqlite3_close(database);
    auto bag = open_sqlite_bag({path}, false);
    require(bag.ok() && read_contents(**bag).images.size() == 2);
    out.push_back(*read_file(path, 1u << 20u));
  }
  return out;
}

void fuzz_sqlite_bag(std::string_view bytes) {
  static const NamedFile file("db3");
  const std::string& path = file.with(bytes);
  for (const bool part : {false, true}) {
    auto bag = open_sqlite_bag({path}, part);
    require_sentence(bag);
    if (!bag) return;
    if (part) (*bag)->only({1000}, {2000});
    read_all(**bag);
  }
}

std::vector<std::string> message_seeds() {
  std::vector<std::string> out;
  for (const int kind : {1, 2, 3, 4}) out.push_back("c" + small_message(kind, Time{1000}));
  out.push_back("c" + rectified_message());
  for (const AidingSample& reading :
       {AidingSample(RangeSample{.t = Time{1000}, .distance_m = 2}), AidingSample(VelocitySample{.t = Time{1000}}),
        AidingSample(PressureSample{Time{1000}, 1e5})}) {
    out.push_back("c" + aiding_message(reading, "sensor", Encoding::cdr));
    out.push_back("1" + aiding_message(reading, "sensor", Encoding::ros1));
  }
  // In ROS 1's order a header begins with its number, and nothing is aligned.
  out.push_back("1" + std::string(400, '\0'));
  return out;
}

/// Parses the bytes as each type of message that a recording has; the first byte selects the encoding of ROS 1 or of ROS 2.
void fuzz_message(std::string_view bytes) {
  if (bytes.empty()) return;
  const Encoding encoding = bytes[0] == '1' ? Encoding::ros1 : Encoding::cdr;
  bytes.remove_prefix(1);
  if (const auto sample = imu_of(bytes, encoding)) require(sample->gyro_radps.allFinite() && sample->accel_mps2.allFinite());
  for (const AidingSample& kind : {AidingSample(RangeSample{}), AidingSample(VelocitySample{}), AidingSample(PressureSample{})})
    if (const auto read = aiding_of(bytes, encoding, aiding_type(kind))) require(impossible(read->reading).empty());
  stamp_of(bytes, encoding);
  for (const bool compressed : {false, true}) require_sentence(image_of(bytes, encoding, compressed));
  const auto camera = camera_of(bytes, encoding);
  require_sentence(camera);
  if (camera) require(camera->camera.width() > 0 && camera->camera.focal_px() > 0);
  if (camera && camera->rectified) {
    const BagCamera::Rectified& r = *camera->rectified;
    require(r.camera.width() > 0 && r.camera.focal_px() > 0 && std::isfinite(r.x_m));
    require((r.R_rectified_raw * r.R_rectified_raw.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 2e-3);
  }
  for (const BagTransform& transform : transforms_of(bytes, encoding)) require(std::abs(transform.q.norm() - 1) < 1e-9);
  if (const auto transform = transform_of(bytes, encoding)) require(std::abs(transform->q.norm() - 1) < 1e-9);
  for (const char* type : {"geometry_msgs/PoseStamped", "geometry_msgs/TransformStamped", "nav_msgs/Odometry"})
    if (const auto point = pose_of(bytes, encoding, type)) require(point->T_WB.p.allFinite());
}

std::vector<std::string> foreign_calibration_seeds() {
  return {
      "cam0:\n  T_imu_cam: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n"
      "  distortion_model: radtan\n  intrinsics: [4, 4, 3, 2]\n  resolution: [8, 6]\ncam1:\n  T_imu_cam: 5\n",
      R"({"value0": {"T_imu_cam": [{"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}, {"px": 0.1, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}], "intrinsics": [{"camera_type": "kb4", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2, "k1": 0, "k2": 0, "k3": 0, "k4": 0}}, {"camera_type": "pinhole", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2}}], "resolution": [[8, 6], [8, 6]], "imu_update_rate": 200, "accel_noise_std": [1, 1, 1], "gyro_noise_std": [1, 1, 1], "accel_bias_std": [1, 1, 1], "gyro_bias_std": [1, 1, 1]}})",
      R"({"value0": {"T_imu_cam": [{"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}, {"px": 0.1, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}], "intrinsics": [{"camera_type": "ds", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2, "xi": -0.2, "alpha": 0.6}}, {"camera_type": "eucm", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2, "alpha": 0.6, "beta": 1.1}}], "resolution": [[8, 6], [8, 6]], "imu_update_rate": 200, "accel_noise_std": [1, 1, 1], "gyro_noise_std": [1, 1, 1], "accel_bias_std": [1, 1, 1], "gyro_bias_std": [1, 1, 1]}})",
      R"({"value0": {"T_imu_cam": [{"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}], "intrinsics": [{"camera_type": "ds", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2, "xi": -0.2, "alpha": 0.6}}], "resolution": [[8, 6]], "calib_accel_bias": [0.1, 0, 0, 0.01, 0, 0, 0.02, 0, 0.01], "calib_gyro_bias": [0.01, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01], "imu_update_rate": 200, "accel_noise_std": [1, 1, 1], "gyro_noise_std": [1, 1, 1], "accel_bias_std": [1, 1, 1], "gyro_bias_std": [1, 1, 1]}})",
      R"({"imus": [{"accelerometer": {"scale_and_alignment": [1.01, 0, 0, 0, 1.02, 0, 0, 0, 0.99], "bias": [0.1, 0, 0]}, "gyroscope": {"scale_and_alignment": [1, 0, 0, 0, 1, 0, 0, 0, 1], "bias": [0.01, 0, 0]}}]})",
      "%YAML:1.0\n---\nmodel_type: PINHOLE\nimage_width: 8\nimage_height: 6\ndistortion_parameters:\n   k1: 0\n   k2: 0\n   p1: 0\n   p2: 0\n"
      "projection_parameters:\n   fx: 4\n   fy: 4\n   cx: 3\n   cy: 2\n",
      "image_width: 8\nimage_height: 6\ncamera_matrix:\n  data: [4, 0, 3, 0, 4, 2, 0, 0, 1]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  data: [0, 0, 0, 0, 0]\nrectification_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  data: [4, 0, 3, -0.4, 0, 4, 2, 0, 0, 0, 1, 0]\n",
      "%YAML:1.0\nimu_topic: /imu\nmodel_type: PINHOLE\nimage_width: 8\nimage_height: 6\ndistortion_parameters: {k1: 0, k2: 0, p1: 0, p2: 0}\n"
      "projection_parameters: {fx: 4, fy: 4, cx: 3, cy: 2}\nextrinsicRotation: {data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
      "extrinsicTranslation: {data: [0, 0, 0]}\nacc_n: 1\ngyr_n: 1\nacc_w: 1\ngyr_w: 1\nrolling_shutter: 1\nrolling_shutter_tr: 0.02\n",
      "%YAML:1.0\nCamera.type: PinHole\nCamera1.fx: 4\nCamera1.fy: 4\nCamera1.cx: 3\nCamera1.cy: 2\nCamera1.k1: 0\nCamera1.k2: 0\n"
      "Camera.width: 8\nCamera.height: 6\nStereo.b: 0.1\nIMU.T_b_c1:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
      "IMU.NoiseGyro: 1\nIMU.NoiseAcc: 1\nIMU.GyroWalk: 1\nIMU.AccWalk: 1\nIMU.Frequency: 200\n",
      R"({"cameraData": [[1, {"cameraType": 0, "width": 8, "height": 6, "intrinsicMatrix": [[4, 0, 3], [0, 4, 2], [0, 0, 1]], "distortionCoeff": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], "extrinsics": {"toCameraSocket": -1}}]], "imuExtrinsics": {"rotationMatrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": {"x": 1, "y": 0, "z": 0}, "toCameraSocket": 1}})",
      "camera_id: left\nT_BS: {data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\nrate_hz: 20\nresolution: [8, 6]\n"
      "camera_model: pinhole\nintrinsics: [4, 4, 3, 2]\ndistortion_model: radtan\ndistortion_coefficients: [0, 0, 0, 0]\n",
      "imu0:\n  T_i_b: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n  time_offset: 0\n  accelerometer_noise_density: 1\n"
      "  accelerometer_random_walk: 1\n  gyroscope_noise_density: 1\n  gyroscope_random_walk: 1\n  update_rate: 200\n",
      R"({"device_type": "D435i", "imus": [{"accelerometer": {"bias": [0.3, 0.2, 0.1], "scale_and_alignment": [1.1, 0.1, 0, 0, 1, 0, 0, 0, 1]}, "gyroscope": {"bias": [0.01, 0, -0.02], "scale_and_alignment": [1, 0, 0, 0, 1, 0, 0, 0, 1]}}]})",
      "image_width: 8\nimage_height: 6\ncamera_name: left\ncamera_matrix: {rows: 3, cols: 3, data: [4, 0, 3, 0, 4, 2, 0, 0, 1]}\n"
      "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}\n"
      "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
      "projection_matrix: {rows: 3, cols: 4, data: [3.9, 0, 3, -0.4, 0, 3.9, 2, 0, 0, 0, 1, 0]}\n",
      "Gyr: {avg-axis: {gyr_n: 1, gyr_w: 1}}\nAcc: {avg-axis: {acc_n: 1, acc_w: 1}}\n"};
}

void fuzz_foreign_calibration(std::string_view bytes) {
  static const YamlReader vins(
      "vins.yaml",
      "body_T_cam0:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nbody_T_cam1:\n"
      "  data: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nacc_n: 1\ngyr_n: 1\nacc_w: 1\ngyr_w: 1\n");
  const YamlReader yaml("c.yaml", std::string(bytes));
  require_sentence(parse_openvins_cameras(yaml));
  require_sentence(parse_basalt(yaml));
  require_sentence(parse_vins_fusion(vins, {yaml, yaml}));
  require_sentence(parse_vins_fusion(yaml, {yaml}));
  require_sentence(parse_camera_info(yaml, yaml, {}));
  require(!camera_info_alone(yaml).message.empty());
  require_sentence(parse_camera_info_file(yaml));
  require_sentence(parse_vins_mono(yaml));
  require_sentence(parse_orbslam(yaml));
  require_sentence(parse_kimera({yaml}, yaml));
  require_sentence(parse_oak(yaml));
  foreign_file(std::string(bytes));
  static const StereoRig rig = with_cameras({}, {{Camera(PinholeRadtan{4, 4, 3, 2}, 8, 6), {}}});
  for (const char* which : {"", "imu1"}) require_sentence(with_imu_text(rig, "imu.yaml", std::string(bytes), which));
}

}  // namespace fbvins::fuzz
