// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/camera_bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "fbvins/bags/bag_stamps.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/io/rig_text.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kImagesForBits = 10;  ///< of each camera

/// The images of a bag by their places.
struct BagImages {
  struct Topic {
    Encoding encoding;
    bool compressed;
  };
  std::unique_ptr<BagReader> bag;
  std::vector<Topic> cameras;
  std::vector<ListedImage> images;
  int used_bits = 16;

  CameraRecording::Decode take(std::size_t index) {
    const ListedImage& image = images[index];
    const Topic topic = cameras[static_cast<std::size_t>(image.camera)];
    return [bytes = std::string(bag->read(place_of(image.name))), topic, bits = used_bits] {
      return image_of(bytes, topic.encoding, topic.compressed, bits);
    };
  }

  /// As BagLoader does (recording.cpp): all images of 16 bits are scaled alike.
  void find_used_bits() {
    std::uint16_t largest = 0;
    for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
      std::vector<std::size_t> own;
      for (std::size_t i = 0; i < images.size(); ++i)
        if (images[i].camera == static_cast<int>(camera)) own.push_back(i);
      const std::size_t step = std::max<std::size_t>(1, own.size() / kImagesForBits);
      const auto [encoding, compressed] = cameras[camera];
      for (std::size_t i = 0; i < own.size(); i += step)
        largest = std::max(largest, largest_value_of(bag->read(place_of(images[own[i]].name)), encoding, compressed).value_or(0));
    }
    used_bits = bits_used_for(largest);
  }
};

void tell_damage(const BagReader& bag, const std::string& path, CameraRecording& out) {
  const BagDamage& damage = bag.damage();
  if (damage.parts > 0) out.warnings.push_back(fmt::format("{} ({} parts of the file are left out)", damage.first, damage.parts));
  if (damage.ends_early) out.warnings.push_back(fmt::format("{}: was cut off; all that is whole is read", path));
}

}  // namespace

bool is_camera_bag(const std::string& path) { return is_bag(path) || is_mcap(path); }

Result<CameraRecording> open_camera_bag(const std::string& path, const std::vector<std::string>& topics) {
  Result<std::unique_ptr<BagReader>> bag = open_bag(path);
  if (!bag) return bag.error();
  BagContents contents = read_contents(**bag);
  const Result<ChosenTopics> chosen = choose_cameras(contents, topics);
  if (!chosen) return Error{chosen.error().code, fmt::format("{}: {}", path, chosen.error().message)};
  CameraRecording out;
  out.cameras = chosen->cameras;
  out.imu_name = chosen->imu;
  out.warnings = continue_clock(contents, *chosen).said;
  auto images = std::make_shared<BagImages>();
  for (const std::string& topic : out.cameras) {
    ImageTopic& of = contents.images.at(topic);
    const int camera = static_cast<int>(images->cameras.size());
    images->cameras.push_back({of.encoding, of.compressed});
    RowCounts counts;
    for (ImageRow& row : in_order(std::move(of.rows), counts)) out.images.push_back({row.t, camera, std::move(row.file)});
  }
  sort_by_time(out.images);
  RowCounts counts;
  if (!out.imu_name.empty()) out.imu = readings_on(contents, chosen->imu, chosen->accel, counts);
  if (!contents.rig.empty())
    if (const Result<StereoRig> rig = parse_rig(contents.rig, path); rig) out.imu_noise = rig->imu_noise;
  tell_damage(**bag, path, out);
  images->bag = *std::move(bag);
  images->images = out.images;
  images->find_used_bits();
  out.take = [images](std::size_t index) { return images->take(index); };
  return out;
}

}  // namespace fbvins
