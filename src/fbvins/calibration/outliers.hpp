// SPDX-License-Identifier: Apache-2.0
// Private: the adjustment of all views, corners that do not fit left out.
#pragma once

#include "fbvins/calibration/rig_adjustment.hpp"

namespace fbvins {

/// Adjusts with a robust loss, then without one, leaving out corners beyond five deviations and views of which a third does not
/// fit. Returns the deviation of a coordinate of those that are kept, for the degrees of freedom that are left.
double adjust_without_outliers(RigAdjustment& adjustment);

}  // namespace fbvins
