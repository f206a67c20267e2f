// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_series.hpp"

namespace fbvins {
namespace {

class BagSeries final : public BagReader {
 public:
  explicit BagSeries(std::vector<std::unique_ptr<BagReader>> parts) : parts_(std::move(parts)), numbers_(parts_.size()) {}

  std::string format() const override { return parts_.front()->format(); }

  std::string_view read(const MessagePlace& place) override {
    return parts_[place.chunk % parts_.size()]->read({place.chunk / parts_.size(), place.offset, place.length});
  }

 protected:
  std::optional<BagMessage> advance() override {
    for (; at_ < parts_.size(); ++at_) {
      if (auto message = parts_[at_]->next()) {
        message->topic = own_number(message->topic);
        message->place.chunk = message->place.chunk * parts_.size() + at_;
        return message;
      }
      const BagDamage& damage = parts_[at_]->damage();
      if (damage_.parts == 0) damage_.first = damage.first;
      damage_.parts += damage.parts;
      damage_.ends_early |= damage.ends_early;
    }
    return std::nullopt;
  }

 private:
  /// Of a topic of the part in work.
  std::size_t own_number(std::size_t topic) {
    std::vector<std::size_t>& known = numbers_[at_];
    for (std::size_t i = known.size(); i <= topic; ++i) known.push_back(number_of(parts_[at_]->topics()[i]));
    return known[topic];
  }

  std::vector<std::unique_ptr<BagReader>> parts_;
  std::vector<std::vector<std::size_t>> numbers_;  ///< of each part's topics among all of them
  std::size_t at_ = 0;
};

}  // namespace

std::unique_ptr<BagReader> join_bags(std::vector<std::unique_ptr<BagReader>> parts) {
  if (parts.size() == 1) return std::move(parts.front());
  return std::make_unique<BagSeries>(std::move(parts));
}

}  // namespace fbvins
