#include "tests/support/disk/damage_trials.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <random>

#include "server/journal/maintenance.hpp"
#include "tests/support/disk/journal_trials.hpp"

namespace osteon::test {
namespace {

using Random = std::mt19937_64;

constexpr std::size_t kFaultsShown = 5;

// The files at several moments; the last moment is when the process was killed.
struct Life {
  std::vector<MemoryDisk::Image> images;
  std::vector<JournalEntry> acknowledged, asked;  // asked: in progress when it was killed
};

// Writes until the disk fails at the n-th write or sync. The files are then as after a kill at this moment.
Life live(std::uint64_t seed, MemoryDisk& disk, std::uint64_t killed_at, bool power_fails,
          const std::string& genesis = "a genesis") {
  Life life;
  Random random(seed);
  JournalWriter writer(seed, disk, true, genesis);
  if (writer.open()) {
    writer.work(static_cast<int>(random() % 20));
    life.images.push_back(disk.image());
    if (power_fails)
      disk.fail_power_at(killed_at);
    else
      disk.fail_at(killed_at, EIO, MemoryDisk::Lasting::from_then_on);
    while (writer.work(5)) life.images.push_back(disk.image());
  }
  life.acknowledged = writer.acknowledged();
  life.asked = writer.asked();
  writer.drop();
  if (power_fails)
    disk.power_returns();
  else
    disk.mend();
  life.images.push_back(disk.image());
  return life;
}

std::string random_bytes(Random& random, std::size_t count) {
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

// Changes one file so that it differs. Returns a description of the change.
std::string damage(Random& random, const std::string& name, const Life& life, const MemoryDisk::Image& other,
                   MemoryDisk::Image& image) {
  std::string& bytes = image.at(name);
  const std::size_t at = bytes.empty() ? 0 : random() % bytes.size();
  const std::size_t count = std::min<std::size_t>(1 + random() % 5000, bytes.size() - at);
  switch (random() % 9) {
    case 0:
      if (bytes.empty()) break;
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      return "flip";
    case 1:
      bytes.replace(at, count, std::string(count, '\0'));
      return "zero";
    case 2:
      bytes.replace(at, count, random_bytes(random, count));
      return "overwrite";
    case 3:
      bytes.resize(at);
      return "truncate";
    case 4:
      image.erase(name);
      return "delete";
    case 5:
      bytes.replace(at, count, bytes.substr(random() % (bytes.size() - count + 1), count));
      return "duplicate";
    case 6:
      bytes += random_bytes(random, count);
      return "append";
    case 7:
      if (const auto& older = life.images[random() % life.images.size()]; older.contains(name)) bytes = older.at(name);
      return "older copy";
    default:
      if (other.contains(name)) bytes = other.at(name);
      return "another journal's";
  }
  return "nothing";
}

bool same_entries(const std::vector<JournalEntry>& found, const std::vector<JournalEntry>& known, std::size_t count) {
  return std::equal(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), known.begin(),
                    [](const JournalEntry& a, const JournalEntry& b) {
                      return a.seq == b.seq && a.at_ns == b.at_ns && a.bytes == b.bytes;
                    });
}

struct Verdict {
  enum class Kind { whole, named, refused } kind = Kind::refused;
  std::string fault;  // empty: correct
};

// Opens the journal on the disk and compares it with what was acknowledged. `foreign`: a file belongs to another
// journal and its entries can be read.
Verdict judge(const std::filesystem::path& file, const Life& life, MemoryDisk& disk, bool foreign = false) {
  const auto report = verify_journal(file, &disk);
  auto opened = Journal::open(file, {.disk = &disk, .log_bytes = 8192});
  if (!opened) {
    if (report && report->sound()) return {Verdict::Kind::refused, "verify finds it sound, and it cannot be opened"};
    return {Verdict::Kind::refused, opened.error().message.empty() ? "refused without a word" : ""};
  }
  // A room that opens it compares its genesis with the room's name.
  if (opened->genesis() != "a genesis") return {Verdict::Kind::refused, ""};
  std::vector<JournalEntry> known = life.acknowledged;
  known.insert(known.end(), life.asked.begin(), life.asked.end());
  std::vector<JournalEntry> entries;
  const Result<void> read = opened->read(RoomSeq{1}, [&](const JournalEntry& entry) {
    entries.push_back(entry);
    return true;
  });
  const bool closed = opened->closed_because() != nullptr;
  if (!(closed && foreign) && (entries.size() > known.size() || !same_entries(entries, known, entries.size())))
    return {Verdict::Kind::named, "entries are there that nobody wrote"};
  if (!closed) {
    if (!read || entries.size() < life.acknowledged.size())
      return {Verdict::Kind::whole, "entries are missing in silence"};
    // A checkpoint may be lost: the earlier one, or the entries, then replace it.
    const bool doubted = !report || !std::ranges::all_of(report->faults, [](const std::string& fault) {
      return fault.find(".checkpoint") != fault.npos;
    });
    if (doubted)
      return {Verdict::Kind::whole, "verify finds damage, and it takes entries: " +
                                        (report ? report->faults.front() : report.error().message)};
    const JournalEntry next{RoomSeq{entries.size() + 1}, 0, "next"};
    return {Verdict::Kind::whole, opened->append({&next, 1}) ? "" : "it is whole and takes no entries"};
  }
  if (report && report->sound()) return {Verdict::Kind::named, "verify finds it sound, and it takes no entries"};
  const std::string why = opened->closed_because()->message;
  opened = tl::unexpected(Error{});
  // The reported missing entries are at least the acknowledged ones, and at most those asked for.
  const auto recovered = salvage_journal(file, "/room/recovered", &disk);
  if (!recovered) return {Verdict::Kind::named, ""};
  const std::uint64_t end = recovered->head.seq.value + recovered->lost();
  const bool told = foreign || (end >= life.acknowledged.size() && end <= known.size());
  const bool cannot_tell = std::ranges::any_of(recovered->faults, [](const std::string& fault) {
    return fault.find("cannot be told") != fault.npos || fault.find("is damaged") != fault.npos ||
           fault.find("malformed") != fault.npos || fault.find("does not fit the chain") != fault.npos ||
           fault.find("belongs to another journal") != fault.npos || fault.find("is missing") != fault.npos;
  });
  if (told || cannot_tell) return {Verdict::Kind::named, ""};
  return {Verdict::Kind::named, "it says that " + std::to_string(recovered->lost()) + " entries after " +
                                    std::to_string(recovered->head.seq.value) + " are missing, of " +
                                    std::to_string(life.acknowledged.size()) + ": " + why};
}

void count(const Verdict& verdict, std::uint64_t seed, const std::string& what, DamageTally& tally) {
  ++tally.trials;
  ++tally.done[what];
  tally.whole += verdict.kind == Verdict::Kind::whole && verdict.fault.empty() ? 1 : 0;
  tally.named += verdict.kind == Verdict::Kind::named && verdict.fault.empty() ? 1 : 0;
  tally.refused += verdict.kind == Verdict::Kind::refused && verdict.fault.empty() ? 1 : 0;
  tally.silent += verdict.fault.empty() ? 0 : 1;
  if (!verdict.fault.empty() && tally.faults.size() < kFaultsShown)
    tally.faults.push_back("seed " + std::to_string(seed) + ", " + what + ": " + verdict.fault);
}

}  // namespace

DamageTally damage_trials(std::uint64_t first_seed, std::uint64_t trials, DamagedFiles files) {
  constexpr const char* kFile = "/room/journal";
  DamageTally tally;
  const MemoryDisk::Image other = [&] {
    MemoryDisk disk(first_seed + trials, 512);
    return live(first_seed + trials, disk, 150, false, "another genesis").images.back();
  }();
  for (std::uint64_t seed = first_seed; seed < first_seed + trials; ++seed) {
    Random random(seed * 3 + 1);
    MemoryDisk disk(seed, random() % 2 == 0 ? 512 : 4096);
    const std::uint64_t killed_at = 10 + random() % 300;
    const Life life = live(seed, disk, killed_at, false);
    MemoryDisk::Image image = life.images.back();
    std::erase_if(image, [](const auto& named) { return named.first.ends_with(".partial"); });
    if (!image.contains(kFile)) continue;
    tally.acknowledged += life.acknowledged.size();
    std::string name = std::next(image.begin(), static_cast<std::ptrdiff_t>(random() % image.size()))->first;
    if (files == DamagedFiles::only_log_left) {
      name = std::string(kFile) + "-log";
      image.erase(std::string(kFile) + "-mirror");
      if (!image.contains(name)) continue;
    }
    const std::string what = damage(random, name, life, other, image);
    disk.load(image);
    const bool of_checkpoint = name.ends_with(".checkpoint");
    const std::string end = of_checkpoint ? " checkpoint" : " " + std::filesystem::path(name).filename().string();
    count(judge(kFile, life, disk, what == "another journal's"), seed, what + end, tally);
  }
  return tally;
}

DamageTally kill_trials(std::uint64_t first_seed, std::uint64_t trials, bool power_fails) {
  constexpr const char* kFile = "/room/journal";
  DamageTally tally;
  for (std::uint64_t n = 1; n <= trials; ++n) {
    MemoryDisk disk(first_seed + n, n % 2 == 0 ? 512 : 4096);
    const Life life = live(first_seed + n, disk, 1 + n / 4, power_fails);
    if (!disk.size(kFile).value()) continue;
    tally.acknowledged += life.acknowledged.size();
    const Verdict verdict = judge(kFile, life, disk);
    tally.called_damaged += verdict.kind == Verdict::Kind::whole ? 0 : 1;
    count(verdict, first_seed + n, power_fails ? "power failure" : "kill", tally);
  }
  return tally;
}

}  // namespace osteon::test
