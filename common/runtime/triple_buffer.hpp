// State between two threads. The writer always stores the newest value, and the reader always takes the newest complete
// one. Neither ever waits. One writer thread and one reader thread.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace osteon {

template <class T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& initial) { slots_.fill(initial); }

  // [writer] The slot to fill before publish(). It contains some older value.
  [[nodiscard]] T& writable() noexcept { return slots_[write_]; }
  // [writer]
  void publish() noexcept { write_ = shared_.exchange(write_ | kFresh, std::memory_order_acq_rel) & kIndex; }
  // [writer]
  void store(const T& value) {
    writable() = value;
    publish();
  }
  // [reader] Takes the newest value. True if there is a new one.
  bool refresh() noexcept {
    if (!(shared_.load(std::memory_order_relaxed) & kFresh)) return false;
    read_ = shared_.exchange(read_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  // [reader] The value that the last refresh() took.
  [[nodiscard]] T& value() noexcept { return slots_[read_]; }

 private:
  static constexpr std::uint32_t kIndex = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  std::uint32_t write_ = 0;
  std::uint32_t read_ = 1;
  std::atomic<std::uint32_t> shared_{2};
};

}  // namespace osteon
