#include "server/net/room_files.hpp"

#include <utility>

#include "server/journal/journal_file.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

Disk& or_system(Disk* disk) { return disk != nullptr ? *disk : system_disk(); }

}  // namespace

tl::unexpected<Error> given_up(const std::string& what) { return failure(ErrorCode::cancelled, what + " was given up"); }

Result<RoomGenesis> peek_genesis(const fs::path& file, Disk* disk) {
  const Result<std::string> bytes = JournalFile::peek_genesis(file, or_system(disk));
  if (!bytes) return tl::unexpected(bytes.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(*bytes);
  if (!genesis) return failure(genesis.error().code, file.string() + ": " + genesis.error().message);
  return genesis;
}

Result<JournalCopy> begin_branch(Journal& from, const fs::path& to, RoomSeq place, const std::string& name) {
  Result<RoomGenesis> genesis = genesis_from_bytes(from.genesis());
  if (!genesis) return tl::unexpected(genesis.error());
  const JournalHead& head = from.head();
  if (place > head.place)
    return failure(ErrorCode::invalid_input, "a branch at event " + std::to_string(place.value) + " lies beyond the last one of " +
                                                 genesis->room + ", " + std::to_string(head.place.value));
  const Result<JournalHead> at = place ? from.head_at(place) : head;
  if (!at) return tl::unexpected(at.error());
  genesis->parent = std::exchange(genesis->room, name);
  genesis->parent_room_seq = at->place;
  genesis->parent_chain = at->chain;
  // Of its people only how many numbers were given, so that none is given twice.
  return JournalCopy::begin_branch(from, to, at->place, to_bytes(*genesis), {kPeopleRegister});
}

Result<JournalHead> branch_journal(const fs::path& from, const fs::path& to, RoomSeq place, const std::string& name,
                                   const UpkeepCalls& calls, Disk* disk) {
  Result<Journal> journal = Journal::open(from, {.disk = disk});
  if (!journal) return tl::unexpected(journal.error());
  Result<JournalHead> made = [&]() -> Result<JournalHead> {
    Result<JournalCopy> copy = begin_branch(*journal, to, place, name);
    if (!copy) return tl::unexpected(copy.error());
    for (Result<bool> done = false; !*done;) {
      if (calls.stop && calls.stop()) return given_up("the branch " + to.string());
      done = copy->step();
      if (!done) return tl::unexpected(done.error());
      if (calls.progress) calls.progress(copy->fraction());
    }
    return copy->head();
  }();
  const Result<void> closed = journal->close();
  if (made && !closed) return tl::unexpected(closed.error());
  return made;
}

}  // namespace osteon
