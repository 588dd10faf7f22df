// Puts numbered items that came in any order, some of them several times, back into their order: each comes out exactly
// once, after all before it. Pure. One thread. The other end is SendWindow.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace osteon {

struct ReceiveCounts {
  std::uint64_t taken = 0;
  std::uint64_t repeated = 0;  // had come before
  std::uint64_t beyond = 0;    // so far ahead of what is missing that they were dropped; they will come again
};

// `Item`: what a packet's bytes were decoded to.
template <class Item>
class ReceiveWindow {
 public:
  // `first`: number of the first item to come out. `most_ahead`: how far beyond it items are kept; bounds the memory.
  explicit ReceiveWindow(std::uint64_t first = 1, std::uint64_t most_ahead = 1024)
      : next_(first), most_ahead_(most_ahead) {}

  // False for an item that came before or is too far ahead.
  bool offer(std::uint64_t number, Item item) {
    if (number < next_ || held_.contains(number)) {
      ++counts_.repeated;
      return false;
    }
    if (number - next_ >= most_ahead_) {
      ++counts_.beyond;
      return false;
    }
    held_.emplace(number, std::move(item));
    ++counts_.taken;
    return true;
  }

  // The next item in order, once; none while it is missing.
  std::optional<Item> take() {
    const auto at = held_.find(next_);
    if (at == held_.end()) return {};
    std::optional<Item> item(std::move(at->second));
    held_.erase(at);
    ++next_;
    return item;
  }

  // All up to this number have come some other way: none of them comes out any more.
  void skip(std::uint64_t upto) {
    if (upto < next_) return;
    held_.erase(held_.begin(), held_.upper_bound(upto));
    next_ = upto + 1;
  }

  // Every item up to this number was taken, or skipped. To be acknowledged at once, or later where taking is not yet
  // keeping: a cut when it is committed.
  [[nodiscard]] std::uint64_t acknowledged() const { return next_ - 1; }
  // Of the 64 items from upto + 2 on those that have come, taken or not, the lowest bit for upto + 2: what need not be
  // sent again. `upto`: what is acknowledged in the same packet.
  [[nodiscard]] std::uint64_t beyond(std::uint64_t upto) const {
    const std::uint64_t last = held_.empty() ? next_ - 1 : held_.rbegin()->first;
    std::uint64_t bits = 0;
    for (std::uint64_t number = upto + 2, bit = 1; bit != 0 && number <= last; ++number, bit <<= 1)
      if (number < next_ || held_.contains(number)) bits |= bit;
    return bits;
  }
  [[nodiscard]] std::size_t held() const { return held_.size(); }  // out of order, or not yet taken
  [[nodiscard]] const ReceiveCounts& counts() const { return counts_; }

 private:
  std::uint64_t next_;
  std::uint64_t most_ahead_;
  std::map<std::uint64_t, Item> held_;
  ReceiveCounts counts_;
};

}  // namespace osteon
