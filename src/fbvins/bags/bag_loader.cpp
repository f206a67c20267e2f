// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_loader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/grey_image.hpp"
#include "fbvins/io/image_check.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/side_by_side.hpp"

namespace fbvins {
namespace {

std::pair<int, int> size_of(const Image& image) { return {image.width(), image.height()}; }
std::pair<int, int> size_of(const DepthImage& image) { return {image.width, image.height}; }

}  // namespace

int BagLoader::find_used_bits(const std::vector<FrameEntry>& frames) {
  std::uint16_t largest = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const Sensor& s = cameras_[i];
    for (const std::string& place : images_to_try(frames, [&](const FrameEntry& f) { return f.file(static_cast<int>(i)); }))
      largest = std::max(largest, largest_value_of(bag_->read(place_of(place)), s.encoding, s.compressed).value_or(0));
  }
  return used_bits_ = bits_used_for(largest);
}

template <class T, class Read>
std::shared_ptr<const T> BagLoader::load_image(const std::string& place, const Sensor& sensor, Read&& read, ImageCounts& counts,
                                               LoadedFrame& loaded) {
  if (place.empty()) return nullptr;
  std::string& problem = loaded.problem;
  const auto blame = [&](int& count, const std::string& sentence) {
    ++count;
    if (problem.empty()) problem = fmt::format("{}: image at {}: {}", name_, place, sentence);
    return nullptr;
  };
  Result<T> image = read(sensor, bag_->read(place_of(place)));
  if (!image) return blame(counts.corrupt, image.error().message);
  const auto [width, height] = size_of(*image);
  if (const auto sentence = wrong_size(width, height, sensor.camera)) {
    loaded.other_size = ImageSize{width, height};
    return blame(counts.wrong_size, *sentence);
  }
  return std::make_shared<const T>(*std::move(image));
}

LoadedFrame BagLoader::load(const FrameEntry& entry) {
  LoadedFrame out;
  out.frame.t = entry.t;
  out.frame.offsets = entry.offsets;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const auto read = [&](const Sensor& s, std::string_view bytes) {
      Result<Image> image = image_of(bytes, s.encoding, s.compressed, used_bits_);
      return image && s.part != Sensor::whole ? Result<Image>(half_of(*image, s.part == Sensor::right_half ? 1 : 0)) : image;
    };
    if (auto image = load_image<Image>(entry.file(static_cast<int>(i)), cameras_[i], read, out.of(static_cast<int>(i)), out))
      out.frame.set_image(static_cast<int>(i), std::move(image));
  }
  if (!depth_) return out;
  const auto read = [](const Sensor& s, std::string_view bytes) { return depth_of(bytes, s.encoding, s.compressed); };
  out.frame.depth = load_image<DepthImage>(entry.depth_file, *depth_, read, out.depth, out);
  return out;
}

}  // namespace fbvins
