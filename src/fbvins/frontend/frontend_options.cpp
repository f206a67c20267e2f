// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frontend_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "fbvins/features/booster.hpp"
#include "fbvins/frontend/either_camera.hpp"
#include "fbvins/frontend/klt_frontend.hpp"
#include "fbvins/frontend/orb_frontend.hpp"
#include "fbvins/frontend/rig_frontend.hpp"

namespace fbvins {
namespace {

using Made = Result<std::unique_ptr<Frontend>>;

/// The keypoints that are extracted for the tracks of a rig are twice those of one pair at most; each group of cameras has its
/// share.
template <class Options>
Options shared_by(Options options, std::size_t groups) {
  if constexpr (requires { options.max_keypoints; })
    if (groups > 2) options.max_keypoints = std::max(1, 2 * options.max_keypoints / static_cast<int>(groups));
  return options;
}

/// `lead(rig, options)`: the frontend for a rig whose left camera leads; with a pair whose right one does not lead anyway, either
/// of its cameras can. Each group of cameras has its own.
template <class Options, class Lead>
std::unique_ptr<Frontend> for_each_group(const StereoRig& rig, const Options& of_rig, Lead&& lead_with) {
  const std::vector<CameraGroup> groups = leading_groups(rig);
  const auto leads = [&](int camera) { return std::ranges::find(groups, camera, &CameraGroup::first) != groups.end(); };
  const Options options = shared_by(of_rig, groups.size());
  const auto lead = [&](const StereoRig& cameras) { return lead_with(cameras, options); };
  std::vector<std::unique_ptr<SharingFrontend>> frontends;
  for (const CameraGroup& group : groups) {
    const StereoRig cameras = rig_of(rig, group);
    if (group.second && !leads(*group.second))
      frontends.push_back(std::make_unique<EitherCamera>(cameras, lead(cameras), lead(mirrored(cameras))));
    else frontends.push_back(lead(cameras));
  }
  if (groups.size() == 1) return std::move(frontends.front());
  return std::make_unique<RigFrontend>(groups, std::move(frontends), of_rig.max_features);
}

Made make_klt(const StereoRig& rig, const FrontendOptions& options) {
  return for_each_group(rig, options.klt, [](const StereoRig& r, const auto& o) { return std::make_unique<KltFrontend>(r, o); });
}

std::unique_ptr<Frontend> orb_with(const StereoRig& rig, const OrbFrontendOptions& options,
                                   const std::shared_ptr<DescriptorStage>& stage) {
  return for_each_group(rig, options,
                        [&](const StereoRig& r, const auto& o) { return std::make_unique<OrbFrontend>(r, o, stage); });
}

Made make_orb(const StereoRig& rig, const FrontendOptions& options) { return orb_with(rig, options.orb, make_identity_stage()); }

Made make_boost(const StereoRig& rig, const FrontendOptions& options) {
  Result<std::unique_ptr<DescriptorStage>> stage = make_booster_stage(options.boost.booster);
  if (!stage) return stage.error();
  return orb_with(rig, options.orb, std::move(*stage));
}

struct Registration {
  std::string_view name, meaning;
  Made (*make)(const StereoRig&, const FrontendOptions&);
};

/// All frontends. The last is the default.
constexpr Registration kFrontends[] = {
    {"klt", "corners followed by Lucas-Kanade", make_klt},
    {"orb", "ORB keypoints followed by patch alignment and descriptors", make_orb},
    {"boost", "orb with descriptors improved by a network", make_boost},
};

}  // namespace

std::vector<std::string> frontend_names() {
  std::vector<std::string> names;
  for (const Registration& r : kFrontends) names.emplace_back(r.name);
  return names;
}

std::string default_frontend() { return std::string(std::end(kFrontends)[-1].name); }

const std::string& frontend_choices() {
  static const std::string choices = fmt::format("{}", fmt::join(frontend_names(), "|"));
  return choices;
}

const std::string& frontend_meanings() {
  static const std::string meanings = [] {
    std::vector<std::string> lines;
    for (const Registration& r : kFrontends) lines.push_back(fmt::format("{}: {}", r.name, r.meaning));
    return fmt::format("{}", fmt::join(lines, "; "));
  }();
  return meanings;
}

Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const FrontendOptions& options) {
  for (const Registration& r : kFrontends)
    if (r.name == options.kind) return r.make(rig, options);
  return Error{ErrorCode::invalid_argument,
               fmt::format("there is no frontend \"{}\"; there are {}", options.kind, fmt::join(frontend_names(), ", "))};
}

Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const std::string& name) {
  FrontendOptions options;
  options.kind = name;
  return make_frontend(rig, options);
}

}  // namespace fbvins
