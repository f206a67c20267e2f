// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/graph_costs.hpp"

#include <ceres/autodiff_cost_function.h>

namespace fbvins {

template <int Dof>
ceres::CostFunction* cost_function(const EdgeCost<Dof>& cost) {
  return new ceres::AutoDiffCostFunction<EdgeCost<Dof>, 6, Dof, Dof>(new EdgeCost<Dof>(cost));
}

template <int Dof>
ceres::CostFunction* cost_function(const ScaledEdgeCost<Dof>& cost, int scales) {
  using Cost = ScaledEdgeCost<Dof>;
  if (scales == 1) return new ceres::AutoDiffCostFunction<Cost, 6, Dof, Dof, 1>(new Cost(cost));
  return new ceres::AutoDiffCostFunction<Cost, 6, Dof, Dof, 1, 1>(new Cost(cost));
}

template <int Dof>
ceres::CostFunction* cost_function(const AnchorCost<Dof>& cost) {
  return new ceres::AutoDiffCostFunction<AnchorCost<Dof>, 6, Dof>(new AnchorCost<Dof>(cost));
}

ceres::CostFunction* cost_function(const ScaleCost& cost) {
  return new ceres::AutoDiffCostFunction<ScaleCost, 1, 1>(new ScaleCost(cost));
}

ceres::CostFunction* cost_function(const GravityCost& cost) {
  return new ceres::AutoDiffCostFunction<GravityCost, 2, 6, 2>(new GravityCost(cost));
}

template ceres::CostFunction* cost_function(const EdgeCost<4>&);
template ceres::CostFunction* cost_function(const EdgeCost<6>&);
template ceres::CostFunction* cost_function(const ScaledEdgeCost<4>&, int);
template ceres::CostFunction* cost_function(const ScaledEdgeCost<6>&, int);
template ceres::CostFunction* cost_function(const AnchorCost<4>&);
template ceres::CostFunction* cost_function(const AnchorCost<6>&);

}  // namespace fbvins
