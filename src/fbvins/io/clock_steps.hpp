// SPDX-License-Identifier: Apache-2.0
// Private: recordings whose clock did not run on: a counter that wrapped, a clock that was set back, a device that started again.
// Stamps of a stream are given in the order in which they were recorded. After a step back nobody knows how much time has passed:
// the stamps are continued after a gap, and the frame after it says so (StereoFrame::after_clock_step). Pure functions, any
// thread.
//
//   StampStream imu = stream_of("imu0/data.csv", readings), images = stream_of("cam0/data.csv", rows);
//   JoinedClock clock = join_clock({&imu, &images});
//   take_clock(imu, readings), take_clock(images, rows);     // continued
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// Continues stamps of a counter of 32 bits of microseconds that began again at 0: from each step back by 4294.967296 s, less at
/// most 10 s, on. Returns how often that was. All other steps back stay as they are.
int continue_wrapped(std::vector<Time>& stamps);
std::string wrapped_sentence(const std::string& name, int wraps);

/// The numbers of the stamps with which a clock that was set back begins, ascending. Rows that came late, or twice, are no such
/// step: after one the stamps go on at their pace, through times that are taken.
std::vector<std::size_t> clock_steps(const std::vector<Time>& stamps);

/// One sensor's stamps.
struct StampStream {
  std::string name;  ///< as sentences call it
  std::vector<Time> stamps;
  std::function<bool(std::size_t, std::size_t)> same = {};  ///< whether two of its rows say the same, wherever that can be told
  std::vector<std::size_t> steps = {};                      ///< where parts begin, after the first one; filled by join_clock
  std::size_t kept = 0;                                     ///< rows from the beginning that are used; filled by join_clock
};

/// Whose rows stay where they are until join_clock().
template <class Row>
StampStream stream_of(std::string name, const std::vector<Row>& rows) {
  StampStream out{std::move(name), {}};
  for (const Row& row : rows) out.stamps.push_back(row.t);
  if constexpr (requires(const Row& row) { row.gyro_radps; })
    out.same = [&rows](std::size_t i, std::size_t j) {
      return rows[i].gyro_radps == rows[j].gyro_radps && rows[i].accel_mps2 == rows[j].accel_mps2;
    };
  if constexpr (requires(const Row& row) { row.file; })
    out.same = [&rows](std::size_t i, std::size_t j) { return rows[i].file == rows[j].file; };
  return out;
}

struct JoinedClock {
  std::vector<Time> begins;       ///< a time in the gap before each part after the first one, on the continued clock
  std::vector<Duration> added;    ///< to the stamps of each part, the first one among them
  std::vector<std::string> said;  ///< a sentence for each step, and for each stream that wrapped
};

/// Continues the stamps of streams that share a clock, in place, wraps included. Where only some of them step back, what comes
/// after the first step cannot be put in time: `kept` leaves it out.
JoinedClock join_clock(const std::vector<StampStream*>& streams);

/// Gives the rows of a stream its stamps.
template <class Row>
void take_clock(const StampStream& stream, std::vector<Row>& rows) {
  rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(stream.kept), rows.end());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].t = stream.stamps[i];
}

/// Gives rows of somebody who knows the same clock, ground truth, its shifts; where they do not step as often, what comes after
/// the first step is left out.
template <class Row>
void follow_clock(const JoinedClock& clock, std::vector<Row>& rows) {
  if (clock.begins.empty()) return;
  const std::vector<std::size_t> steps = clock_steps(stream_of("", rows).stamps);
  if (steps.size() != clock.begins.size()) {
    std::erase_if(rows, [&](const Row& row) { return row.t >= clock.begins.front(); });
    return;
  }
  for (std::size_t k = 0; k < steps.size(); ++k)
    for (std::size_t i = steps[k]; i < (k + 1 < steps.size() ? steps[k + 1] : rows.size()); ++i)
      rows[i].t = rows[i].t + clock.added[k + 1];
}

}  // namespace fbvins
