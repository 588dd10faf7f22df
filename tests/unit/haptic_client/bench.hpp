// A complete haptic client without threads: session, replica and patches on virtual time, with the delays of real ones.
#pragma once
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/volume/case.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic::test {

// A block across z = 0 … 30 mm: layers 5/20/5 mm at 1.9/0.3/1.9 g/cm³. It is entered along +z. `pitch_mm`: h, which
// must divide 5 mm.
[[nodiscard]] Case block_case(double width_mm = 12.0, double pitch_mm = 0.5);

// A step straight down into it, at a point that falls on no sample.
[[nodiscard]] PlanStep straight_down(const std::string& tool, HandKind hand = HandKind::expert);

struct BenchDelays {
  int patch_ticks = 12;   // between two patches
  int commit_ticks = 25;  // from closing a cut until the room acknowledges it
};

class Bench {
 public:
  Bench(const Case& bone, const std::vector<PlanStep>& plan, const SimulatedDeviceParams& device = {},
        double force_scale = 0.0, const BenchDelays& delays = {}, double dt_s = 1e-3);
  Bench(const Case& bone, ReadyPlan plan, const SimulatedDeviceParams& device = {}, double force_scale = 0.0,
        const BenchDelays& delays = {}, double dt_s = 1e-3);

  // Any other session.
  Bench(const Case& bone, std::unique_ptr<Session> session, const BenchDelays& delays = {});

  // Runs one tick of `dt_s`, `periods` ticks after the last. `after_tick` sees the result before replica and patches
  // are updated.
  SessionTick tick(int periods = 1);
  SessionTick tick_without_patch();  // as when the first patch is late
  // Runs until the plan is done and every cut is acknowledged.
  void run(const std::function<void(const SessionTick&)>& after_tick = {});
  void follow();  // updates replica and patch, as their thread would

  // Only of a bench with a plan.
  [[nodiscard]] SimulatedSession& session() { return static_cast<SimulatedSession&>(*session_); }
  [[nodiscard]] const Replica& replica() const { return replica_; }
  [[nodiscard]] const Patch& patch() const { return patch_; }
  [[nodiscard]] const std::vector<Cut>& cuts() const { return cuts_; }

 private:
  BenchDelays delays_;
  std::unique_ptr<Session> session_;
  Replica replica_;
  PatchBuilder builder_;
  Patch patch_;
  SessionTick last_;
  std::vector<Cut> cuts_;
  std::deque<std::pair<std::int64_t, Cut>> on_the_way_;
  std::int64_t ticks_ = 0;
  std::uint64_t room_seq_ = 0;
};

}  // namespace osteon::haptic::test
