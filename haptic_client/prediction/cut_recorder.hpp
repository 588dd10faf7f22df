// Turns the proxy's path into cuts. Knots are in the canonical integers and simplified. A cut is closed every 8 ms.
#pragma once
#include <array>
#include <cstdint>

#include "common/field/cut.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

// A cut segment on its way from the haptic thread to the replica: a Cut without what only the session knows.
struct CutPiece {
  static constexpr int kMostKnots = 12;
  std::uint64_t author_seq = 0;
  int tool = 0;  // which of the loop's tools
  int knots = 0;
  std::array<QuantisedPose, kMostKnots> path{};
  std::uint32_t spindle_rpm = 0;
  std::int64_t closed_tick = 0;
  int ticks = 0;  // duration of the path
};

// Makes the whole cut. `model`: the segment's tool. `tick_us`: tick of the loop that made it.
[[nodiscard]] Cut cut_of(const CutPiece& piece, const ToolModel& model, AuthorId author, std::uint64_t lease_epoch,
                         std::uint32_t tick_us = 1000);

class CutRecorder {
 public:
  static constexpr double kTolerance_mm = 0.01;  // of the path, at both ends of the cutting part
  static constexpr int kTicksPerCut = 7;         // closes within 8 ms even when the next tick is late

  // [haptic] Starts a path here. Discards what was not closed.
  void begin(const Pose& pose_bone_tool, double cutting_length_mm) noexcept;
  // [haptic] The proxy has moved on.
  void add(const Pose& pose_bone_tool) noexcept;
  [[nodiscard]] bool recording() const noexcept { return recording_; }
  [[nodiscard]] bool due() const noexcept { return count_ > kTicksPerCut; }
  // [haptic] Ends the segment; the next begins at its last knot. Returns false and closes nothing when nothing has
  // moved.
  bool close(CutPiece& piece) noexcept;
  // [haptic] Ends the path.
  void end() noexcept { recording_ = false; }

 private:
  [[nodiscard]] bool straight(int from, int to) const noexcept;

  static constexpr int kMostPoses = CutPiece::kMostKnots;
  std::array<Pose, kMostPoses> poses_;
  int count_ = 0, ticks_ = 0;
  bool recording_ = false;
  double cutting_length_mm_ = 0;
  QuantisedPose last_{};
};

}  // namespace osteon::haptic
