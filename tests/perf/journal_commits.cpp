// osteon-journal-commits FILE ROWS PER_COMMIT: measures how long a journal's commits take, and how many bytes they
// write. Prints JSON. It uses only what every version of the journal has, so that an earlier version can be built with
// it.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#if __has_include("server/journal/signing.hpp")
#include "server/journal/signing.hpp"
#endif

namespace {

// Options as on a server: signed, if this version signs.
osteon::JournalOptions options() {
  osteon::JournalOptions made;
#if __has_include("server/journal/signing.hpp")
  made.keys = std::make_shared<const osteon::SigningKeys>(osteon::SigningKey::make());
#endif
  return made;
}

constexpr std::size_t kEntryBytes = 150;  // of a cut

// Bytes that this process has given to the system to write.
std::uint64_t written_bytes() {
  std::ifstream io("/proc/self/io");
  std::string name;
  std::uint64_t value = 0;
  while (io >> name >> value)
    if (name == "wchar:") return value;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace osteon;
  if (argc != 4) return 2;
  const std::uint64_t entries = std::strtoull(argv[2], nullptr, 10), per_commit = std::strtoull(argv[3], nullptr, 10);
  auto journal = Journal::create(argv[1], "bone", options());
  if (!journal || per_commit == 0) return 1;
  std::mt19937_64 random(1);
  std::vector<double> waits_us;
  const std::uint64_t before = written_bytes();
  for (std::uint64_t place = 1; place + per_commit <= entries + 1; place += per_commit) {
    std::vector<JournalEntry> batch;
    for (std::uint64_t i = 0; i < per_commit; ++i) {
      JournalEntry entry{RoomSeq{place + i}, static_cast<std::int64_t>(place), std::string(kEntryBytes, '\0')};
      for (char& byte : entry.bytes) byte = static_cast<char>(random());
      batch.push_back(std::move(entry));
    }
    const auto begun = std::chrono::steady_clock::now();
    if (!journal->append(batch)) return 1;
    waits_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begun).count());
  }
  const std::uint64_t log = written_bytes() - before;
  if (!journal->close()) return 1;
  const std::uint64_t all = written_bytes() - before;
  std::ranges::sort(waits_us);
  const auto percentile = [&](double share) {
    return waits_us[static_cast<std::size_t>(share * static_cast<double>(waits_us.size() - 1))];
  };
  const auto written = static_cast<double>(waits_us.size() * per_commit);
  std::printf(
      "{\"commits\": %zu, \"p50_us\": %.1f, \"p99_us\": %.1f, \"bytes_per_entry\": %.1f, \"with_close\": %.1f}\n",
      waits_us.size(), percentile(0.5), percentile(0.99), static_cast<double>(log) / written,
      static_cast<double>(all) / written);
  return 0;
}
