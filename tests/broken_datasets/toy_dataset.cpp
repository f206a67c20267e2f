// SPDX-License-Identifier: Apache-2.0
#include "tests/broken_datasets/toy_dataset.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>
#include <unistd.h>
#include <zip.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace fbvins::test {
namespace {

std::string camera_yaml(double x_m) {
  return fmt::format(
      "# a toy\nsensor_type: camera\ncomment: toy\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1.0, 0.0, 0.0, {},\n         0.0, 1.0, 0.0, 0.0,\n         0.0, 0.0, 1.0, 0.0,\n         0.0, 0.0, 0.0, 1.0]\n"
      "rate_hz: 20\nresolution: [64, 48]\ncamera_model: pinhole\nintrinsics: [40.0, 40.5, 31.5, 23.5] #fu, fv, cu, cv\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.01, 0.0001, -0.0002]\n",
      x_m);
}

constexpr const char* kImuYaml =
    "%YAML:1.0\nsensor_type: imu\nrate_hz: 200\ngyroscope_noise_density: 1.7e-04\ngyroscope_random_walk: 1.9e-05\n"
    "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n";

int pixel(int seed, int x, int y) { return (3 * x + 5 * y + 7 * seed) & 255; }

}  // namespace

std::int64_t toy_stamp_ns(int frame) { return kToyStart_ns + frame * 50'000'000LL; }

std::string toy_image(int camera, int frame) { return fmt::format("cam{}/data/{}.png", camera, toy_stamp_ns(frame)); }

Files toy_dataset() {
  Files files;
  for (int camera = 0; camera < 2; ++camera) {
    std::string& csv = files[fmt::format("cam{}/data.csv", camera)];
    csv = "#timestamp [ns],filename\n";
    for (int i = 0; i < kToyFrames; ++i) {
      csv += fmt::format("{},{}.png\n", toy_stamp_ns(i), toy_stamp_ns(i));
      files[toy_image(camera, i)] = make_png(i + 100 * camera, {});
    }
    files[fmt::format("cam{}/sensor.yaml", camera)] = camera_yaml(0.1 * camera);
  }
  std::string& imu = files["imu0/data.csv"];
  imu = "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n";
  for (int i = 0; i < kToyImuSamples; ++i)
    imu += fmt::format("{},0.01,-0.02,0.03,0.1,0.2,9.8\n", kToyStart_ns - 100'000'000 + i * 5'000'000LL);
  files["imu0/sensor.yaml"] = kImuYaml;
  std::string& truth = files["state_groundtruth_estimate0/data.csv"];
  truth = "#timestamp, p x y z, q w x y z, v x y z, bw x y z, ba x y z\n";
  for (int i = 0; i < kToyFrames; ++i) truth += fmt::format("{},{},0,1,1,0,0,0,0.2,0,0,0,0,0,0,0,0\n", toy_stamp_ns(i), 0.01 * i);
  return files;
}

std::string make_png(int seed, const PngKind& kind) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(kind.width);
  image.height = static_cast<png_uint_32>(kind.height);
  const int channels = kind.colour ? 3 : 1;
  image.format = (kind.colour ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY) | (kind.sixteen_bit ? PNG_FORMAT_FLAG_LINEAR : 0);
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint16_t> words;
  for (int y = 0; y < kind.height; ++y)
    for (int x = 0; x < kind.width; ++x)
      for (int c = 0; c < channels; ++c) {
        bytes.push_back(static_cast<std::uint8_t>(pixel(seed, x, y)));
        words.push_back(static_cast<std::uint16_t>(257 * pixel(seed, x, y)));
      }
  const void* data = kind.sixteen_bit ? static_cast<const void*>(words.data()) : bytes.data();
  png_alloc_size_t size = 0;
  if (!png_image_write_to_memory(&image, nullptr, &size, 0, data, 0, nullptr)) throw std::runtime_error(image.message);
  std::string out(size, '\0');
  if (!png_image_write_to_memory(&image, out.data(), &size, 0, data, 0, nullptr)) throw std::runtime_error(image.message);
  out.resize(size);
  return out;
}

std::string make_jpeg(int seed) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < kToyHeight; ++y)
    for (int x = 0; x < kToyWidth; ++x) bytes.push_back(static_cast<std::uint8_t>(pixel(seed, x, y) / 4));
  tjhandle tj = tjInitCompress();
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  tjCompress2(tj, bytes.data(), kToyWidth, 0, kToyHeight, TJPF_GRAY, &jpeg, &size, TJSAMP_GRAY, 90, 0);
  std::string out(reinterpret_cast<const char*>(jpeg), size);
  tjFree(jpeg);
  tjDestroy(tj);
  return out;
}

void edit_lines(std::string& text, const std::function<void(std::vector<std::string>&)>& edit) {
  std::vector<std::string> lines;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = text.find('\n', start);
    lines.push_back(text.substr(start, end - start));
    start = end == std::string::npos ? text.size() : end + 1;
  }
  edit(lines);
  text.clear();
  for (const std::string& line : lines) text += line + '\n';
}

void replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("the toy dataset does not hold " + from);
  text.replace(at, from.size(), to);
}

void write_folder(const Files& files, const std::string& folder) {
  for (const auto& [name, bytes] : files) {
    const std::filesystem::path path = folder + "/" + name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
  }
}

void write_zip(const Files& files, const std::string& path, const std::string& top) {
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  for (const auto& [name, bytes] : files) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    zip_file_add(archive, (top + name).c_str(), source, ZIP_FL_OVERWRITE);
  }
  if (zip_close(archive) != 0) throw std::runtime_error("cannot write " + path);
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "fbvins_test_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace fbvins::test
