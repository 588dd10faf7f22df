// Appends entries to a journal until it is killed: journal_kill_writer FILE SEED. Prints the sequence number of each
// entry as soon as it is acknowledged. The sequence number determines the entry, so that the test knows what to find.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "server/journal/journal.hpp"
#include "tests/unit/journal/kill_entries.hpp"

int main(int argc, char** argv) {
  using namespace osteon;
  if (argc != 3) return 2;
  const std::filesystem::path file = argv[1];
  std::uint64_t random = std::strtoull(argv[2], nullptr, 10);
  JournalOptions options;
  options.log_bytes = 200 << 10;  // Small, so that the log is often moved into the database.
  auto journal = std::filesystem::exists(file) ? Journal::open(file, options) : Journal::create(file, "bone", options);
  if (!journal || journal->closed_because() != nullptr) {
    std::fprintf(stderr, "%s\n",
                 journal ? journal->closed_because()->message.c_str() : journal.error().message.c_str());
    return 1;
  }
  std::uint64_t seq = journal->head().seq.value;
  for (;;) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    std::vector<JournalEntry> entries;
    for (std::uint64_t i = 0; i <= (random >> 33) % 4; ++i) entries.push_back(kill_entry(++seq));
    if (const auto done = journal->append(entries); !done) {
      std::fprintf(stderr, "%s\n", done.error().message.c_str());
      return 1;
    }
    char line[32];
    const int length = std::snprintf(line, sizeof line, "%llu\n", static_cast<unsigned long long>(seq));
    if (::write(STDOUT_FILENO, line, static_cast<std::size_t>(length)) != length) return 1;
    if ((random >> 40) % 8 == 0) {
      auto checkpoint = journal->begin_checkpoint(journal->head(), "");
      if (!checkpoint || !checkpoint->write("room") || !checkpoint->finish() ||
          !journal->add_checkpoint(std::move(*checkpoint)))
        return 1;
    }
  }
}
