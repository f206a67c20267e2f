// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: makes a corrected calibration more accurate than the findings measure it. The recording is flown with
// it, and what the findings corrected is fitted to the flight (calibration/flight_calibration.hpp). One thread; the same input
// gives the same bytes.
#pragma once

#include <optional>
#include <span>

#include "fbvins/doctor/diagnose.hpp"

namespace fbvins {

/// `corrected` with what `findings` corrected by a measurement refined; none where nothing of it was, the recording cannot be
/// flown, or its halves do not predict one another better with the refined calibration.
Result<std::optional<StereoRig>> refined_by_flight(const StereoRig& corrected, std::span<const Finding> findings,
                                                   const Replay& replay);

}  // namespace fbvins
