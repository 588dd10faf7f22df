// osteon-rooms-per-core [SECONDS]: measures the processor time of rooms in one process. Each has a journal on the disk
// and one tool of a simulated hand, whose cuts were made beforehand. Clients, and the network to them, are not
// included. Prints JSON.
#include <sys/resource.h>
#include <time.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>

#include "common/core/check.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/storage/room_store.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/perf/stroke.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}
double cpu_of_process() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
}
double cpu_of_thread() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// A session whose client reads everything at once.
class Listener final : public SessionSubscriber {
 public:
  explicit Listener(AuthorId author) : author_(author) {}
  AuthorId author() const override { return author_; }
  void begin(SessionStart) override {}
  void set_leaves(std::vector<FieldLeaf>) override { open = true; }
  void enqueue(const SessionMessage&) override { ++told; }
  void answer(const SessionMessage&) override {}
  void refuse(const Error&) override { ++refused; }
  void decided() override {}
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }

  std::atomic<bool> open{false};
  std::atomic<std::uint64_t> told{0}, refused{0};

 private:
  const AuthorId author_;
};

// One room with its author.
struct HeldRoom {
  std::unique_ptr<RoomStore> store;
  std::unique_ptr<RoomRuntime> runtime;
  std::shared_ptr<Listener> listener;
  std::uint64_t sent = 0;
};

HeldRoom make_room(const Case& bone, const std::filesystem::path& file, bool kept) {
  HeldRoom held;
  std::optional<Room> room;
  if (kept) {
    Result<PersistedRoom> opened = RoomStore::open(file, bone, {});
    OSTEON_CHECK(opened.has_value());
    held.store = std::move(opened->store);
    room.emplace(std::move(opened->room));
  } else {
    room.emplace(bone, CutLimits{});
  }
  held.runtime = std::make_unique<RoomRuntime>(
      std::move(*room), RuntimeRates{}, [](double) {}, Detail::automatic, held.store.get());
  const Result<AuthorId> author = held.runtime->join(MemberKind::surgeon, "tool");
  OSTEON_CHECK(author.has_value());
  held.listener = std::make_shared<Listener>(*author);
  OSTEON_CHECK(held.runtime->open_session(held.listener).has_value());
  OSTEON_CHECK(wait_until([&] { return held.listener->open.load(); }, 20s));
  return held;
}

// `cutting` false: the rooms are open, and nobody works.
json run_rooms(const Case& bone, const std::vector<Cut>& stroke, std::size_t count, double seconds, bool kept,
               bool cutting) {
  const TempDir folder;
  std::vector<HeldRoom> rooms;
  for (std::size_t i = 0; i < count; ++i)
    rooms.push_back(make_room(bone, folder / ("room" + std::to_string(i) + ".journal"), kept));
  std::this_thread::sleep_for(300ms);
  std::vector<RuntimeHealth> before;
  for (const HeldRoom& room : rooms) before.push_back(room.runtime->health());

  // Each room's cuts have their own phase within the interval between two cuts.
  const double cpu_before = cpu_of_process(), own_before = cpu_of_thread();
  const auto start = Clock::now();
  const auto periods = static_cast<std::uint64_t>(seconds / std::chrono::duration<double>(kCutsApart).count());
  for (std::uint64_t period = 0; period < periods; ++period)
    for (std::size_t i = 0; i < count; ++i) {
      std::this_thread::sleep_until(start + period * kCutsApart + kCutsApart * i / count);
      if (!cutting) continue;
      HeldRoom& room = rooms[i];
      Cut cut = stroke[(room.sent + i * 17) % stroke.size()];
      cut.author = room.listener->author();
      cut.author_seq = ++room.sent;
      cut.lease_epoch = room.runtime->lease_epoch(cut.author);
      room.runtime->queue_cut(room.listener, std::move(cut), Clock::now());
    }
  const double wall = std::chrono::duration<double>(Clock::now() - start).count();
  const double cpu = cpu_of_process() - cpu_before - (cpu_of_thread() - own_before);
  for (const HeldRoom& room : rooms) OSTEON_CHECK(wait_until([&] { return room.listener->told >= room.sent; }, 60s));
  const double behind = std::chrono::duration<double>(Clock::now() - start).count() - wall;

  double late_p99 = 0, work_p99 = 0, commit_p99 = 0, committed = 0, missed = 0, ticks = 0, rejected = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const RuntimeHealth health = rooms[i].runtime->health();
    const TickStats tick = health.tick.since(before[i].tick);
    late_p99 = std::max(late_p99, 1e-3 * tick.lateness.percentile_us(99));
    work_p99 = std::max(work_p99, 1e-3 * tick.work.percentile_us(99));
    commit_p99 = std::max(commit_p99, 1e-3 * health.commit.since(before[i].commit).percentile_us(99));
    missed += static_cast<double>(tick.missed);
    ticks += static_cast<double>(tick.work.count());
    committed += static_cast<double>(health.counts.committed - before[i].counts.committed);
    rejected += static_cast<double>(health.counts.rejected - before[i].counts.rejected);
    rooms[i].runtime->stop();
  }
  return {{"rooms", count},
          {"cuts_per_s_and_room", rounded(committed / wall / static_cast<double>(count))},
          {"rejected", rejected},
          {"cores", rounded(cpu / wall)},
          {"core_s_per_room_s", std::round(1e6 * cpu / wall / static_cast<double>(count)) / 1e6},
          {"rooms_per_core", rounded(wall * static_cast<double>(count) / cpu)},
          {"behind_at_the_end_s", rounded(behind)},
          {"tick_missed_share", rounded(missed / (ticks + missed))},
          {"worst_room_ms",
           {{"tick_late_p99", rounded(late_p99)},
            {"tick_work_p99", rounded(work_p99)},
            {"commit_p99", rounded(commit_p99)}}}};
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  const double seconds = argc > 1 ? std::max(1.0, std::atof(argv[1])) : 10.0;
  const osteon::Case bone = osteon::haptic::test::block_case(40);
  const std::vector<osteon::Cut> stroke = burred_stroke(seconds);
  OSTEON_CHECK(!stroke.empty());
  nlohmann::json out{{"seconds", seconds}, {"cuts_of_the_stroke", stroke.size()}, {"cutting", nlohmann::json::array()}};
  for (const std::size_t rooms : {1u, 4u, 16u})
    out["cutting"].push_back(run_rooms(bone, stroke, rooms, seconds, true, true));
  out["not_kept"] = run_rooms(bone, stroke, 4, seconds, false, true);
  out["idle"] = run_rooms(bone, stroke, 4, seconds, true, false);
  std::printf("%s\n", out.dump(1).c_str());
  return 0;
}
