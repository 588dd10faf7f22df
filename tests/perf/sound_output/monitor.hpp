// Records the monitor of a sink, and when each frame came.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "tests/perf/sound_output/frame_comparison.hpp"

namespace osteon::test {

// What the sound server says of a sink.
struct SinkFacts {
  bool float_48k_stereo = false;  // its samples are those that are played
  bool full_volume = false;       // of both channels, and not muted
};

// Records 48 kHz, stereo, float32. It asks the server for no latency: that would change the sink's own.
class Monitor {
 public:
  // `sink`: its name. Memory for `most_frames` is taken now; later frames are not recorded. Errors: unavailable.
  [[nodiscard]] static Result<std::unique_ptr<Monitor>> open(const std::string& sink, std::size_t most_frames);
  ~Monitor();

  [[nodiscard]] SinkFacts sink() const;
  // So far. Frames that were read stay where they are.
  [[nodiscard]] std::span<const Frame> frames() const noexcept;
  // Steady clock: when the fragment that has the frame reached this process.
  [[nodiscard]] std::int64_t arrival_ns(std::size_t frame) const;
  // Number of times that the server says it has lost some.
  [[nodiscard]] std::uint64_t holes() const noexcept;

  // The sink asks for a block when the block before it has been played, and the monitor gets it then, at once. So a
  // frame is played at its number over the rate, later than a start that is the same for all. No fragment can come
  // before its first frame is due: the soonest one tells that start.
  struct Clock {
    std::int64_t start_ns = 0;
    std::vector<double> late_ms;  // of each fragment after the soonest one: what the way from the sink adds
    [[nodiscard]] std::int64_t played_ns(std::size_t frame) const noexcept {
      return start_ns + static_cast<std::int64_t>(static_cast<double>(frame) * 1e9 / 48000.0);
    }
  };
  [[nodiscard]] Clock clock(std::size_t from_frame, std::size_t to_frame) const;

 private:
  struct Impl;
  explicit Monitor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::test
