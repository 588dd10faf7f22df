#include "tests/integration/bad_network.hpp"

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "haptic_client/contact/patch_builder.hpp"
#include "tests/integration/hand.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/relay/impair_process.hpp"

namespace osteon::test {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

namespace {

// Builds the patch of a hand on a thread of its own, as a client does. The tool is where the other hand has cut last.
class Felt {
 public:
  // `in_patch`: called on that thread for every cut that is in the patch.
  Felt(const Case& bone, std::function<void(const Cut&)> in_patch)
      : in_patch_(std::move(in_patch)),
        replica_(bone, BodyId{}),
        model_(*haptic::ToolModel::make(*find_tool("burr-round-5"), bone.pitch_mm(), 1.0, "")),
        thread_([this] { run(); }) {}
  ~Felt() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
      wake_.notify_one();
    }
    thread_.join();
  }
  void hear(const Cut& cut) {
    const std::lock_guard lock(mutex_);
    came_.push_back(cut);
    wake_.notify_one();
  }

 private:
  void run() {
    std::vector<Cut> cuts;
    while (true) {
      cuts.clear();
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return over_ || !came_.empty(); });
        if (over_) return;
        cuts.swap(came_);
      }
      for (const Cut& cut : cuts) replica_.commit(RoomSeq{replica_.room_seq().value + 1}, cut, false);
      replica_.settle();
      for (const ChangedLeaves& change : replica_.take_changes())
        builder_.changed(replica_.predicted().bone().pitch_mm(), change.level, change.origins);
      builder_.build(replica_.bodies(), model_, dequantise(cuts.back().path.back()), patch_);
      for (const Cut& cut : cuts) in_patch_(cut);
    }
  }

  const std::function<void(const Cut&)> in_patch_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Cut> came_;
  bool over_ = false;
  Replica replica_;  // of its thread, as the members below
  const haptic::ToolModel model_;
  haptic::PatchBuilder builder_;
  haptic::Patch patch_;
  std::thread thread_;
};

}  // namespace

std::string udp_port_of(Process& server) {
  std::string log;
  std::size_t at = std::string::npos;
  // A process's output reaches us a moment later.
  (void)wait_until(
      [&] {
        return log = server.err(),
               (at = log.find("udp_port=")) != std::string::npos && log.find('\n', at) != std::string::npos;
      },
      10s);
  return at == std::string::npos ? "" : std::to_string(std::strtoul(log.c_str() + at + 9, nullptr, 10));
}

BadNetworkRun run_on(const BadNetwork& network, std::uint64_t seed) {
  BadNetworkRun run;
  TempDir folder;
  Stage stage(12.0, {"--plain", "--journal", (folder / "room.journal").string()});
  std::optional<ImpairProcess> relay;
  std::string address = stage.address(), fast_path = network.fast_path;
  if (!network.impairment.empty()) {
    std::vector<std::string> arguments{
        "--tcp", stage.address(), "--udp", "127.0.0.1:" + udp_port_of(stage.server()), "--seed", std::to_string(seed)};
    relay.emplace(arguments);
    if (relay->tcp().empty()) return run.fault = "osteon-impair did not start: " + relay->process().err(), run;
    address = relay->tcp();
    if (fast_path.empty()) fast_path = relay->udp();
  }
  // The hands join on a good network, as people join before an operation.
  std::vector<std::unique_ptr<Hand>> hands;
  std::mutex felt_mutex;
  for (std::uint64_t i = 0; i < 2; ++i)
    hands.push_back(std::make_unique<Hand>(address, folder / "cache", seed * 2 + i, 8ms, fast_path));
  const auto both = [&](auto holds) {
    return std::ranges::all_of(hands, [&](const auto& hand) { return holds(*hand); });
  };
  if (!wait_until([&] { return both([](Hand& hand) { return hand.surgeon().stands(); }); }, 30s))
    run.fault = "a hand did not join";
  if (relay) {
    for (const std::string& command : network.impairment) (void)relay->command(command);
    std::this_thread::sleep_for(1500ms);  // after some hundred packets both ends know the loss rate
  }
  std::vector<std::unique_ptr<Felt>> felt;
  for (std::size_t i = 0; i < 2; ++i)
    felt.push_back(std::make_unique<Felt>(hands[i]->surgeon().session().bone(), [&, i](const Cut& cut) {
      if (cut.author != hands[1 - i]->surgeon().session().room().author) return;
      const std::lock_guard lock(felt_mutex);
      const auto since = Clock::now() - hands[1 - i]->sent_at(cut.author_seq);
      run.felt_ms.push_back(std::chrono::duration<double, std::milli>(since).count());
    }));
  for (std::size_t i = 0; i < 2; ++i)
    hands[i]->surgeon().on_cut([&felt = *felt[i]](const Cut& cut) { felt.hear(cut); });
  const std::size_t parts = network.meanwhile.size() + 1;
  for (std::size_t part = 0; part < parts; ++part) {
    std::this_thread::sleep_for(network.work / parts);
    if (relay && part < network.meanwhile.size()) (void)relay->command(network.meanwhile[part]);
  }
  run.fast_path_alive = both([](Hand& hand) { return hand.surgeon().session().fast_path().alive; });

  for (const auto& hand : hands) hand->rest();
  if (relay) (void)relay->command("good");
  const auto quiet = Clock::now();
  std::string hash;
  const auto converged = [&] {
    if (!both([](Hand& hand) { return hand.surgeon().stands() && hand.surgeon().own() >= hand.sent(); })) return false;
    hash = wire::to_wire(hands[0]->surgeon().hash());
    return wire::to_wire(hands[1]->surgeon().hash()) == hash;
  };
  if (!wait_until(converged, 30s)) run.fault = "the hands do not hold one bone";
  run.converged_s = std::chrono::duration<double>(Clock::now() - quiet).count();
  // Asks the server itself, at its own address.
  const wire::JoinedRoom watcher = join(stage.address(), wire::ClientKind::viewer);
  if (status_of(watcher).field_hash() != hash && run.fault.empty()) run.fault = "the server holds another bone";
  for (const auto& hand : hands) {
    run.sent += hand->sent();
    run.kept += hand->surgeon().own();
    hand->surgeon().on_cut({});
  }
  felt.clear();
  return run;
}

}  // namespace osteon::test
