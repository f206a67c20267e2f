// SPDX-License-Identifier: Apache-2.0
// How well biases of an earlier flight are known now (docs/derivations/alignment.md, A21). Pure function.
#pragma once

#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// The estimate at `now`: what was known, a new power-on, and the walk since, which does not go on for ever. A clock that has
/// been set back tells no age: the longest is assumed.
ImuBiasEstimate aged(const ImuState& state, Time now, const ImuNoise& noise);

}  // namespace fbvins
