// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/lens_numbers.hpp"

#include <fmt/format.h>

#include <cmath>

namespace fbvins {
namespace {

// Far beyond any lens: xi = 1 is a parabolic mirror, beta = 1 the unified model.
constexpr double kLargestXi = 10, kLargestBeta = 100;

}  // namespace

KalibrCamera kalibr_camera(const Camera& camera) {
  const std::array<double, 4> f = camera.intrinsics();
  const std::vector<double> k = camera.distortion();
  const auto joined = [&](std::size_t own) {
    std::vector<double> out(k.begin(), k.begin() + static_cast<std::ptrdiff_t>(own));
    out.insert(out.end(), f.begin(), f.end());
    return out;
  };
  const std::string name = camera.model_name();
  if (name == "ds" || name == "eucm") return {name, joined(2), "none", {}};
  if (name == "omni-radtan") return {"omni", joined(1), "radtan", {k.begin() + 1, k.end()}};
  // The longer ones, which Kalibr does not have, by ROS's names.
  const char* distortion = name == "pinhole-radtan"     ? "radtan"
                           : name == "pinhole-radtan5"  ? "plumb_bob"
                           : name == "pinhole-rational" ? "rational_polynomial"
                                                        : "equidistant";
  return {"pinhole", joined(0), distortion, k};
}

std::optional<LensModel> lens_of(std::string_view model_name, const std::array<double, 4>& f, const std::vector<double>& k) {
  if (!(f[0] > 0 && f[1] > 0)) return std::nullopt;
  if (model_name == "pinhole-radtan" && k.size() == 4) return PinholeRadtan{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3]};
  if (model_name == "pinhole-equidistant" && k.size() == 4) return KannalaBrandt{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3]};
  if (model_name == "pinhole-radtan5" && k.size() == 5)
    return PinholeRadtan5{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3], k[4]};
  if (model_name == "pinhole-rational" && k.size() == 8)
    return PinholeRational{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]};
  if (model_name == "ds" && k.size() == 2 && outside_of_model("ds", k).empty())
    return DoubleSphere{f[0], f[1], f[2], f[3], k[0], k[1]};
  if (model_name == "eucm" && k.size() == 2 && outside_of_model("eucm", k).empty())
    return ExtendedUnified{f[0], f[1], f[2], f[3], k[0], k[1]};
  if (model_name == "omni-radtan" && k.size() == 5 && outside_of_model("omni", k).empty())
    return UnifiedRadtan{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3], k[4]};
  return std::nullopt;
}

std::string outside_of_model(const std::string& model, const std::vector<double>& own) {
  const bool alpha_first = model == "eucm";
  if (model == "omni" || model == "omni-radtan")
    return own[0] >= 0 && own[0] < kLargestXi ? "" : fmt::format("xi is {}, not between 0 and {}", own[0], kLargestXi);
  if (model != "ds" && !alpha_first) return "";
  const double alpha = own[alpha_first ? 0 : 1];
  if (!(alpha >= 0 && alpha <= 1)) return fmt::format("alpha is {}, not between 0 and 1", alpha);
  if (alpha_first && !(own[1] > 0 && own[1] < kLargestBeta))
    return fmt::format("beta is {}, not between 0 and {}", own[1], kLargestBeta);
  if (!alpha_first && !(std::abs(own[0]) < 1)) return fmt::format("xi is {}, not between -1 and 1", own[0]);
  return "";
}

}  // namespace fbvins
