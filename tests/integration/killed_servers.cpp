#include "tests/integration/killed_servers.hpp"

#include <csignal>
#include <thread>

#include "server/journal/journal.hpp"
#include "server/storage/journal_entries.hpp"
#include "tests/integration/hand.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

constexpr double kWidth_mm = 12.0;

// The journal's cuts of each author: the room's sequence numbers, by author sequence number.
std::map<AuthorId, std::map<std::uint64_t, RoomSeq>> read_seqs(const std::filesystem::path& file,
                                                               KilledServers& report) {
  std::map<AuthorId, std::map<std::uint64_t, RoomSeq>> seqs;
  Result<Journal> journal = Journal::open(file);
  if (!journal) {
    report.fault = journal.error().message;
    return seqs;
  }
  const Result<void> read = journal->read(RoomSeq{1}, [&](const JournalEntry& one) {
    const Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    if (!entry) report.fault = entry.error().message;
    if (!entry) return false;
    const auto* cut = std::get_if<CutEntry>(&entry->what);
    if (cut && !seqs[cut->cut.author].emplace(cut->cut.author_seq, one.seq).second) ++report.twice;
    return true;
  });
  if (!read) report.fault = read.error().message;
  return seqs;
}

}  // namespace

KilledServers kill_servers(int kills, std::uint64_t seed) {
  KilledServers report;
  Random random(seed);
  TempDir folder;
  const std::filesystem::path file = folder / "room.journal";
  Stage stage(kWidth_mm, {"--plain", "--journal", file.string()});
  const std::vector<std::string> again{"--plain", "--journal", file.string(), "--listen", stage.address()};
  std::vector<std::unique_ptr<Hand>> hands;
  for (std::uint64_t i = 0; i < 2; ++i)
    hands.push_back(std::make_unique<Hand>(stage.address(), folder / "cache", seed * 2 + i));
  const auto acknowledged = [&] {
    std::uint64_t all = 0;
    for (const auto& hand : hands) all += hand->surgeon().acknowledged().size();
    return all;
  };
  const auto all_stand = [&] {
    return std::ranges::all_of(hands, [](const auto& hand) { return hand->surgeon().stands(); });
  };
  auto listens = std::chrono::steady_clock::now();
  for (; report.kills < kills && report.fault.empty(); ++report.kills) {
    if (!wait_until(all_stand, 60s)) report.fault = "a hand did not come back to its room";
    if (report.kills > 0) report.back.record(std::chrono::steady_clock::now() - listens);
    const std::uint64_t before = acknowledged();
    // Three of four servers are killed during work, however slow the machine is. The fourth may still welcome its
    // hands.
    if (report.kills % 4 != 3 && !wait_until([&] { return acknowledged() > before; }, 60s))
      report.fault = "no cut was acknowledged after a start";
    std::this_thread::sleep_for(std::chrono::microseconds(random.index(60'000)));
    stage.server().signal(SIGKILL);
    (void)stage.server().wait(10s);
    if (acknowledged() == before) ++report.killed_idle;
    for (const auto& hand : hands)
      if (const std::string why = hand->surgeon().rejected(); !why.empty())
        report.fault = "an honest cut was rejected: " + why;
    const auto started = std::chrono::steady_clock::now();
    stage.start_server(again);
    listens = std::chrono::steady_clock::now();
    report.up.record(listens - started);
  }
  for (const auto& hand : hands) hand->rest();
  const auto settled = [&] {
    return std::ranges::all_of(
        hands, [](const auto& hand) { return hand->surgeon().stands() && hand->surgeon().own() >= hand->sent(); });
  };
  if (report.fault.empty() && !wait_until(settled, 60s)) report.fault = "what was cut was not decided in the end";
  std::this_thread::sleep_for(300ms);
  const std::string hash = status_of(hands.front()->surgeon().session().room()).field_hash();
  for (const auto& hand : hands) report.hashes_that_differ += wire::to_wire(hand->surgeon().hash()) != hash;
  (void)stage.server().terminate();

  const auto seqs = read_seqs(file, report);
  for (const auto& hand : hands) {
    report.sent += hand->sent();
    const auto found = seqs.find(hand->surgeon().author());
    const std::map<std::uint64_t, RoomSeq> kept =
        found == seqs.end() ? std::map<std::uint64_t, RoomSeq>{} : found->second;
    report.kept += kept.size();
    if (!kept.empty()) report.missing += kept.rbegin()->first - kept.size();
    for (const auto& [author_seq, seq] : hand->surgeon().acknowledged()) {
      ++report.acknowledged;
      const auto entry = kept.find(author_seq);
      report.lost += entry == kept.end() || entry->second != seq;
    }
  }
  return report;
}

}  // namespace osteon::test
