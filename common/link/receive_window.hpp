// Restores the order of numbered items that arrive in any order and may be repeated. Each item comes out exactly once,
// after all items before it. Pure. One thread. The other end is SendWindow.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace osteon {

struct ReceiveCounts {
  std::uint64_t taken = 0;
  std::uint64_t repeated = 0;  // arrived before
  std::uint64_t beyond = 0;    // dropped, because too far ahead of the missing item; they will be sent again
};

// `Item`: the decoded form of an item.
template <class Item>
class ReceiveWindow {
 public:
  // `first`: number of the first item to come out. `most_ahead`: how far beyond it items are stored; this bounds the
  // memory.
  explicit ReceiveWindow(std::uint64_t first = 1, std::uint64_t most_ahead = 1024)
      : next_(first), most_ahead_(most_ahead) {}

  // False for an item that came before or is too far ahead.
  bool insert(std::uint64_t number, Item item) {
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

  // The next item in order, once. Nothing while it is missing.
  std::optional<Item> take() {
    const auto at = held_.find(next_);
    if (at == held_.end()) return {};
    std::optional<Item> item(std::move(at->second));
    held_.erase(at);
    ++next_;
    return item;
  }

  // All items up to this number arrived in another way. None of them comes out any more.
  void skip(std::uint64_t upto) {
    if (upto < next_) return;
    held_.erase(held_.begin(), held_.upper_bound(upto));
    next_ = upto + 1;
  }

  // Every item up to this number was taken or skipped. Acknowledge it at once, or later if taking an item does not make
  // it durable: a cut is acknowledged when it is committed.
  [[nodiscard]] std::uint64_t acknowledged() const { return next_ - 1; }
  // Bits for the 64 items from upto + 2 on, the lowest for upto + 2. A bit is set if its item has arrived, taken or
  // not, and need not be sent again. `upto`: the number that the same packet acknowledges.
  [[nodiscard]] std::uint64_t beyond(std::uint64_t upto) const {
    const std::uint64_t last = held_.empty() ? next_ - 1 : held_.rbegin()->first;
    std::uint64_t bits = 0;
    for (std::uint64_t number = upto + 2, bit = 1; bit != 0 && number <= last; ++number, bit <<= 1)
      if (number < next_ || held_.contains(number)) bits |= bit;
    return bits;
  }
  [[nodiscard]] std::size_t held() const { return held_.size(); }  // out of order, or not taken yet
  [[nodiscard]] const ReceiveCounts& counts() const { return counts_; }

 private:
  std::uint64_t next_;
  std::uint64_t most_ahead_;
  std::map<std::uint64_t, Item> held_;
  ReceiveCounts counts_;
};

}  // namespace osteon
