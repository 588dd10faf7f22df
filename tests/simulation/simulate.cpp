#include "tests/simulation/simulate.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <iterator>
#include <memory>
#include <variant>

#include "tests/simulation/sim_client.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/room/parts.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = VirtualTime::Time;

// At most, after all faults, until all clients are connected and all is decided and sent.
constexpr Time kSettling = 60s;
constexpr double kSettled_s = 2;  // of that, once all clients are connected
constexpr Time kQuiet = 2s;       // then, before all must be equal

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

const Case& small_block() {
  static const Case block = plain_block(8.0, 4.0, 0.5);
  return block;
}
const Case& large_block() {
  static const Case block = plain_block(20.0, 10.0, 0.5);
  return block;
}

class Simulation {
 public:
  Simulation(std::uint64_t seed, const SimulationOptions& options)
      : options_(options),
        random_(seed),
        link_random_(seed ^ kLinks),
        bone_(options.full ? large_block() : small_block()),
        fast_path_(link_random_.unit() < 0.5),
        seal_(seal()),
        datagrams_(time_, ledger_, link_random_.index(1u << 30), link_random_.unit() < 0.5 ? 0.05 : 0.0),
        server_(time_, ledger_, datagrams_, random_.index(1u << 30), bone_, server_condition()) {
    const std::size_t clients = 2 + random_.index(2);
    for (std::size_t i = 0; i <= clients; ++i) {  // and one that joins late
      const bool late = i == clients;
      ways_.push_back(way());
      clients_.push_back(std::make_unique<SimClient>(time_, ledger_, server_, datagrams_, i + 1,
                                                     random_.index(1u << 30), bone_, hand(late), datagram_plan(),
                                                     options.breakage));
    }
  }

  void run() {
    plan();
    time_.run_until(trouble_ends_);
    end_trouble();
    const Time began = time_.now();
    Time quiet = began;
    while (!(settled() && connected()) && time_.now() - began < kSettling) {
      time_.run_until(time_.now() + 20ms);
      if (!connected()) quiet = time_.now();
    }
    settled_s_ = std::chrono::duration<double>(time_.now() - quiet).count();
    back_s_ = std::chrono::duration<double>(quiet - began).count();
    ledger_.check(settled_s_ <= kSettled_s || !connected(), Invariant::settled,
                  "what was left took " + std::to_string(settled_s_) + " s to be decided and sent");
    for (const auto& client : clients_)
      if (client->here())
        ledger_.check(client->settled(), Invariant::decided, "a client is not settled: " + client->standing());
    time_.run_until(time_.now() + kQuiet);
    if (server_.up())
      check();
    else
      ledger_.fault(Invariant::served, "the server has not come back");
  }

  void report(SimulationReport& report) {
    report.faults = ledger_.faults();
    report.acknowledged = ledger_.acknowledged();
    report.crashes = server_.crashes();
    report.disk_failures = server_.disk_failures();
    report.virtual_s = std::chrono::duration<double>(time_.now()).count();
    report.settled_s = settled_s_;
    report.back_s = back_s_;
    report.fast_path = fast_path_;
    report.datagrams = datagrams_.counts();
    for (const auto& client : clients_) {
      std::ranges::copy(client->felt_by_datagram_ms(), std::back_inserter(report.felt_by_datagram_ms));
      std::ranges::copy(client->felt_by_stream_ms(), std::back_inserter(report.felt_by_stream_ms));
      report.cuts += client->cuts();
      report.resumed += client->resumed();
      report.denied += client->denied();
      report.programs += client->programs();
    }
    report.entries = entries_.size();
    for (std::size_t i = 1; i < entries_.size(); ++i)
      if (const auto* held = std::get_if<SuperviseEntry>(&entries_[i].what))
        if (const auto* join = std::get_if<JoinEntry>(&entries_[i - 1].what))
          report.carried += held->subject == join->author;
    for (const LogEntry& entry : entries_) {
      report.committed += std::holds_alternative<CutEntry>(entry.what);
      report.rejected += std::holds_alternative<RejectionEntry>(entry.what);
      report.undone += std::holds_alternative<UndoEntry>(entry.what);
      report.decisions += std::holds_alternative<SuperviseEntry>(entry.what);
      const auto* rejection = std::get_if<RejectionEntry>(&entry.what);
      report.forbidden +=
          rejection != nullptr && rejection->reason >= Rejection::frozen && rejection->reason <= Rejection::zone;
      report.splits += std::holds_alternative<SplitEntry>(entry.what);
    }
  }

 private:
  static constexpr std::uint64_t kLinks = 0x6c696e6b73;  // so that a seed's other events are the same without datagrams

  // What both directions of a client's path have in common.
  struct Way {
    Time delay{}, jitter{};
    double loss = 0;
  };
  Way way() {
    constexpr double kLoss[] = {0, 0, 0.02, 0.1, 0.3};
    const bool bad = options_.full || random_.unit() < 0.3;
    Way way;
    way.delay = bad ? drawn(random_, 20ms, 110ms) : drawn(random_, 0ms, 5ms);
    way.jitter = bad ? drawn(random_, 0ms, 10ms) : 0ms;
    way.loss = kLoss[random_.index(5)];
    return way;
  }

  // Keys last for seconds here, at both ends.
  SealRules seal() {
    SealRules rules;
    if (link_random_.unit() < 0.5) rules.rekey_after = drawn(link_random_, 700ms, 5s);
    return rules;
  }

  DatagramPlan datagram_plan() {
    DatagramPlan plan;
    plan.wanted = link_random_.unit() < 0.9;
    if (link_random_.unit() < 0.15) plan.up_blocked = plan.down_blocked = true;
    plan.quality = {.loss = ways_.back().loss,
                    .duplicate = link_random_.unit() < 0.5 ? 0.05 : 0,
                    .reorder = link_random_.unit() < 0.5 ? 0.1 : 0,
                    .corrupt = link_random_.unit() < 0.5 ? 0.02 : 0,
                    .delay = ways_.back().delay,
                    .jitter = ways_.back().jitter};
    plan.link.seal = seal_;
    plan.clock_ahead = drawn(link_random_, 0s, 1000s);
    return plan;
  }

  ServerCondition server_condition() {
    ServerCondition condition;
    // Half of them have limits over time, as osteon-server sets them. These hands cut too briefly to reach its second.
    if (random_.unit() < 0.5)
      condition.limits = {.time_slack = random_.unit() < 0.5 ? 40ms : 1s, .swept_voxels_per_s = 5e8};
    condition.sector_bytes = random_.unit() < 0.5 ? 512 : 4096;
    condition.late_most = drawn(random_, 0ms, 10ms);
    condition.fast_path = fast_path_;
    condition.link.seal = seal_;
    condition.breakage = options_.breakage;
    return condition;
  }

  HandPlan hand(bool late) {
    HandPlan plan;
    plan.tools = {find_tool("burr-round-3.2").value()};
    plan.cuts = late ? 4 : 8 + static_cast<int>(random_.index(10));
    plan.level = random_.unit() < 0.3 ? 1 : 0;
    plan.pause_most = drawn(random_, 500ms, 4s);  // so that there is work during all events
    if (!options_.full) return plan;
    plan.tools.push_back(find_tool("drill-3.2").value());
    plan.cuts = late ? 20 : 60 + static_cast<int>(random_.index(60));
    plan.level = 1;
    plan.reach_mm = 9.0;
    plan.run = 30;
    return plan;
  }

  Time some_time() { return drawn(random_, 300ms, trouble_ends_); }
  // At most this number of times, uniformly drawn.
  template <class Call>
  void now_and_then(std::size_t most, Call call) {
    for (std::size_t n = random_.index(most + 1); n > 0; --n) time_.post(some_time(), call);
  }

  void plan() {
    server_.boot();
    trouble_ends_ = options_.full ? drawn(random_, 8s, 14s) : drawn(random_, 4s, 9s);
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      SimClient& client = *clients_[i];
      const bool late = i + 1 == clients_.size();
      // A stream is delayed by more than its lost segments: it fills the queues on its way, and slows down.
      const Time behind = fast_path_ && link_random_.unit() < 0.7 ? drawn(link_random_, 5ms, 150ms) : 0ms;
      client.path().set({.delay = ways_[i].delay + behind, .jitter = ways_[i].jitter, .loss = ways_[i].loss});
      time_.post(late ? some_time() : drawn(random_, 0ms, 800ms), [&client] { client.start(); });
      for (std::size_t n = random_.index(3); n > 0; --n) {
        const Time from = some_time(), until = from + drawn(random_, 50ms, random_.unit() < 0.2 ? 8s : 1500ms);
        client.path().partition(from, until);
        client.stop_datagrams(true, true, from, until);
      }
      plan_datagrams(client);
      now_and_then(2, [&client] { client.break_line("the connection was reset"); });
    }
    if (random_.unit() < 0.5) time_.post(some_time(), [this] { clients_[1]->leave(); });

    now_and_then(2, [this] { server_.crash(random_.unit() < 0.5); });
    now_and_then(2, [this] { server_.lose_power_at(1 + random_.index(60)); });
    now_and_then(2, [this] { server_.jump_clock(drawn(random_, 100ms, 20s)); });
    now_and_then(2, [this] {
      if (server_.up()) server_.checkpoint();
    });
    if (random_.unit() < 0.15) time_.post(some_time(), [this] { server_.restart(); });
    if (random_.unit() < 0.15)
      time_.post(some_time(), [this] {
        const bool full = random_.unit() < 0.5;
        server_.fail_disk_at(1 + random_.index(40), full ? ENOSPC : EIO,
                             random_.unit() < 0.5 ? MemoryDisk::Lasting::once : MemoryDisk::Lasting::from_then_on);
      });
    if (!options_.full) return;
    now_and_then(2, [this] { part_the_bone(); });
    now_and_then(1, [this] {
      server_.change([](Room& room) { return room.remove_body(AuthorId{1}, room.bodies().back()); },
                     [](const Result<RoomEvent>&) {});
    });
  }

  // Events of datagrams only.
  void plan_datagrams(SimClient& client) {
    if (!fast_path_) return;
    const auto time = [this] { return drawn(link_random_, 300ms, trouble_ends_); };
    for (std::size_t n = link_random_.index(3); n > 0; --n) time_.post(time(), [&client] { client.move(); });
    for (std::size_t n = link_random_.index(3); n > 0; --n) {
      const Time from = time(), until = from + drawn(link_random_, 100ms, link_random_.unit() < 0.3 ? 8s : 1500ms);
      const std::size_t which = link_random_.index(3);
      client.stop_datagrams(which != 0, which != 1, from, until);
    }
    if (link_random_.unit() < 0.3) {
      const std::size_t which = link_random_.index(3);
      time_.post(time(), [&client, which] { client.block_datagrams(which != 0, which != 1); });
    }
  }

  // Cuts like a saw.
  void part_the_bone() {
    const int at = static_cast<int>(random_.index(16)) - 8;
    const bool debris = random_.unit() < 0.2;
    server_.change(
        [this, at, debris](Room& room) {
          const Fragment piece = part(
              bone_, [at](int x) { return x >= at; }, debris ? 0.5 : 1000.0);
          return room.split(room.bodies().front(), {piece}, room.bone_epoch());
        },
        [this](const Result<RoomEvent>& event) {
          if (event) ledger_.told_event(event->room_seq, event->kind);
        });
  }

  void end_trouble() {
    server_.rest();
    datagrams_.rest();
    for (const auto& client : clients_) {
      client->rest();
      client->heal();
    }
  }

  bool connected() {
    return server_.up() && std::ranges::all_of(clients_, [](const auto& client) { return client->connected(); });
  }

  bool settled() {
    return server_.up() &&
           std::ranges::all_of(clients_, [](const auto& client) { return !client->here() || client->settled(); });
  }

  // After quiet.
  void check() {
    const BoneStatus status = server_.runtime().bone_status();
    for (const auto& client : clients_) {
      if (!client->here() || !client->settled()) continue;
      const std::string seq = std::to_string(status.room_seq.value);
      ledger_.check(client->hash() == status.field_hash && client->room_seq() <= status.room_seq, Invariant::one_bone,
                    "a client holds another bone than the room at " + seq + ": " + client->standing());
    }
    const Digest live = server_.live();
    entries_ = server_.entries();
    ledger_.check(entries_.size() == status.room_seq.value, Invariant::replay,
                  "the journal ends elsewhere than the room");
    ledger_.check(server_.replayed() == live, Invariant::replay, "the journal's entries make another room");
    const std::map<AuthorId, Restrictions> held = Ledger::held(entries_);
    for (const auto& client : clients_) {
      if (!client->here() || !client->settled()) continue;
      const auto own = held.find(client->author());
      ledger_.check(client->held() == (own == held.end() ? Restrictions{} : own->second), Invariant::supervised,
                    "a hand does not know what holds for it: " + client->standing());
    }
    if (const auto standing = Ledger::standing(entries_)) check_set(*standing, status.field_hash);
    ledger_.check(server_.reopened(false) == live, Invariant::replay,
                  "the room is another one after it was opened again");
    ledger_.check(server_.reopened(true) == live, Invariant::replay, "a checkpoint makes another room");
  }

  void check_set(std::vector<Cut> cuts, const Digest& expected) {
    for (std::size_t again = cuts.size() / 3; again > 0; --again) cuts.push_back(cuts[random_.index(cuts.size())]);
    for (std::size_t i = cuts.size(); i > 1; --i) std::swap(cuts[i - 1], cuts[random_.index(i)]);
    CutField field(bone_, BodyId{0}, few_tools());
    for (const Cut& cut : cuts) field.apply(cut);
    ledger_.check(field.hash() == expected, Invariant::set_of_cuts,
                  "the standing cuts in another order make another bone");
  }

  const SimulationOptions options_;
  Random random_, link_random_;
  const Case& bone_;
  const bool fast_path_;
  const SealRules seal_;
  VirtualTime time_;
  Ledger ledger_;
  Datagrams datagrams_;
  SimServer server_;
  std::vector<Way> ways_;  // of the clients
  std::vector<std::unique_ptr<SimClient>> clients_;
  std::vector<LogEntry> entries_;
  Time trouble_ends_{};
  double settled_s_ = 0, back_s_ = 0;
};

}  // namespace

SimulationReport simulate(std::uint64_t seed, const SimulationOptions& options) {
  (void)(options.full ? large_block() : small_block());
  SimulationReport report;
  report.seed = seed;
  const double began_ms = cpu_ms();
  const std::uint64_t broken = SimStream::broken();
  {
    Simulation simulation(seed, options);
    simulation.run();
    simulation.report(report);
  }
  report.breaks = SimStream::broken() - broken;
  report.cpu_ms = cpu_ms() - began_ms;
  return report;
}

}  // namespace osteon::test
