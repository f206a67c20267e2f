// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz_targets.hpp"

#include "fbvins/features/booster_weights.hpp"
#include "fbvins/features/safetensors.hpp"
#include "fbvins/io/aiding_folders.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/kitti_poses.hpp"
#include "fbvins/io/known_file.hpp"
#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/io/mcap_format.hpp"
#include "fbvins/io/png_encode.hpp"
#include "fbvins/io/rig_text.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/io/yaml_reader.hpp"
#include "fbvins/mocap/motion_capture.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"
#include "tests/fuzz/named_file.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/support/marker_test_files.hpp"

namespace fbvins::fuzz {
namespace {

template <class Row>
void require_increasing(const std::vector<Row>& rows) {
  for (std::size_t i = 1; i < rows.size(); ++i) require(rows[i - 1].t < rows[i].t);
}

template <class P>
void require_rigid(const P& pose) {
  require(pose.p.allFinite() && std::abs(pose.q.norm() - 1.0) < 1e-9);
}

std::vector<std::string> csv_seeds() {
  const test::Files files = test::toy_dataset();
  return {files.at("imu0/data.csv").substr(0, 1500), files.at("cam0/data.csv")};
}

std::vector<std::string> calibration_seeds() {
  const test::Files files = test::toy_dataset();
  const std::string camera =
      "  T_cam_imu:\n  - [1, 0, 0, 0.5]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n  camera_model: pinhole\n"
      "  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: equidistant\n  intrinsics: [41, 42, 31, 23]\n  resolution: [64, 48]\n";
  return {
      files.at("cam1/sensor.yaml"), files.at("imu0/sensor.yaml"),
      files.at("cam0/sensor.yaml") + "mask: m.png\nmask_rectangles: [[0, 0, 9, 9], [60, 40, 9, 9]]\nmask_circles: [[30, 9, 5]]\n",
      "cam0:\n" + camera + "cam1:\n  T_cn_cnm1: &a [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n" + camera.substr(80)};
}

std::vector<std::string> aiding_seeds() {
  return {
      "T_BS:\n  cols: 4\n  rows: 4\n  data: [0, 0, 1, 0.02, 0, 1, 0, 0, -1, 0, 0, -0.03, 0, 0, 0, 1]\nnoise_m: 0.02\nnearest_m: 0.1\n"
      "farthest_m: 40\nnoise_mps: [0.1, 0.1, 100]\nnoise_pa: 2\n",
      "#timestamp [ns],distance [m]\n1000,1.5\n2000,inf\n3000,1.4\n", "1000,1,2,3\n2000,1,2,3,0.1,0.1,100\n",
      "1000,100000\n2000,100001\n"};
}

std::vector<std::string> trajectory_seeds() {
  return {
      test::toy_dataset().at("state_groundtruth_estimate0/data.csv"),
      "# t x y z qx qy qz qw\n1.403636584763555584e+09 1 2 3 0 0 0 1\n1403636584.8 1.5 2 3 0.6 0 0 -0.8\n1403636585 1 1 1 0 0 0 1\n",
      "# timestamp(s) q p v bg ba cam_imu_dt\n1403636624.5 0.6 0 0 0.8 1 2 3 0 0 0 0 0 0 0 0 0 0\n1403636624.6 0.6 0 0 0.8 1 2 4 0 0 0 0 0 0 "
      "0 0 0 0\n",
      "#t x y z roll pitch yaw\n1.5 1 2 3 0 0 90\n2.5 1 2 3 0 0 -90\n",
      "1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 5 0 1 0 6 0 0 1 8\n",
      "1403636584763555584,1,2,3,1,0,0,0,0.1,0.2,0.3,\n1403636584813555584,1,2,3,1,0,0,0,0.1,0.2,0.3,\n",
      "1403636584763555584.000000 1 2 3 0 0 0 1\n1403636584813555584.000000 1 2 3 0 0 0 1\n",
      "7;1403636584763555;1;2;3;1;0;0;0\n8;1403636584813555;1;2;3;1;0;0;0\n",
      "4294.9,1,2,3,1,0,0,0\n4294.95,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n0.2,1,2,3,1,0,0,0\n"};
}

/// A row of each kind of file that other systems write.
std::vector<std::string> known_file_seeds() {
  return {trajectory_seeds()[1],
          "%YAML:1.0\nimu_topic: /imu0\noutput_path: /tmp\nmax_cnt: 150\nmin_dist: 30\n",
          "1 0 0 0 0 1 0 0 0 0 1 0\n",
          "{\"cameraData\": [], \"imuExtrinsics\": {}}",
          "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
          std::string("PK\3\4\0\0", 6),
          "#ROSBAG V2.0\n",
          "\x89PNG\r\n",
          std::string("\x1f\x8b\0\0", 4),
          "SQLite format 3"};
}

std::vector<std::string> kitti_seeds() {
  return {"1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 5 0 1 0 6 0 0 1 8\n1 0 0 5 0 1 0 6 0 0 1 9\n", "0.1\n0.2\n0.3\n"};
}

std::vector<std::string> image_seeds() {
  return {test::make_png(1, {.width = 16, .height = 12}),
          test::make_png(2, {.width = 9, .height = 7, .colour = true, .sixteen_bit = true}), test::make_jpeg(3)};
}

std::vector<std::string> weights_seeds() {
  const std::string header =
      R"({"__metadata__":{"format":"fbvins-booster-1","bits":"256","width":"16","descriptor_hidden":"16","layers":"0","keypoint_hidden":"16,32",)"
      R"("residual":"1"},"identity":{"dtype":"F16","shape":[256],"data_offsets":[0,512]},"head.bias":{"dtype":"F32","shape":[2,3],"data_offsets":[512,536]}})";
  std::string bytes(8, '\0');
  bytes[0] = static_cast<char>(header.size() % 256), bytes[1] = static_cast<char>(header.size() / 256);
  return {bytes + header + std::string(536, '\1')};
}

/// With checksums the reader would leave out every mutated chunk, and never parse what is in it.
std::string without_checksums(std::string record) {
  for (std::size_t at = kMcapMagic.size(); at + kMcapRecordHead_bytes < record.size();) {
    const auto kind = static_cast<McapRecord>(record[at]);
    const auto length = ByteCursor(std::string_view(record).substr(at + 1)).get<std::uint64_t>();
    const std::size_t content = at + kMcapRecordHead_bytes;
    if (kind == McapRecord::chunk) overwrite_le(record, content + 24, std::uint32_t{0});
    if (kind == McapRecord::attachment) overwrite_le(record, content + length - 4, std::uint32_t{0});
    if (kind == McapRecord::footer) break;
    at = content + length;
  }
  return record;
}

/// A record of three small frames without message definitions (they make up most of a short record), and a complete record.
std::vector<std::string> mcap_seeds() {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/flight.mcap", bare_path = folder.path() + "/bare.mcap";
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{9, 9, 4, 3}, 8, 6), {}});
  rig.cameras[1].T_BC.p.x() = 0.1;
  auto record = FlightRecord::create(path, rig);
  auto bare = McapWriter::create(
      bare_path, {}, {{std::string(kImuTopic), "", ""}, {std::string(kLeftTopic), "", ""}, {std::string(kRightTopic), "", ""}});
  require(record.ok() && bare.ok() && bare->attach(std::string(kCalibrationAttachment), "", rig_to_yaml(rig)).ok());
  const auto image = std::make_shared<const Image>(8, 6, std::uint8_t{7});
  for (std::int64_t i = 0; i < 3; ++i) {
    const ImuSample sample{Time{1000 * i}};
    require(record->add(sample).ok() && record->add(StereoFrame{sample.t, {image, image}}).ok());
    append_imu(bare->begin_message(0, sample.t), sample, rig.imu_noise);
    bare->end_message();
    for (const std::size_t camera : {1, 2}) {
      append_image(bare->begin_message(camera, sample.t), sample.t, "x", image.get());
      bare->end_message();
    }
    if (i == 1) require(record->flush().ok() && bare->flush().ok());
  }
  require(record->finish().ok() && bare->finish().ok());
  return {*read_file(path, 1u << 20u), without_checksums(*read_file(bare_path, 1u << 20u))};
}

/// Tables of two bodies, one of which is seen only part of the time, and a topic of poses.
std::vector<std::string> motion_capture_seeds() {
  test::WrittenFile file;
  file.bodies = {{"quad", {}}, {"wand", {}}};
  for (int i = 0; i < 4; ++i)
    for (test::WrittenBody& body : file.bodies)
      body.poses.emplace_back(Pose<V, K>(so3_exp(Vec3(0.1 * i, 1, 2)), Vec3(1, 0.1 * i, -2)));
  file.bodies[1].poses[2].reset();
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/poses.mcap";
  auto poses = McapWriter::create(path, {}, {{"/quad", "nav_msgs/msg/Odometry", ""}});
  require(poses.ok());
  for (std::int64_t i = 0; i < 3; ++i) {
    RosOdometry odometry;
    odometry.t = Time{1000 * i};
    append_odometry(poses->begin_message(0, odometry.t), odometry);
    poses->end_message();
  }
  require(poses->finish().ok());
  return {test::motive_csv(file), test::vicon_csv(file, true), test::vicon_csv(file, false), test::qualisys_tsv(file),
          without_checksums(*read_file(path, 1u << 20u))};
}

}  // namespace

void fuzz_csv(std::string_view bytes) {
  const auto images = read_image_rows(bytes, "data.csv");
  require_sentence(images);
  if (images) require_increasing(images->rows);
  const auto imu = read_stamped_rows<ImuSample>(bytes, "data.csv", ImuRowParser{});
  require_sentence(imu);
  if (!imu) return;
  require_increasing(imu->rows);
  require(imu->counts.rows == imu->counts.bad() + static_cast<int>(imu->rows.size()));
  for (const ImuSample& sample : imu->rows) require(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite());
}

void fuzz_calibration(std::string_view bytes) {
  const YamlReader yaml("c.yaml", std::string(bytes));
  // The picture of a mask: a good one, or these bytes, which are none.
  Image seen(64, 48, 255);
  hide(seen, MaskCircle{20, 30, 9});
  const ReadBeside beside = [&](const std::string& name) -> Result<std::string> {
    return name == "m.png" ? encode_png(seen) : std::string(bytes);
  };
  const auto camera = parse_euroc_camera(yaml, beside);
  require_sentence(camera);
  if (camera) {
    require_rigid(camera->T_BS);
    require(camera->camera.focal_px() > 0 && camera->camera.width() > 0);
    if (const Mask* mask = camera->camera.mask().get())
      require(mask->width() == camera->camera.width() && mask->height() == camera->camera.height() && mask->hidden_share() < 1);
    // For any coefficients there must be a result, and a consistent one.
    if (const auto ray = camera->camera.undistort({camera->camera.width() / 3.0, 5.0}))
      require((camera->camera.distort(*ray) - Vec2(camera->camera.width() / 3.0, 5.0)).norm() < 1.0);
  }
  const auto imu = parse_euroc_imu(yaml);
  require_sentence(imu);
  if (imu) require(imu->noise.gyro_noise_density_radps_rthz > 0);
  const auto rig = parse_kalibr_camchain(yaml);
  require_sentence(rig);
  if (rig) require_rigid(rig->T_BC0());
  if (rig) require_rigid(rig->T_BC1());
  require_sentence(parse_imu(yaml));
}

/// The bytes as each kind's sensor.yaml and as its data.csv, each beside a good other file.
void fuzz_aiding(std::string_view bytes) {
  const std::string text(bytes), yaml = aiding_seeds()[0];
  for (const AidingFolder& folder : aiding_folders())
    for (const auto& [sensor, csv] :
         {std::pair{text, std::string("1,100000\n")}, {text, std::string("1,2,3,4\n")}, {yaml, text}}) {
      std::vector<std::string> warnings;
      const auto readings = folder.parse({YamlReader("sensor.yaml", sensor), csv, "data.csv", {}}, warnings);
      require_sentence(readings);
      if (!readings) continue;
      for (const AidingSample& reading : *readings) require(impossible(reading).empty());
      for (std::size_t i = 1; i < readings->size(); ++i) require(stamp_of((*readings)[i - 1]) < stamp_of((*readings)[i]));
    }
}

void fuzz_trajectory(std::string_view bytes) {
  const auto file = parse_trajectory(bytes, "t.txt");
  require_sentence(file);
  if (!file) return;
  require_increasing(file->points);
  for (const TrajectoryPoint& point : file->points) require_rigid(point.T_WB);
}

void fuzz_known_file(std::string_view bytes) {
  static const NamedFile file("known");
  if (const auto known = known_file(file.with(bytes)))
    require(!known->what.empty() && known->what.find('\n') == std::string::npos);
}

/// As poses with good times beside them, and as the times of good poses.
void fuzz_kitti(std::string_view bytes) {
  static const NamedFile times("kitti_times.txt");
  const std::string name = times.with(kitti_seeds()[1]), path = name.substr(0, name.size() - 10) + ".txt",
                    poses = kitti_seeds()[0];
  (void)looks_like_kitti(bytes);
  const auto as_poses = kitti_with_times(bytes, path);
  require(as_poses.ok() || bytes != poses);
  times.with(bytes);
  for (const auto& done : {as_poses, kitti_with_times(poses, path)}) {
    require_sentence(done);
    if (done) require_sentence(parse_trajectory(done->tum, path));
  }
}

void fuzz_image(std::string_view bytes) {
  const auto image = decode_image(bytes);
  require_sentence(image);
  if (image) require(image->width() > 0 && image->height() > 0);
}

void fuzz_weights(std::string_view bytes) {
  const auto file = parse_safetensors(bytes);
  require_sentence(file);
  require_sentence(parse_booster_weights(bytes));
  if (!file) return;
  for (const auto& [name, tensor] : file->tensors) {
    std::size_t count = 1;
    for (const int side : tensor.shape) count *= static_cast<std::size_t>(side);
    require(count == tensor.values.size());
  }
}

void fuzz_mcap(std::string_view bytes) {
  auto contents = read_mcap(bytes_in_memory(std::string(bytes)), "flight.mcap", {.prefetch_frames = 0});
  require_sentence(contents);
  if (!contents) return;
  require_rigid(contents->rig.T_BC1());
  for (const ImuSample& sample : contents->imu) require(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite());
  const int width = contents->rig.left().width(), height = contents->rig.left().height();
  Dataset data(*std::move(contents), {.prefetch_frames = 0});
  while (const auto event = data.next())
    if (const auto* frame = std::get_if<StereoFrame>(&*event); frame != nullptr && frame->left())
      require(frame->left()->width() == width && frame->left()->height() == height);
}

void fuzz_motion_capture(std::string_view bytes) {
  const bool mcap = bytes.substr(0, kMcapMagic.size()) == kMcapMagic;
  const auto file = mcap ? read_marker_topics(bytes_in_memory(std::string(bytes)), "take") : parse_motion_capture(bytes, "take");
  require_sentence(file);
  if (!file) return;
  require(!file->bodies.empty());
  for (const MarkerBody& body : file->bodies)
    for (std::size_t i = 0; i < body.track.size(); ++i) {
      require(i == 0 || body.track[i - 1].t < body.track[i].t);
      require_rigid(body.track[i].T_VK);
    }
  require_sentence(choose_body(*file, "", "take"));
}

const std::vector<Target>& targets() {
  static const std::vector<Target> all = {
      {"csv", fuzz_csv, csv_seeds},
      {"calibration", fuzz_calibration, calibration_seeds},
      {"trajectory", fuzz_trajectory, trajectory_seeds},
      {"aiding", fuzz_aiding, aiding_seeds},
      {"image", fuzz_image, image_seeds},
      {"weights", fuzz_weights, weights_seeds},
      {"mcap", fuzz_mcap, mcap_seeds},
      {"motion_capture", fuzz_motion_capture, motion_capture_seeds},
      {"cdr", fuzz_cdr, cdr_seeds},
      {"tags", fuzz_tags, tag_seeds},
      {"board_files", fuzz_board_files, board_file_seeds},
      {"known_file", fuzz_known_file, known_file_seeds},
      {"kitti", fuzz_kitti, kitti_seeds},
#ifdef FBVINS_WITH_LOOP
      {"map", fuzz_map, map_seeds},
      {"vocabulary", fuzz_vocabulary, vocabulary_seeds},
#endif
#ifdef FBVINS_WITH_BAGS
      {"bag", fuzz_bag, bag_seeds},
      {"sqlite_bag", fuzz_sqlite_bag, sqlite_bag_seeds},
      {"message", fuzz_message, message_seeds},
      {"foreign_calibration", fuzz_foreign_calibration, foreign_calibration_seeds},
#endif
#ifdef FBVINS_WITH_LIVE
      {"socket", fuzz_socket, socket_seeds},
      {"mavlink", fuzz_mavlink, mavlink_seeds},
#endif
  };
  return all;
}

}  // namespace fbvins::fuzz
