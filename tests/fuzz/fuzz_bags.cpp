// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/mcap_format.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {
namespace {

StereoRig small_rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{9, 9, 4, 3}, 8, 6);
  rig.T_BC1.p.x() = 0.1;
  return rig;
}

}  // namespace

std::vector<std::string> bag_seeds() {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/flight.bag";
  auto bag = Ros1BagWriter::create(path, small_rig(), Time{0});
  const auto image = std::make_shared<const Image>(8, 6, std::uint8_t{7});
  for (std::int64_t i = 0; i < 3; ++i)
    require(bag->add(ImuSample{Time{1000 * i}}).ok() && bag->add(StereoFrame{Time{1000 * i}, image, image}).ok());
  require(bag->finish().ok());
  return {*read_file(path, 1u << 20u), std::string(kMcapMagic)};
}

/// All that a bag holds is read, and each message again by its place.
void fuzz_bag(std::string_view bytes) {
  const bool mcap = bytes.substr(0, kMcapMagic.size()) == kMcapMagic;
  auto source = bytes_in_memory(std::string(bytes));
  auto bag = mcap ? read_mcap_bag(std::move(source), "bag") : read_ros1_bag(std::move(source), "bag");
  require_sentence(bag);
  if (!bag) return;
  const BagContents contents = read_contents(**bag);
  for (const auto& [name, topic] : contents.images)
    for (const ImageRow& row : topic.rows) {
      const MessagePlace place = place_of(row.file);
      require(place_name(place) == row.file);
      require_sentence(image_of((*bag)->read(place), topic.encoding, topic.compressed));
    }
  const auto topics = choose_topics(contents, {}, true);
  require_sentence(topics);
  if (topics) require_sentence(rig_of(contents, *topics));
}

std::vector<std::string> foreign_calibration_seeds() {
  return {
      "cam0:\n  T_imu_cam: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n"
      "  distortion_model: radtan\n  intrinsics: [4, 4, 3, 2]\n  resolution: [8, 6]\ncam1:\n  T_imu_cam: 5\n",
      R"({"value0": {"T_imu_cam": [{"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}, {"px": 0.1, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}], "intrinsics": [{"camera_type": "kb4", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2, "k1": 0, "k2": 0, "k3": 0, "k4": 0}}, {"camera_type": "pinhole", "intrinsics": {"fx": 4, "fy": 4, "cx": 3, "cy": 2}}], "resolution": [[8, 6], [8, 6]], "imu_update_rate": 200, "accel_noise_std": [1, 1, 1], "gyro_noise_std": [1, 1, 1], "accel_bias_std": [1, 1, 1], "gyro_bias_std": [1, 1, 1]}})",
      "%YAML:1.0\n---\nmodel_type: PINHOLE\nimage_width: 8\nimage_height: 6\ndistortion_parameters:\n   k1: 0\n   k2: 0\n   p1: 0\n   p2: 0\n"
      "projection_parameters:\n   fx: 4\n   fy: 4\n   cx: 3\n   cy: 2\n",
      "image_width: 8\nimage_height: 6\ncamera_matrix:\n  data: [4, 0, 3, 0, 4, 2, 0, 0, 1]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  data: [0, 0, 0, 0, 0]\nrectification_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  data: [4, 0, 3, -0.4, 0, 4, 2, 0, 0, 0, 1, 0]\n"};
}

void fuzz_foreign_calibration(std::string_view bytes) {
  const std::string text(bytes), file = "c.yaml";
  const std::string vins =
      "body_T_cam0:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nbody_T_cam1:\n"
      "  data: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nacc_n: 1\ngyr_n: 1\nacc_w: 1\ngyr_w: 1\n";
  require_sentence(parse_openvins_cameras(text, file));
  require_sentence(parse_basalt(text, file));
  require_sentence(parse_vins_fusion({vins, file}, {text, file}, {text, file}));
  require_sentence(parse_vins_fusion({text, file}, {text, file}, {text, file}));
  require_sentence(parse_camera_info({text, file}, {text, file}, {}));
}

}  // namespace fbvins::fuzz
