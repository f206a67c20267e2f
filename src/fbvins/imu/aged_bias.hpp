// SPDX-License-Identifier: Apache-2.0
// Biases of an earlier flight as the prior of a new one (docs/derivations/alignment.md, A21). Pure function.
#pragma once

#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// The estimate at `now`, its covariance enlarged by the repeatability from power-on to power-on and by the random walk since,
/// which is limited. Where the clock has been set back the age is unknown and the limit is assumed.
ImuBiasEstimate aged(const ImuState& state, Time now, const ImuNoise& noise);

}  // namespace fbvins
