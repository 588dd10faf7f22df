// Cost of a tick of the haptic loop, and the effect of a silent network on its deadlines. `tick`: one thread at full
// speed, with replica and patches between the ticks.
// `blackout SECONDS`: the loop at 1 kHz beside the replica's thread, in three parts of this length: with a room that
// answers, with a silent one, and with one that answers again. Prints JSON.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/runtime/periodic.hpp"
#include "common/runtime/realtime.hpp"
#include "common/runtime/triple_buffer.hpp"
#include "haptic_client/prediction/confirmation_monitor.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using Clock = std::chrono::steady_clock;

PlanStep burring(double window_mm) {
  PlanStep step;
  step.action = Action::burr;
  step.tool = "burr-round-5";
  step.window_u_mm = step.window_v_mm = window_mm;
  step.depth_mm = 3;
  step.entry.point_mm = Vec3(0, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  return step;
}

struct Cost {
  DurationHistogram all, cutting;
};

// Ticks of a plan, in turns with the work of the other thread.
void measure(const char* name, const PlanStep& step, double width_mm, int rounds) {
  auto cost = std::make_unique<Cost>();
  for (int round = 0; round < rounds; ++round) {
    Bench bench(block_case(width_mm), {step});
    for (int i = 0; i < 20'000 && !bench.session().done(); ++i) {
      const auto start = Clock::now();
      const SessionTick tick = bench.tick();
      const auto took = Clock::now() - start;
      cost->all.record(took);
      if (tick.report.cutting.phase == CuttingPhase::cutting) cost->cutting.record(took);
      bench.follow();
    }
  }
  std::printf(
      "\"%s_ticks\": %llu, \"%s_p50_us\": %.3f, \"%s_p99_us\": %.3f, \"%s_max_us\": %.3f, \"%s_cutting_p50_us\": %.3f, "
      "\"%s_cutting_p99_us\": %.3f",
      name, static_cast<unsigned long long>(cost->all.count()), name, cost->all.percentile_us(50), name,
      cost->all.percentile_us(99), name, cost->all.max_us(), name, cost->cutting.percentile_us(50), name,
      cost->cutting.percentile_us(99));
}

// A tool turns in the cut that it has made, while the hand rocks, twists and pulls it from side to side.
void measure_wedged(const char* name, const char* tool_name) {
  constexpr int kRest = 600, kIn = 2500, kTicks = 6000;
  const Tool tool = *find_tool(tool_name);
  Replica replica(block_case(24.0), BodyId{});
  HapticLoop loop(LoopParams{}, {ToolModel(tool, 0.5)});
  PatchBuilder builder;
  Patch patch;
  LoopInput input;
  const Pose start{{0.1, -0.2, -1.0}, Eigen::Quaterniond::Identity()};
  Pose proxy = start, kept = start;
  input.pose_device_tool = start;
  input.spindle_rpm = tool.spindle_rpm;
  loop.take_up(0, start, WorkspaceMapping{});
  auto cost = std::make_unique<Cost>();
  std::uint64_t room_seq = 0;
  for (int i = 0; i < kRest + kIn + kTicks; ++i) {
    if (i % 12 == 0) {
      for (const ChangedLeaves& change : replica.take_changes()) builder.changed(0.5, change.level, change.origins);
      builder.build(replica.predicted(), loop.tool(0), proxy, patch);
      patch.own_cuts = replica.last_own();
    }
    if (const int in = i - kRest; in >= 0 && in < kIn) {
      input.pose_device_tool.position_mm.z() = std::min(proxy.position_mm.z() + 0.45, -1.0 + 0.006 * in);
    } else if (in >= kIn) {
      const auto turn = [&](double rate, const Vec3& about) {
        return Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * std::sin(rate * in), about));
      };
      input.pose_device_tool.position_mm =
          kept.position_mm + Vec3(0.5 * std::sin(0.011 * in), 0.6 * std::sin(0.017 * in), 0.3 * std::sin(0.023 * in));
      input.pose_device_tool.rotation =
          turn(0.013, Vec3::UnitX()) * turn(0.019, Vec3::UnitY()) * turn(0.029, Vec3::UnitZ());
    }
    const auto begin = Clock::now();
    const LoopReport report = loop.tick(input, patch);
    const auto took = Clock::now() - begin;
    proxy = report.pose_bone_proxy;
    if (i < kRest + kIn)
      kept = proxy;
    else
      cost->all.record(took);
    CutPiece piece;
    while (loop.take_piece(piece)) {
      const Cut cut = cut_of(piece, loop.tool(0), AuthorId{1}, 0);
      replica.add_own(cut);
      replica.commit(RoomSeq{++room_seq}, cut, true);
    }
  }
  std::printf("\"%s_ticks\": %llu, \"%s_p50_us\": %.3f, \"%s_p99_us\": %.3f, \"%s_max_us\": %.3f", name,
              static_cast<unsigned long long>(cost->all.count()), name, cost->all.percentile_us(50), name,
              cost->all.percentile_us(99), name, cost->all.max_us());
}

// The client's two important threads, and a room that answers after 20 ms or is silent.
class Blackout {
 public:
  explicit Blackout(double seconds)
      : ticks_(static_cast<long>(1000.0 * seconds)),
        bone_(block_case(40.0)),
        ready_(*make_ready({burring(36.0)}, bone_)),
        session_(ready_, SimulatedDeviceParams{}, 0.0),
        replica_(bone_, BodyId{}) {}

  void run() {
    std::thread replica([this] { replica_thread(); });
    std::thread haptic([this] { haptic_thread(); });
    haptic.join();
    over_ = true;
    replica.join();
    constexpr const char* kNames[] = {"before", "blackout", "after"};
    for (int i = 0; i < 3; ++i) {
      const TickStats& s = stats_[i];
      std::printf(
          "%s\"%s\": {\"ticks\": %llu, \"missed\": %llu, \"late_p50_us\": %.3f, \"late_p99_us\": %.3f, "
          "\"late_p999_us\": %.3f, "
          "\"late_max_us\": %.3f, \"work_p50_us\": %.3f, \"work_p99_us\": %.3f, \"cutting_ticks\": %ld, "
          "\"held_ticks\": %ld}",
          i > 0 ? ", " : "", kNames[i], static_cast<unsigned long long>(s.work.count()),
          static_cast<unsigned long long>(s.missed), s.lateness.percentile_us(50), s.lateness.percentile_us(99),
          s.lateness.percentile_us(99.9), s.lateness.max_us(), s.work.percentile_us(50), s.work.percentile_us(99),
          cutting_[i], held_[i]);
    }
    std::printf(", \"realtime\": %s, \"most_unconfirmed\": %zu", realtime_ ? "true" : "false", most_unconfirmed_);
  }

 private:
  void haptic_thread() {
    realtime_ = make_realtime(80).all();
    PeriodicTimer timer(std::chrono::milliseconds(1), std::chrono::microseconds(150));
    for (int part = 0; part < 3; ++part) {
      silent_.store(part == 1, std::memory_order_relaxed);
      for (long i = 0; i < ticks_; ++i) {
        const int periods = timer.wait(stats_[part]);
        patches_.refresh();
        const bool follows = follows_.load(std::memory_order_relaxed);
        const SessionTick tick = session_.tick(patches_.value(), follows ? RoomLink::follows : RoomLink::held, periods);
        cutting_[part] += tick.report.cutting.phase == CuttingPhase::cutting;
        held_[part] += !follows;
        places_.store({tick.report.pose_bone_proxy, tick.report.tool});
        timer.done(stats_[part]);
      }
    }
  }
  void replica_thread() {
    struct OnTheWay {
      Clock::time_point due;
      Cut cut;
    };
    std::deque<OnTheWay> way;
    PatchBuilder builder;
    ConfirmationMonitor watch;
    std::uint64_t place = 0;
    while (!over_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      const auto now = Clock::now();
      CutPiece piece;
      while (session_.loop().take_piece(piece)) {
        const Cut cut = cut_of(piece, session_.loop().tool(piece.tool), AuthorId{1}, 0);
        replica_.add_own(cut);
        way.push_back({now + std::chrono::milliseconds(20), cut});
      }
      bool heard = false;
      while (!silent_ && !way.empty() && way.front().due <= now) {
        replica_.commit(RoomSeq{++place}, way.front().cut, true);
        way.pop_front();
        heard = true;
      }
      most_unconfirmed_ = std::max(most_unconfirmed_, replica_.unconfirmed());
      follows_ = watch.update(std::chrono::duration<double>(now.time_since_epoch()).count(), heard,
                              replica_.unconfirmed()) == RoomHealth::follows;
      places_.refresh();
      for (const ChangedLeaves& change : replica_.take_changes())
        builder.changed(bone_.pitch_mm(), change.level, change.origins);
      Patch& patch = patches_.writable();
      builder.build(replica_.bodies(), session_.loop().tool(places_.value().second), places_.value().first, patch);
      patch.own_cuts = replica_.last_own();
      patches_.publish();
    }
  }

  long ticks_;
  Case bone_;
  ReadyPlan ready_;
  SimulatedSession session_;
  Replica replica_;
  TripleBuffer<Patch> patches_;
  TripleBuffer<std::pair<Pose, int>> places_;
  std::array<TickStats, 3> stats_;
  long cutting_[3] = {}, held_[3] = {};
  std::atomic<bool> silent_{false}, follows_{true}, over_{false};
  bool realtime_ = false;
  std::size_t most_unconfirmed_ = 0;
};

int run(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "tick") {
    std::printf("{");
    measure("drill", straight_down("drill-3.2"), 12.0, 2);
    std::printf(", ");
    measure("burr", burring(12.0), 20.0, 2);
    std::printf(", ");
    measure("pin", straight_down("pin-1"), 16.0, 1);
    std::printf(", ");
    measure("saw", straight_down("saw-oscillating-1"), 16.0, 1);
    std::printf(", ");
    measure("saw_narrow", straight_down("saw-oscillating-3"), 16.0, 1);
    std::printf(", ");
    measure_wedged("pin_wedged", "pin-1");
    std::printf(", ");
    measure_wedged("saw_wedged", "saw-oscillating-1");
    std::printf("}\n");
    return 0;
  }
  const double seconds = what == "blackout" && argc > 2 ? std::atof(argv[2]) : 0.0;
  if (!(seconds > 0.0 && seconds <= 600.0)) {
    std::fprintf(
        stderr,
        "osteon-loop-bench: needs `tick`, or `blackout` and the seconds of each part, more than 0 and at most 600\n");
    return 1;
  }
  std::printf("{");
  std::make_unique<Blackout>(seconds)->run();
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::haptic::test

int main(int argc, char** argv) { return osteon::haptic::test::run(argc, argv); }
