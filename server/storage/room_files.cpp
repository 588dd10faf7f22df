#include "server/storage/room_files.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "server/journal/journal_file.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// Endings of files that lie beside a journal or are incomplete journals.
constexpr std::array<std::string_view, 9> kNoJournals{"-wal",    "-log",        "-mirror",  "-owner",  ".lock",
                                                      ".failed", ".checkpoint", ".partial", ".copying"};

Disk& or_system(Disk* disk) { return disk != nullptr ? *disk : system_disk(); }

}  // namespace

tl::unexpected<Error> given_up(const std::string& what) {
  return failure(ErrorCode::cancelled, what + " was given up");
}

Result<std::unique_ptr<DiskLock>> lock_rooms(const fs::path& folder, Disk* disk) {
  const fs::path file = folder / "open-rooms.lock";
  if (const auto made = or_system(disk).open(file); !made) return tl::unexpected(made.error());
  return or_system(disk).lock(file, LockKind::exclusive).map_error([&](Error error) {
    if (error.code == ErrorCode::exists)
      error.message =
          "the folder --rooms " + folder.string() +
          " is another osteon-server's, which runs; end that one first, or give this one a folder of its own";
    return error;
  });
}

Result<RoomGenesis> peek_genesis(const fs::path& file, Disk* disk) {
  const Result<JournalFile> peeked = JournalFile::peek(file, or_system(disk));
  if (!peeked) return tl::unexpected(peeked.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(peeked->genesis());
  if (!genesis) return failure(genesis.error().code, file.string() + ": " + genesis.error().message);
  return genesis;
}

Result<std::string> room_name(Journal& journal) {
  const Result<std::optional<std::string>> renamed = journal.find_register(kNameRegister);
  if (!renamed) return tl::unexpected(renamed.error());
  if (*renamed) return **renamed;
  return genesis_from_bytes(journal.genesis()).map([](const RoomGenesis& genesis) { return genesis.room; });
}

Result<void> check_room_name(Journal& journal, const fs::path& file, const std::string& name) {
  const Result<std::string> own = room_name(journal);
  if (!own) return tl::unexpected(own.error());
  if (*own == name) {
    const Result<bool> vouched = journal.is_vouched_for(kNameRegister);
    if (!vouched) return tl::unexpected(vouched.error());
    if (*vouched) return {};
    return failure(
        ErrorCode::invalid_input,
        file.string() + " was given the name " + name +
            " without this server's signing key; start the server again if its key was changed, or give the name with "
            "the key: osteon-server rename-room " +
            file.string() + " " + name + " --signing-key KEY");
  }
  return failure(ErrorCode::invalid_input,
                 file.string() + " holds the room " + *own + ", not " + name +
                     "; give the file its name again, or rename the room: osteon-server rename-room " + file.string() +
                     " " + name);
}

Result<void> check_whole(const Journal& journal, const std::string& option) {
  const Error* closed = journal.closed_because();
  if (closed == nullptr) return {};
  const std::string last = std::to_string(journal.head().seq.value);
  return failure(closed->code, closed->message + " (its events are confirmed up to " + last +
                                   (journal.head().seq ? ", and " + option + " " + last + " takes these)" : ")"));
}

Result<JournalCopy> begin_branch(Journal& from, const fs::path& to, RoomSeq seq, const std::string& name) {
  Result<RoomGenesis> genesis = genesis_from_bytes(from.genesis());
  if (!genesis) return tl::unexpected(genesis.error());
  const JournalHead& head = from.head();
  if (!seq)
    if (const Result<void> whole = check_whole(from, "--at"); !whole) return tl::unexpected(whole.error());
  if (seq > head.seq)
    return failure(ErrorCode::invalid_input, "a branch at event " + std::to_string(seq.value) +
                                                 " lies beyond the last one of the room " + genesis->room + ", " +
                                                 std::to_string(head.seq.value));
  const Result<JournalHead> at = seq ? from.head_at(seq) : head;
  if (!at) return tl::unexpected(at.error());
  genesis->parent = std::exchange(genesis->room, name);
  genesis->parent_room_seq = at->seq;
  genesis->parent_chain = at->chain;
  // Of its people, only the last number given, so that no number is given twice.
  return JournalCopy::begin_branch(from, to, at->seq, to_bytes(*genesis), {kPeopleRegister});
}

Result<JournalHead> branch_journal(const fs::path& from, const fs::path& to, RoomSeq seq, const std::string& name,
                                   const MaintenanceCalls& calls, Disk* disk) {
  Result<Journal> journal = Journal::open_to_read(from, disk);
  if (!journal) return tl::unexpected(journal.error());
  Result<JournalCopy> copy = begin_branch(*journal, to, seq, name);
  if (!copy) return tl::unexpected(copy.error());
  for (Result<bool> done = false; !*done;) {
    if (calls.stop && calls.stop()) return given_up("the branch " + to.string());
    done = copy->step();
    if (!done) return tl::unexpected(done.error());
    if (calls.progress) calls.progress(copy->fraction());
  }
  return copy->head();
}

Result<std::vector<RoomFile>> branches_of(const fs::path& folder, const fs::path& file, const HasHead& has,
                                          Disk* given) {
  Disk& disk = or_system(given);
  Result<RoomGenesis> first = peek_genesis(file, given);
  if (!first) return tl::unexpected(first.error());
  const auto names = disk.list(folder);
  if (!names) return tl::unexpected(names.error());
  std::vector<RoomFile> others;
  for (const std::string& name : *names) {
    const bool may_be = std::ranges::none_of(kNoJournals, [&](std::string_view end) { return name.ends_with(end); });
    if (!may_be || (folder / name).lexically_normal() == file.lexically_normal()) continue;
    if (Result<RoomGenesis> genesis = peek_genesis(folder / name, given); genesis && !genesis->parent.empty())
      others.push_back({folder / name, std::move(*genesis)});
  }
  // The first is the room itself.
  std::vector<RoomFile> found{{file, std::move(*first)}};
  for (std::size_t at = 0; at < found.size(); ++at) {
    for (RoomFile& other : others) {
      if (other.genesis.parent != found[at].genesis.room) continue;
      const JournalHead from{other.genesis.parent_room_seq, other.genesis.parent_chain};
      const Result<bool> is_branch = has ? has(found[at].file, from) : has_head(found[at].file, from, given);
      if (!is_branch) return tl::unexpected(is_branch.error());
      if (*is_branch) found.push_back(std::move(other));
    }
    std::erase_if(others, [](const RoomFile& other) { return other.file.empty(); });
  }
  found.erase(found.begin());
  return found;
}

Result<std::vector<fs::path>> delete_room(const fs::path& file, bool branches, Disk* disk) {
  std::vector<fs::path> files{file};
  if (branches) {
    const auto found = branches_of(folder_of(file), file, {}, disk);
    if (!found && found.error().code != ErrorCode::not_found) return tl::unexpected(found.error());
    if (found)
      for (const RoomFile& branch : *found) files.push_back(branch.file);
  }
  // The room last. After an interruption, the remaining branches can still be found from it.
  std::ranges::reverse(files);
  if (const Result<void> done = delete_journals(files, disk); !done) return tl::unexpected(done.error());
  return files;
}

}  // namespace osteon
