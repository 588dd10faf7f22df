#include "haptic_client/prediction/cut_recorder.hpp"

#include <utility>

#include "common/geometry/segment.hpp"

namespace osteon::haptic {

Cut cut_of(const CutPiece& piece, const ToolModel& model, AuthorId author, std::uint64_t lease_epoch,
           std::uint32_t tick_us) {
  Cut cut;
  cut.author = author;
  cut.author_seq = piece.author_seq;
  cut.lease_epoch = lease_epoch;
  cut.tool = model.tool.hash();
  cut.level = model.cut_level;
  cut.path.assign(piece.path.begin(), piece.path.begin() + piece.knots);
  cut.spindle_rpm = piece.spindle_rpm;
  cut.path_us = static_cast<std::uint32_t>(piece.ticks) * tick_us;
  return cut;
}

void CutRecorder::begin(const Pose& pose_bone_tool, double cutting_length_mm) noexcept {
  recording_ = true;
  cutting_length_mm_ = cutting_length_mm;
  last_ = quantise(pose_bone_tool);
  poses_[0] = dequantise(last_);
  count_ = 1;
  ticks_ = 0;
}

void CutRecorder::add(const Pose& pose_bone_tool) noexcept {
  ++ticks_;
  // A full buffer keeps its first and newest poses; the caller closes long before that.
  if (count_ == kMostPoses) --count_;
  poses_[static_cast<std::size_t>(count_++)] = pose_bone_tool;
}

bool CutRecorder::straight(int from, int to) const noexcept {
  const Pose& a = poses_[static_cast<std::size_t>(from)];
  const Pose& b = poses_[static_cast<std::size_t>(to)];
  const Vec3 heel{0, 0, -cutting_length_mm_};
  for (int i = from + 1; i < to; ++i) {
    const Pose& p = poses_[static_cast<std::size_t>(i)];
    if (segment_distance_mm(p.position_mm, a.position_mm, b.position_mm) > kTolerance_mm) return false;
    if (segment_distance_mm(p.point(heel), a.point(heel), b.point(heel)) > kTolerance_mm) return false;
  }
  return true;
}

bool CutRecorder::close(CutPiece& piece) noexcept {
  piece.knots = 0;
  piece.path[static_cast<std::size_t>(piece.knots++)] = last_;
  for (int i = 0; i + 1 < count_;) {
    int next = i + 1;
    while (next + 1 < count_ && straight(i, next + 1)) ++next;
    const QuantisedPose knot = quantise(poses_[static_cast<std::size_t>(next)]);
    if (knot != piece.path[static_cast<std::size_t>(piece.knots - 1)])
      piece.path[static_cast<std::size_t>(piece.knots++)] = knot;
    i = next;
  }
  last_ = piece.path[static_cast<std::size_t>(piece.knots - 1)];
  poses_[0] = dequantise(last_);
  count_ = 1;
  piece.ticks = std::exchange(ticks_, 0);
  return piece.knots > 1;
}

}  // namespace osteon::haptic
