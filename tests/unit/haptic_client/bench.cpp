#include "tests/unit/haptic_client/bench.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::haptic::test {

Case block_case(double width_mm, double pitch_mm) {
  CaseInfo info;
  info.title = "block";
  info.source = "phantom";
  info.pitch_mm = pitch_mm;
  const int half = static_cast<int>(std::lround(0.5 * width_mm / pitch_mm)),
            deep = static_cast<int>(std::lround(30.0 / pitch_mm)), border = 6;
  const CoordBox box{{-half - border, -half - border, -border}, {half + border, half + border, deep + border}};
  DenseVolume<float> surface(box, 0.0f), density(box, 0.0f);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const double h = info.pitch_mm;
        const Vec3 out(std::abs(x) * h - half * h, std::abs(y) * h - half * h, std::max(-z * h, z * h - deep * h));
        const double inside = out.maxCoeff();
        surface.at({x, y, z}) = static_cast<float>(inside > 0.0 ? out.cwiseMax(0.0).norm() : inside);
        const double depth = z * h;
        density.at({x, y, z}) = depth < 5.0 || depth > 25.0 ? 1.9f : 0.3f;
      }
  Result<Case> bone = Case::build(info, surface, density);
  OSTEON_CHECK(bone.has_value());
  return *bone;
}

namespace {
ReadyPlan ready(const std::vector<PlanStep>& plan, const Case& bone) {
  Result<ReadyPlan> result = make_ready(plan, bone);
  OSTEON_CHECK(result.has_value());
  return *result;
}
}  // namespace

PlanStep straight_down(const std::string& tool, HandKind hand) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = tool;
  step.hand = hand;
  step.entry.point_mm = Vec3(0.1, -0.2, 0);
  step.entry.axis = Vec3(0, 0, 1);
  return step;
}

Bench::Bench(const Case& bone, const std::vector<PlanStep>& plan, const SimulatedDeviceParams& device,
             double force_scale, const BenchDelays& delays, double dt_s)
    : Bench(bone, ready(plan, bone), device, force_scale, delays, dt_s) {}

Bench::Bench(const Case& bone, ReadyPlan plan, const SimulatedDeviceParams& device, double force_scale,
             const BenchDelays& delays, double dt_s)
    : Bench(bone, std::make_unique<SimulatedSession>(std::move(plan), device, force_scale, dt_s), delays) {}

Bench::Bench(const Case& bone, std::unique_ptr<Session> session, const BenchDelays& delays)
    : delays_(delays), session_(std::move(session)), replica_(bone, BodyId{}) {}

SessionTick Bench::tick(int periods) {
  last_ = session_->tick(patch_, RoomLink::follows, periods);
  ++ticks_;
  return last_;
}

SessionTick Bench::tick_without_patch() {
  last_ = session_->tick(Patch{}, RoomLink::follows);
  ++ticks_;
  return last_;
}

void Bench::follow() {
  CutPiece piece;
  while (session_->loop().take_piece(piece)) {
    const Cut cut = cut_of(piece, session_->loop().tool(piece.tool), AuthorId{1}, 0);
    replica_.add_own(cut);
    cuts_.push_back(cut);
    on_the_way_.emplace_back(ticks_ + delays_.commit_ticks, cut);
  }
  while (!on_the_way_.empty() && on_the_way_.front().first <= ticks_) {
    replica_.commit(RoomSeq{++room_seq_}, on_the_way_.front().second, true);
    on_the_way_.pop_front();
  }
  if (ticks_ % delays_.patch_ticks != 0) return;
  for (const ChangedLeaves& change : replica_.take_changes())
    builder_.changed(replica_.predicted().bone().pitch_mm(), change.level, change.origins);
  builder_.build(replica_.predicted(), session_->loop().tool(last_.report.tool), last_.report.pose_bone_proxy, patch_);
  patch_.own_cuts = replica_.last_own();
  patch_.room_seq = replica_.room_seq();
}

void Bench::run(const std::function<void(const SessionTick&)>& after_tick) {
  constexpr std::int64_t kMostTicks = 200000;
  while (!session_->done() && ticks_ < kMostTicks) {
    const SessionTick now = tick();
    if (after_tick) after_tick(now);
    follow();
  }
  for (int i = 0; i < 200; ++i) {
    ++ticks_;
    follow();
  }
}

}  // namespace osteon::haptic::test
