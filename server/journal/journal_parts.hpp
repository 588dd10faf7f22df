// What a journal stores besides its log entries.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "server/journal/chain.hpp"
#include "server/journal/disk.hpp"
#include "server/journal/signing.hpp"

namespace osteon {

// A slice of the log that is read at once ends after this size.
inline constexpr std::size_t kSliceBytes = std::size_t{1} << 20;

struct JournalOptions {
  Disk* disk = nullptr;  // null: the computer's; must outlive the journal
  std::size_t most_entry_bytes = std::size_t{64} << 20;
  std::uint64_t log_bytes = std::uint64_t{1} << 20;   // of each log file; what exceeds it goes into the database
  int page_bytes = 4096;                              // of a new journal; not smaller than the disk's sectors
  bool durable = true;                                // false, for tests only: waits for no sync
  std::shared_ptr<const SigningKeys> keys = nullptr;  // they sign what is written; null: nothing is signed
};

// The room at one sequence number, in a file of its own. Its content is opaque to the journal.
struct Checkpoint {
  JournalHead at;
  std::string meta;  // a few words of the owner's
  std::uint64_t size = 0;
  Digest digest;          // SHA-256 of the file's bytes
  std::string seal = {};  // of the four above; empty: made when the checkpoint is added
};

// The person behind a pseudonym in the log entries. It is not part of the chain, so that a person can be erased and the
// entries still be confirmed.
struct Person {
  std::string pseudonym;
  std::string label;
  std::int32_t joined_day = 0;  // since 1970-01-01
  friend bool operator==(const Person&, const Person&) = default;
};

}  // namespace osteon
