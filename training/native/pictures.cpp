// SPDX-License-Identifier: Apache-2.0
#include "training/native/pictures.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "fbvins/io/image_decode.hpp"

namespace fbvins {

std::vector<std::string> pictures_in(const std::string& folder, Part part) {
  std::map<std::string, std::vector<std::string>> by_folder;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (const auto e = entry.path().extension(); e == ".jpg" || e == ".jpeg" || e == ".png")
      by_folder[entry.path().parent_path().string()].push_back(entry.path().string());
  std::vector<std::string> paths;
  for (auto& [name, members] : by_folder) {
    std::sort(members.begin(), members.end());
    const auto split = static_cast<std::ptrdiff_t>(members.size() * 4 / 5);
    paths.insert(paths.end(), part == Part::held_out ? members.begin() + split : members.begin(),
                 part == Part::train ? members.begin() + split : members.end());
  }
  return paths;
}

Result<Image> read_picture(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return decode_image(std::string(std::istreambuf_iterator<char>(file), {}));
}

}  // namespace fbvins
