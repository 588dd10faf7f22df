// osteon-felt-stages [SECONDS]: shows the time of each stage from a cut of one hand until it is in the patch that
// another feels. It uses two clients' fast paths and replicas, a room with a journal on the disk, and real sockets and
// threads.
// All is in one process, so that one clock sees every stage. It runs on the loopback, and at 40 +- 10 ms with 30 %
// lost, 10 % reordered, 5 % twice. Hands and the bad network are simulated. Prints JSON, milliseconds.
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "common/core/check.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/net/fast_path.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/rpc/link_server.hpp"
#include "server/storage/room_store.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/perf/stroke.hpp"
#include "tests/support/relay/impair_process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

// Stages of a cut of one hand until the other feels it.
enum Moment { sent, at_server, tick_began, decided, told, came, felt, kMoments };
constexpr std::array<const char*, kMoments> kStages{"",       "uplink",   "wait_for_tick",    "decide",
                                                    "commit", "downlink", "replica_and_patch"};

// Times of one hand's cuts, by author_seq - 1.
struct Times {
  explicit Times(std::size_t cuts) : of(cuts) {}
  void note(Moment what, std::uint64_t author_seq) {
    if (author_seq > 0 && author_seq <= of.size()) of[author_seq - 1][what] = Clock::now().time_since_epoch().count();
  }
  std::vector<std::array<std::atomic<std::int64_t>, kMoments>> of;
};

// A hand's client and its end in the room, put together as the programs do.
class Line final : public SessionSubscriber, private SessionLink::Receiver, public std::enable_shared_from_this<Line> {
 public:
  // `port`: UDP port at which the client's datagrams reach the links. 0: their own port.
  Line(RoomRuntime& runtime, LinkServer& links, AuthorId author, std::uint16_t port, std::size_t cuts)
      : runtime_(runtime),
        links_(links),
        author_(author),
        port_(port != 0 ? port : links.port()),
        replica_(runtime.bone(), BodyId{}),
        model_(*find_tool("burr-round-5"), runtime.bone().pitch_mm()),
        times(cuts) {}
  ~Line() override {
    if (path_) path_->stop();
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
      wake_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
    runtime_.leave(*this);
    if (link_) links_.remove(link_);
  }
  // Called before any cut. `other` is the line whose cuts are felt here.
  void feel(Line& other) {
    other_ = &other;
    thread_ = std::thread([this] { follow(); });
  }
  [[nodiscard]] FastPathHealth health() const { return path_ ? path_->health() : FastPathHealth{}; }

  void send(const Cut& cut) {
    CuttingState state;
    state.author = author_;
    state.state_seq = cut.author_seq;
    state.phase = CuttingPhase::cutting;
    state.tool_name = "burr-round-5";
    state.spindle_rpm = cut.spindle_rpm;
    state.pose_bone_tool = state.pose_bone_device = dequantise(cut.path.back());
    {
      const std::lock_guard lock(mutex_);
      tip_ = state.pose_bone_tool;
    }
    times.note(sent, cut.author_seq);
    // A cut that does not fit into datagrams goes over the stream, which is not in this program. It is counted.
    if (!path_->send(cut)) {
      ++streamed;
      link_->insert(cut);
    }
    (void)path_->send(state);
  }

  // --- the room's side
  AuthorId author() const override { return author_; }
  void begin(SessionStart) override {
    link_ = links_.add(author_, 1, *this);
    auto opened =
        FastPath::open("127.0.0.1", port_, link_->keys(), 1,
                       {.entry = [this](wire::IndexedEntry entry) { receive(std::move(entry)); }, .dead = [] {}});
    OSTEON_CHECK(opened.has_value());
    path_ = std::move(*opened);
  }
  void know_tool(std::uint32_t number, const Digest& tool) override {
    link_->know_tool(number, tool);
    path_->know_tool(number, tool);
  }
  void set_leaves(std::vector<FieldLeaf>) override {}
  void enqueue(const SessionMessage& message) override {
    const wire::SessionEntry& fast = message.fast;
    const bool committed = fast.kind == wire::SessionEntryKind::committed;
    if (committed && fast.cut.author == author_) times.note(told, fast.cut.author_seq);
    if (!link_->enqueue(++index_, fast)) path_->received(index_);  // the stream's copy
  }
  void answer(const SessionMessage&) override {}
  void refuse(const Error&) override { ++refused; }
  void decided() override {}
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }

 private:
  void take(Cut cut) override {
    const std::uint64_t number = cut.author_seq;
    times.note(at_server, number);
    // Events beside the cut in the room's queue note when its tick handles it.
    const auto note = [this, number](Moment what) {
      runtime_.queue_event(
          [this, number, what](Room&) {
            times.note(what, number);
            return RoomEvent{};
          },
          [](const Result<RoomEvent>&) {});
    };
    note(tick_began);
    runtime_.queue_cut(shared_from_this(), std::move(cut), Clock::now());
    note(test::decided);
  }
  void take(CuttingState state) override { runtime_.publish_state(std::move(state)); }
  void arrived(std::uint64_t) override {}

  // --- the client's side
  void receive(wire::IndexedEntry indexed) {
    if (indexed.entry.kind != wire::SessionEntryKind::committed) return;
    if (indexed.entry.cut.author == other_->author_) other_->times.note(came, indexed.entry.cut.author_seq);
    const std::lock_guard lock(mutex_);
    entries_.push_back(std::move(indexed.entry));
    wake_.notify_one();
  }
  // The work of the client's replica thread.
  void follow() {
    std::deque<wire::SessionEntry> entries;
    while (true) {
      Pose tip;
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return over_ || !entries_.empty(); });
        if (over_) return;
        entries.swap(entries_);
        tip = tip_;
      }
      for (const wire::SessionEntry& entry : entries)
        replica_.commit(entry.room_seq, entry.cut, entry.cut.author == author_);
      replica_.settle();
      for (const ChangedLeaves& change : replica_.take_changes())
        builder_.changed(runtime_.bone().pitch_mm(), change.level, change.origins);
      builder_.build(replica_.bodies(), model_, tip, patch_);
      for (const wire::SessionEntry& entry : entries)
        if (entry.cut.author == other_->author_) other_->times.note(felt, entry.cut.author_seq);
      entries.clear();
    }
  }

  RoomRuntime& runtime_;
  LinkServer& links_;
  const AuthorId author_;
  const std::uint16_t port_;
  Line* other_ = nullptr;
  std::shared_ptr<SessionLink> link_;
  std::unique_ptr<FastPath> path_;
  std::uint64_t index_ = 0;  // of entries; by one thread at a time

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<wire::SessionEntry> entries_;
  Pose tip_;
  bool over_ = false;
  Replica replica_;  // of its thread, as all members below
  const haptic::ToolModel model_;
  haptic::PatchBuilder builder_;
  haptic::Patch patch_;
  std::thread thread_;

 public:
  Times times;
  std::atomic<std::uint64_t> streamed{0}, refused{0};
};

json run_stages(const Case& bone, const std::vector<Cut>& stroke, const std::vector<std::string>& impairment,
                double seconds) {
  const TempDir folder;
  Result<PersistedRoom> kept = RoomStore::open(folder / "room.journal", bone, {});
  OSTEON_CHECK(kept.has_value());
  RoomRuntime runtime(
      std::move(kept->room), {}, [](double) {}, Detail::automatic, kept->store.get());
  Result<std::unique_ptr<LinkServer>> links = LinkServer::open("127.0.0.1");
  OSTEON_CHECK(links.has_value());
  std::optional<ImpairProcess> relay;
  std::uint16_t port = 0;
  if (!impairment.empty()) {
    relay.emplace(std::vector<std::string>{"--udp", "127.0.0.1:" + std::to_string((*links)->port())});
    const std::string at = relay->udp();
    port = static_cast<std::uint16_t>(std::atoi(at.c_str() + at.rfind(':') + 1));
  }
  const auto cuts = static_cast<std::size_t>(seconds / std::chrono::duration<double>(kCutsApart).count());
  std::array<std::shared_ptr<Line>, 2> lines;
  for (auto& line : lines)
    line = std::make_shared<Line>(runtime, **links, runtime.join(MemberKind::surgeon).value(), port, cuts);
  lines[0]->feel(*lines[1]);
  lines[1]->feel(*lines[0]);
  for (const auto& line : lines) OSTEON_CHECK(runtime.open_session(line).has_value());
  OSTEON_CHECK(wait_until([&] { return lines[0]->health().alive && lines[1]->health().alive; }, 20s));
  if (relay)
    for (const std::string& command : impairment) OSTEON_CHECK(relay->command(command) == "ok");
  std::this_thread::sleep_for(500ms);

  const RuntimeHealth before = runtime.health();
  const FastPathHealth path_before = lines[0]->health();
  std::vector<std::thread> hands;
  for (std::size_t hand = 0; hand < 2; ++hand)
    hands.emplace_back([&, hand] {
      Line& line = *lines[hand];
      const auto start = Clock::now() + kCutsApart * hand / 2;
      for (std::uint64_t i = 0; i < cuts; ++i) {
        std::this_thread::sleep_until(start + i * kCutsApart);
        Cut cut = stroke[(i + hand * stroke.size() / 2) % stroke.size()];
        cut.author = line.author();
        cut.author_seq = i + 1;
        cut.lease_epoch = runtime.lease_epoch(cut.author);
        line.send(cut);
      }
    });
  for (std::thread& hand : hands) hand.join();
  const auto all_felt = [&](const Line& line) { return line.times.of.back()[felt].load() != 0; };
  const bool there = wait_until([&] { return all_felt(*lines[0]) && all_felt(*lines[1]); }, 20s);
  const RuntimeHealth after = runtime.health();
  const FastPathHealth path = lines[0]->health();

  std::array<std::vector<double>, kMoments> took;
  std::vector<double> whole;
  for (const auto& line : lines)
    for (const auto& moments : line->times.of) {
      if (moments[felt] == 0) continue;
      for (std::size_t i = 1; i < kMoments; ++i)
        took[i].push_back(1e-6 * static_cast<double>(moments[i] - moments[i - 1]));
      whole.push_back(1e-6 * static_cast<double>(moments[felt] - moments[sent]));
    }
  json stages;
  for (std::size_t i = 1; i < kMoments; ++i) stages[kStages[i]] = spread(took[i]);
  const TickStats tick = after.tick.since(before.tick);
  const DurationHistogram commit = after.commit.since(before.commit);
  json out{{"cuts", 2 * cuts},          {"all_felt", there}, {"streamed", lines[0]->streamed + lines[1]->streamed},
           {"whole", spread(whole)},    {"stages", stages},  {"round_trip_ms", rounded(path.round_trip_ms)},
           {"loss", rounded(path.loss)}};
  // Datagrams of one client. `packets` are those that arrived, if some are lost on the way down.
  const auto line = [&](std::uint64_t packets, std::uint64_t bytes) -> json {
    return {{"packets_per_s", rounded(static_cast<double>(packets) / seconds)},
            {"kbit_per_s", rounded(8e-3 * static_cast<double>(bytes + 28 * packets) / seconds)}};
  };
  out["up"] = line(path.packets_sent - path_before.packets_sent, path.bytes_sent - path_before.bytes_sent);
  out["down"] =
      line(path.packets_received - path_before.packets_received, path.bytes_received - path_before.bytes_received);
  const auto in_ms = [](const DurationHistogram& times) -> json {
    return {{"p50", rounded(1e-3 * times.percentile_us(50))}, {"p99", rounded(1e-3 * times.percentile_us(99))}};
  };
  out["tick_late_ms"] = in_ms(tick.lateness);
  out["transaction_ms"] = in_ms(commit);
  out["cut_closes_after_ms"] = {{"most", kCutsApart.count()}};
  runtime.stop();  // it holds no line any more
  return out;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  const double seconds = argc > 1 ? std::max(1.0, std::atof(argv[1])) : 10.0;
  const osteon::Case bone = osteon::haptic::test::block_case(40);
  const std::vector<osteon::Cut> stroke = burred_stroke(seconds);
  OSTEON_CHECK(!stroke.empty());
  std::size_t knots = 0;
  for (const osteon::Cut& cut : stroke) knots += cut.path.size();
  const std::vector<std::string> bad{"delay 40 10", "loss 0.3", "reorder 0.1", "duplicate 0.05"};
  const nlohmann::json out{{"knots_per_cut", rounded(static_cast<double>(knots) / static_cast<double>(stroke.size()))},
                           {"loopback", run_stages(bone, stroke, {}, seconds)},
                           {"bad", run_stages(bone, stroke, bad, seconds)}};
  std::printf("%s\n", out.dump(1).c_str());
  return 0;
}
