// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/standstill_factor.hpp"

#include "fbvins/estimator/window_equations.hpp"

namespace fbvins {

double StandstillFactor::cost(const WindowProblem& w) const {
  return 0.5 * information() * w.frame(frame_).state.v_FB.squaredNorm();
}

double StandstillFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const Vec3& v = w.frame(frame_).state.v_FB;
  const int row = out.layout.speed_bias_row(w.index_of(frame_));
  out.H.block<3, 3>(row, row).diagonal().array() += information();
  out.g.segment<3>(row) += information() * v;
  return cost(w);
}

std::vector<std::shared_ptr<const Factor>> StandstillMaker::make(const NewFrame& frame) {
  if (!frame.standstill) return {};
  return {std::make_shared<const StandstillFactor>(frame.frame.id)};
}

}  // namespace fbvins
