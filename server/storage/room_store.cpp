#include "server/storage/room_store.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "common/field/field_hash.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/journal.pb.h"
#include "server/journal/journal_file.hpp"

namespace osteon {
namespace {

constexpr std::size_t kPieceBytes = 128 * 1024;  // approximate size of a part of a checkpoint

// For the message to a client whose room has fewer events than were acknowledged to it.
constexpr const char* kAcknowledgedEvents = " events that were acknowledged to you";
constexpr const char* kJoinAsItIs = "; start again to join it as it is now";

constexpr std::size_t kSyncBytes = 1024 * 1024;  // a commit waits for at most this much of a checkpoint

std::int32_t computers_day() {
  return static_cast<std::int32_t>(
      std::chrono::duration_cast<std::chrono::days>(std::chrono::system_clock::now().time_since_epoch()).count());
}

// Whether a replay must evaluate the entry.
bool changes_bone(const LogEntry& entry) {
  return std::holds_alternative<CutEntry>(entry.what) || std::holds_alternative<SplitEntry>(entry.what) ||
         std::holds_alternative<UndoEntry>(entry.what) || std::holds_alternative<RedoEntry>(entry.what);
}

// A part of a checkpoint: its length, then a JournalFields.
std::string piece_of(const v1::JournalFields& fields) {
  const std::string bytes = fields.SerializeAsString();
  std::string piece(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) piece[i] = static_cast<char>(bytes.size() >> (8 * i) & 0xff);
  return piece + bytes;
}

std::optional<std::vector<FieldLeaf>> leaves_of(std::string_view bytes) {
  std::vector<FieldLeaf> leaves;
  while (!bytes.empty()) {
    if (bytes.size() < 4) return std::nullopt;
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
    bytes.remove_prefix(4);
    v1::JournalFields fields;
    if (size > bytes.size() || !fields.ParseFromArray(bytes.data(), static_cast<int>(size))) return std::nullopt;
    bytes.remove_prefix(size);
    for (const v1::FieldLeaf& leaf : fields.leaves()) {
      Result<FieldLeaf> one = wire::from_wire(leaf);
      if (!one) return std::nullopt;
      leaves.push_back(std::move(*one));
    }
  }
  return leaves;
}

}  // namespace

void InTurn::lock() {
  expect();
  {
    MutexLock lock(mutex_);
    const std::uint64_t mine = asked_++;
    while (served_ != mine) next_.wait(lock);
  }
  note_taken();
}

void InTurn::unlock() {
  note_released();
  const MutexLock lock(mutex_);
  ++served_;
  next_.notify_all();
}

RoomStore::RoomStore(std::filesystem::path file, Journal journal, RoomGenesis genesis, double pitch_mm, Disk& disk)
    : journal_(std::move(journal)),
      file_(std::move(file)),
      genesis_(std::move(genesis)),
      pitch_mm_(pitch_mm),
      disk_(disk) {}

tl::unexpected<Error> RoomStore::is_closed() const {
  return failure(ErrorCode::unavailable, "the room " + genesis_.room + " is closed; open it again");
}

void RoomStore::note_closing() {
  const Error* why = journal_ ? journal_->closed_because() : nullptr;
  if (why == nullptr || closed_to_entries_ != nullptr) return;
  why_closed_to_entries_ = *why;
  closed_to_entries_ = &*why_closed_to_entries_;
}

Result<PersistedRoom> RoomStore::open(const std::filesystem::path& file, const Case& bone, const Options& options,
                                      const std::function<void(double)>& progress) {
  Result<Journal> journal = Journal::open(file, options.journal);
  bool made = false;
  if (!journal && journal.error().code == ErrorCode::not_found) {
    const std::shared_ptr<ToolBox> tools = options.tools ? options.tools : builtin_tool_box();
    const RoomGenesis genesis = genesis_of(Room(bone, options.limits, tools), options.name);
    journal = Journal::create(file, to_bytes(genesis), options.journal);
    made = true;
  }
  if (!journal) return tl::unexpected(journal.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(journal->genesis());
  if (!genesis) return failure(genesis.error().code, file.string() + ": " + genesis.error().message);
  if (const Result<void> named = check_room_name(*journal, file, options.name); !named) {
    (void)journal->close();
    return tl::unexpected(named.error());
  }
  genesis->room = options.name;  // may have been changed since
  std::unique_ptr<RoomStore> store(
      new RoomStore(file, std::move(*journal), std::move(*genesis), bone.pitch_mm(),
                    options.journal.disk != nullptr ? *options.journal.disk : system_disk()));
  if (Result<void> begun = store->begin(options); !begun) return tl::unexpected(begun.error());
  store->retention_days_ = options.retention_days;
  store->today_ = options.today ? options.today : computers_day;
  if (const auto erased = store->erase_old_people(); !erased)
    log::warn("people whose retention time is over were not erased",
              {{"file", file.string()}, {"reason", erased.error().message}});
  Result<Room> room = store->evaluate(bone, options.limits, progress);
  if (!room) return failure(room.error().code, file.string() + ": " + room.error().message);
  return PersistedRoom{std::move(*room), std::move(store), made};
}

Result<void> RoomStore::begin(const Options& options) {
  const TurnLock in_turn(turn_);
  for (const std::string& note : journal_->notes()) log::warn("journal", {{"file", file_.string()}, {"note", note}});
  if (const Error* closed = journal_->closed_because())
    log::warn("journal takes no entries", {{"file", file_.string()}, {"reason", closed->message}});
  else if (Result<std::uint64_t> epoch = journal_->next_server_epoch(); epoch)
    server_epoch_ = *epoch;
  else
    return tl::unexpected(epoch.error());
  return find_witness_key(options);
}

Result<Room> RoomStore::evaluate(const Case& bone, const CutLimits& limits,
                                 const std::function<void(double)>& progress) {
  const TurnLock in_turn(turn_);
  const Fields fields = newest_fields();
  Result<Room> room = replay(bone, limits, fields, progress);
  if (!room) return room;
  evaluated_ = journal_->head().seq.value - fields.seq.value;
  note_closing();
  return room;
}

RoomStore::Fields RoomStore::newest_fields() {
  const Result<std::vector<Checkpoint>> checkpoints = journal_->checkpoints();
  if (!checkpoints) return {};
  for (const Checkpoint& one : *checkpoints) {
    if (one.at.seq > journal_->head().seq || !journal_->is_vouched_for(one)) continue;
    const Result<std::string> bytes = journal_->read_checkpoint(one);
    if (!bytes) continue;
    if (Result<std::vector<FieldLeaf>> leaves = fields_of(one, *bytes)) return {one.at.seq, std::move(*leaves)};
    log::warn("a checkpoint is passed over", {{"room_seq", one.at.seq.value}});
  }
  return {};
}

Result<std::vector<FieldLeaf>> RoomStore::fields_of(const Checkpoint& one, std::string_view bytes) const {
  std::optional<std::vector<FieldLeaf>> leaves = leaves_of(bytes);
  if (leaves && to_hex(field_hash(*leaves, pitch_mm_)) == one.meta) return std::move(*leaves);
  return failure(ErrorCode::invalid_input, checkpoint_file(file_, one.at).string() +
                                               " does not hold the fields that it says it holds; remove it");
}

Result<Room> RoomStore::replay(const Case& bone, const CutLimits& limits, const Fields& fields,
                               const std::function<void(double)>& progress) {
  Result<Room> room = begin_room(bone, genesis_, limits);
  if (!room) return room;
  const std::uint64_t entries = journal_->head().seq.value;
  Result<void> replayed;
  const auto take = [&](const JournalEntry& one) OSTEON_REQUIRES(turn_) {
    Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    replayed = entry ? room->replay(*entry, one.seq <= fields.seq ? Room::Fields::leave : Room::Fields::evaluate)
                     : Result<void>(tl::unexpected(entry.error()));
    if (replayed && one.seq == fields.seq) replayed = room->set_fields(fields.leaves);
    if (replayed && one.seq > fields.seq && changes_bone(*entry)) changes_.push_back(one.seq);
    if (progress && one.seq.value % 64 == 0)
      progress(static_cast<double>(one.seq.value) / static_cast<double>(entries));
    return replayed.has_value();
  };
  if (Result<void> read = journal_->read(RoomSeq{1}, take); !read) return tl::unexpected(read.error());
  if (!replayed) return tl::unexpected(replayed.error());
  // Nobody has watched this room yet, so its whole surface will be made.
  (void)room->take_changes();
  return room;
}

Result<void> RoomStore::write(std::span<const LogEntry> entries) {
  std::vector<JournalEntry> out;
  out.reserve(entries.size());
  for (const LogEntry& entry : entries) out.push_back({entry.seq, entry.at.count(), to_bytes(entry)});
  return with_journal([&](Journal& journal) OSTEON_REQUIRES(turn_) {
    Result<void> kept = journal.append(out);
    for (const LogEntry& entry : entries)
      if (kept && changes_bone(entry)) changes_.push_back(entry.seq);
    return kept;
  });
}

JournalHead RoomStore::head() const {
  const TurnLock in_turn(turn_);
  return journal_ ? journal_->head() : last_;
}

Result<std::uint32_t> RoomStore::person(const std::string& label) {
  return with_journal([&](Journal& journal) -> Result<std::uint32_t> {
    const Result<std::vector<Person>> people = journal.people();
    if (!people) return tl::unexpected(people.error());
    std::uint32_t newest = 0;
    for (const Person& person : *people) {
      if (person.label == label) return static_cast<std::uint32_t>(std::stoul(person.pseudonym));
      newest = std::max(newest, static_cast<std::uint32_t>(std::stoul(person.pseudonym)));
    }
    // Never gives the number of an erased person again.
    const Result<std::optional<std::string>> given = journal.find_register(kPeopleRegister);
    if (!given) return tl::unexpected(given.error());
    if (*given) newest = std::max(newest, static_cast<std::uint32_t>(std::stoul(**given)));
    const std::string pseudonym = std::to_string(newest + 1);
    const Result<void> set = journal.set_beside({{kPeopleRegister, pseudonym}}, {{pseudonym, label, today_()}});
    if (!set) return tl::unexpected(set.error());
    return newest + 1;
  });
}

Result<void> RoomStore::find_witness_key(const Options& options) {
  Result<std::optional<std::string>> known = journal_->find_register(kWitnessRegister);
  if (known && *known) {
    witness_key_ = std::move(**known);
    return {};
  }
  std::array<std::uint8_t, 32> key{};
  (options.random ? options.random : system_random())(key);
  witness_key_.assign(key.begin(), key.end());
  return journal_->closed_because() ? Result<void>{} : journal_->set_register(kWitnessRegister, witness_key_);
}

Digest RoomStore::seal_of(const JournalHead& head) const {
  Hasher hasher;
  hasher.text("osteon witness");
  hasher.text(witness_key_);
  hasher.integer(head.seq.value);
  hasher.bytes(std::as_bytes(std::span(head.chain.bytes)));
  return hasher.finish();
}

Witness RoomStore::witness() const {
  const JournalHead at = head();
  return {at, seal_of(at)};
}

Result<void> RoomStore::check_witness(const Witness& witness) {
  const std::string room = "the room " + genesis_.room;
  const std::string events = std::to_string(witness.head.seq.value) + kAcknowledgedEvents;
  const bool sealed = witness.seal == seal_of(witness.head), without_seal = witness.seal == Digest{};
  const auto lost_after = [&](RoomSeq seq) {
    return room + " has lost " + std::to_string(witness.head.seq.value - seq.value) + " of the " + events;
  };
  // Another journal has another key.
  const auto begins_anew = [&] {
    return failure(ErrorCode::invalid_input, room + " begins anew: its journal has none of the " + events +
                                                 kJoinAsItIs + ", or have the lost journal put back first");
  };
  return with_journal([&](Journal& journal) -> Result<void> {
    const RoomSeq head = journal.head().seq;
    const std::optional<RoomSeq> recovered = journal.recovered_to();
    const auto after_recovery = [&](ErrorCode code) {
      return failure(code, lost_after(*recovered) + ": its journal was salvaged up to event " +
                               std::to_string(recovered->value) + kJoinAsItIs);
    };
    const bool beyond = witness.head.seq > head;
    // The key may be among what was lost.
    if (beyond && !sealed && recovered) return after_recovery(ErrorCode::invalid_input);
    if (beyond && without_seal)
      return failure(ErrorCode::invalid_input,
                     room + " has " + std::to_string(head.value) + " events, and you name event " +
                         std::to_string(witness.head.seq.value) + " without the room's seal" + kJoinAsItIs);
    if (beyond && !sealed) return begins_anew();
    Result<void> checked = journal.check_witness(witness.head);
    if (checked) return checked;
    if (beyond && recovered) return after_recovery(checked.error().code);
    if (beyond)
      return failure(checked.error().code,
                     lost_after(head) + ", and takes no more cuts: salvage its journal, then start again");
    // If a journal is closed to entries, it is unknown whether its file is as it was written.
    const Result<JournalHead> here = journal.head_at(witness.head.seq);
    const bool another_history = here && here->chain != witness.head.chain && journal.closed_because() == nullptr;
    if (!another_history) return checked;
    if (recovered && *recovered < witness.head.seq) return after_recovery(checked.error().code);
    if (without_seal) return checked;
    if (!sealed) return begins_anew();
    return failure(checked.error().code, room + " has lost some of the " + events +
                                             ": an older copy of its journal has gone on" + kJoinAsItIs);
  });
}

std::chrono::nanoseconds reopened_time(const Room& room) {
  return room.room_seq() ? room.time() + kTimeAway : room.time();
}

Result<void> RoomStore::checkpoint(RoomSeq seq, std::span<const FieldLeaf> leaves, const MaintenanceCalls& calls) {
  const MutexLock one_at_a_time(checkpointing_);
  const auto needed = with_journal([&](Journal& journal) -> Result<std::optional<JournalHead>> {
    if (!seq || seq > journal.head().seq) return std::nullopt;
    const auto known = journal.checkpoints();
    if (known && !known->empty() && known->front().at.seq >= seq) return std::nullopt;
    return journal.head_at(seq);
  });
  if (!needed) return tl::unexpected(needed.error());
  if (!*needed) return {};
  const std::string meta = to_hex(field_hash({leaves.begin(), leaves.end()}, pitch_mm_));
  Result<CheckpointFile> file =
      with_journal([&](Journal& journal) { return journal.begin_checkpoint(**needed, meta); });
  if (!file) return tl::unexpected(file.error());
  for (std::size_t next = 0, unsynced = 0; next < leaves.size();) {
    if (closing_ || (calls.stop && calls.stop()))
      return given_up("the checkpoint at event " + std::to_string(seq.value));
    v1::JournalFields fields;
    for (std::size_t size = 0; next < leaves.size() && size < kPieceBytes; ++next) {
      *fields.add_leaves() = wire::to_wire(leaves[next]);
      size += fields.leaves(fields.leaves_size() - 1).values().size() + 24;
    }
    const std::string piece = piece_of(fields);
    if (Result<void> written = file->write(piece); !written) return written;
    unsynced += piece.size();
    if (unsynced >= kSyncBytes) {
      if (Result<void> synced = file->sync(); !synced) return synced;
      unsynced = 0;
    }
    if (calls.progress) calls.progress(static_cast<double>(next) / static_cast<double>(leaves.size()));
  }
  if (Result<void> finished = file->finish(); !finished) return finished;
  return with_journal([&](Journal& journal) OSTEON_REQUIRES(turn_) {
    Result<void> added = journal.add_checkpoint(std::move(*file));
    if (added) std::erase_if(changes_, [&](RoomSeq change) { return change <= seq; });
    return added;
  });
}

std::uint64_t RoomStore::changes_since_checkpoint() const {
  const TurnLock in_turn(turn_);
  return changes_.size();
}

Result<void> RoomStore::close() {
  closing_ = true;
  const MutexLock no_checkpoint(checkpointing_);
  return with_journal([&](Journal& journal) OSTEON_REQUIRES(turn_) {
    last_ = journal.head();
    Result<void> done = journal.close();
    journal_.reset();
    return done;
  });
}

}  // namespace osteon
