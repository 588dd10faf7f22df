// A simulated hand of a test, in the test's process: a client with a replica that cuts without end.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {

// Cuts without end, as fast as the session takes the cuts, with a limited number of undecided cuts.
class Hand {
 public:
  // `apart`: time between two cuts.
  Hand(const std::string& address, const std::filesystem::path& cache, std::uint64_t seed,
       std::chrono::microseconds apart = std::chrono::microseconds(500), const std::string& fast_path = {})
      : surgeon_(address, cache, fast_path),
        random_(seed),
        apart_(apart),
        burr_(find_tool("burr-round-5").value()),
        thread_([this] { cut(); }) {}
  ~Hand() { rest(); }
  void rest() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
  }
  Surgeon& surgeon() { return surgeon_; }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  // When a cut was sent, on the steady clock. Only for the last 8192 cuts.
  [[nodiscard]] std::chrono::steady_clock::time_point sent_at(std::uint64_t author_seq) const {
    return std::chrono::steady_clock::time_point(
        std::chrono::nanoseconds(sent_at_[author_seq % sent_at_.size()].load()));
  }

 private:
  void cut() {
    constexpr std::uint64_t kMostWaiting = 40;
    auto before = std::chrono::steady_clock::now();
    while (!over_) {
      if (sent_ >= surgeon_.own() + kMostWaiting) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      // A bur makes dimples in the upper face. They separate no fragments.
      const Vec3 at{random_.between(-5, 5), random_.between(-5, 5), random_.between(-0.5, 0.5)};
      Cut cut = straight_cut(burr_, at, at, {0, 0, -1}, sent_ + 1);
      cut.author = surgeon_.author();
      const auto now = std::chrono::steady_clock::now();
      const auto took = std::chrono::duration_cast<std::chrono::microseconds>(now - std::exchange(before, now));
      cut.path_us = static_cast<std::uint32_t>(std::min<std::int64_t>(took.count(), 20'000));
      sent_at_[cut.author_seq % sent_at_.size()] = now.time_since_epoch().count();
      if (surgeon_.session().send(cut)) ++sent_;
      std::this_thread::sleep_for(apart_);
    }
  }

  Surgeon surgeon_;
  Random random_;
  const std::chrono::microseconds apart_;
  const Tool burr_;
  std::atomic<bool> over_{false};
  std::atomic<std::uint64_t> sent_{0};
  std::array<std::atomic<std::int64_t>, 8192> sent_at_{};
  std::thread thread_;
};

}  // namespace osteon::test
