// The newest entries of a journal, before its database has them. This is a write-ahead log in two files with the same
// batches of entries, one batch for each append. A batch is durable in both files before its entries are acknowledged,
// so each file shows how far the other must go. What is damaged in one file is read from the other.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/chain.hpp"
#include "server/journal/disk.hpp"
#include "server/journal/signing.hpp"

namespace osteon {

[[nodiscard]] std::filesystem::path log_of(const std::filesystem::path& journal);
[[nodiscard]] std::filesystem::path mirror_of(const std::filesystem::path& journal);

// The state from which the entries of a log continue.
struct LogStart {
  Digest journal;                // the journal it belongs to: the chain of its genesis
  std::uint64_t generation = 0;  // rises by one whenever the log begins anew
  JournalHead base;              // the last entry that the database had then
  // Who signs each batch, and from which entry on. None: nobody does.
  struct Signer {
    PublicKey key;
    RoomSeq since;
  };
  std::optional<Signer> signer = {};
};

// What both files together contain.
struct LogContents {
  std::uint64_t generation = 0;            // the newest generation in either file; 0: neither can be read
  std::vector<JournalEntry> entries;       // those after the head that was asked for
  JournalHead head;                        // of the last of them
  std::optional<SignedEntries> signature;  // of the batch that leads to head; not checked, may be anything
  std::vector<std::pair<std::filesystem::path, JournalHead>> bases;  // where each file starts
  RoomSeq witnessed;                                                 // the furthest entry that either file knows
  // What one file lacks and the other has, or an incomplete write; one sentence each.
  std::vector<std::string> notes;
  std::vector<std::string> foreign;  // files of another journal; one sentence each
  std::vector<std::string> faults;   // why neither can be read; one sentence each
  // A write was cut short in one file. It may have spoiled the batch before it, and the other file does not have that
  // batch.
  bool doubtful = false;
};

// Reads what follows `from`, with the chain of `journal`. Neither file need exist. Errors: those of reading.
[[nodiscard]] Result<LogContents> read_log(const std::filesystem::path& journal, const Digest& identity,
                                           const JournalHead& from, Disk& disk);

// Removes both files.
[[nodiscard]] Result<void> remove_log(const std::filesystem::path& journal, Disk& disk);

// One thread at a time. After an error nothing more may be appended.
class MirroredLog {
 public:
  // Opens both files, or makes them, with space for `capacity` bytes each. So a commit does not change the metadata of
  // the file system. Their content stays until begin_mirror() and begin_log().
  // `durable`: false only for tests in which entries must be lost because no sync is waited for.
  [[nodiscard]] static Result<MirroredLog> open(const std::filesystem::path& journal, std::uint64_t capacity,
                                                Disk& disk, bool durable = true);

  // Begins the next generation, first in the mirror, then in the log. Between the two calls the database records the
  // generation. So at every moment one file has all entries that the database may lack.
  [[nodiscard]] Result<void> begin_mirror(const LogStart& start);
  [[nodiscard]] Result<void> begin_log(const LogStart& start);

  // Appends entries that continue from the last ones. They are durable in both files when it returns. `head`: the head
  // after them. `signature`: given if the generation has a signer. Error internal: a write failed, or a file name no
  // longer refers to the open file.
  [[nodiscard]] Result<void> append(std::span<const JournalEntry> entries, const JournalHead& head,
                                    const std::optional<Signature>& signature = {});

  // Writes zeros behind the entries of both files, because earlier generations may have left data there.
  [[nodiscard]] Result<void> wipe();

  [[nodiscard]] std::uint64_t used_bytes() const;  // size of the entries in one of the files
  [[nodiscard]] bool is_full() const;

 private:
  struct Member {
    std::filesystem::path path;
    std::unique_ptr<DiskFile> file;
    FileIdentity identity;
    std::string salt;
    bool is_signed = false;
    std::uint64_t end = 0;      // end of the entries, bytes
    std::uint64_t written = 0;  // the furthest byte that was ever written
  };
  MirroredLog(std::uint64_t capacity, Disk& disk, bool durable)
      : capacity_(capacity), disk_(&disk), durable_(durable) {}
  [[nodiscard]] Result<void> sync(Member& member) { return durable_ ? member.file->sync() : Result<void>{}; }
  [[nodiscard]] Result<Member> open_member(const std::filesystem::path& path);
  [[nodiscard]] Result<void> check_named(const Member& member);
  [[nodiscard]] Result<void> begin(Member& member, const LogStart& start);

  std::uint64_t capacity_;
  Disk* disk_;
  bool durable_;
  Member log_, mirror_;
};

}  // namespace osteon
