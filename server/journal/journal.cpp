#include "server/journal/journal.hpp"

#include <algorithm>
#include <utility>

#include "common/core/check.hpp"
#include "server/journal/journal_state.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kCheckpointsKept = 2;
constexpr std::uint64_t kTidyBytes = std::uint64_t{64} << 10;

fs::path with(const fs::path& file, std::string_view end) { return file.string() + std::string(end); }

// After a failed sync the system may show bytes that are not on the disk, and a later sync may not write them either.
// So what a process that died left in SQLite's log is written again before it counts. It goes into a new file, because
// a torn write over the log could spoil what the database has only half copied.
Result<void> renew_wal(Disk& disk, const fs::path& wal) {
  const auto size = disk.size(wal);
  if (!size) return tl::unexpected(size.error());
  if (size->value_or(0) == 0) return {};
  auto renewed = DurableFile::begin(disk, wal);
  if (!renewed) return tl::unexpected(renewed.error());
  const auto copied = read_in_pieces(disk, wal, [&](std::string_view piece) { return renewed->write(piece); });
  if (!copied) return tl::unexpected(copied.error());
  return renewed->finish().map([](const WrittenFile&) {});
}

// Removes what a process that died was about to write: half a checkpoint, or one that was never recorded or was
// dropped.
Result<void> remove_stale_files(Disk& disk, const fs::path& file, const std::vector<Checkpoint>& kept) {
  const auto names = disk.list(folder_of(file));
  if (!names) return tl::unexpected(names.error());
  for (const std::string& name : *names) {
    const auto at = parse_checkpoint_file(file, name);
    const bool noted = at && std::any_of(kept.begin(), kept.end(), [&](const Checkpoint& c) { return c.at == *at; });
    if (!(at && !noted) && !is_partial_of(file, name)) continue;
    if (Result<void> removed = disk.remove(folder_of(file) / name); !removed) return removed;
  }
  return {};
}

}  // namespace

Disk& disk_of(const JournalOptions& options) { return options.disk != nullptr ? *options.disk : system_disk(); }

Result<std::unique_ptr<DiskLock>> take_lock(Disk& disk, const fs::path& file, LockKind kind) {
  return disk.lock(file, kind).map_error([&](Error error) {
    if (error.code == ErrorCode::exists)
      error.message = file.string() + " is in use by another process; close the room there first";
    return error;
  });
}

Result<void> check_nothing_left(Disk& disk, const fs::path& file) {
  const auto names = disk.list(folder_of(file));
  if (!names) return tl::unexpected(names.error());
  if (std::ranges::find(*names, file.filename().string()) != names->end())
    return failure(ErrorCode::exists, "there is " + file.string() + " already; give the new journal another name");
  for (const std::string& name : *names) {
    const fs::path other = folder_of(file) / name;
    if (name == log_of(file).filename() || name == mirror_of(file).filename() || name == wal_of(file).filename() ||
        name == failed_of(file).filename() || parse_checkpoint_file(file, name))
      return failure(ErrorCode::exists, other.string() + " belonged to an earlier journal " + file.string() +
                                            "; move it away, or give the new one another name");
  }
  return {};
}

Result<void> CheckpointFile::finish() {
  const auto written = file_.finish();
  if (!written) return tl::unexpected(written.error());
  about_.size = written->size;
  about_.digest = written->digest;
  finished_ = true;
  return {};
}

Journal::Journal(std::unique_ptr<State> state) : state_(std::move(state)) {}
Journal::Journal(Journal&&) noexcept = default;
Journal& Journal::operator=(Journal&&) noexcept = default;
Journal::~Journal() = default;

// The journal is made under another name, so that it exists whole or not at all. The lock belongs to the file itself
// and stays when the file is renamed.
Result<Journal> Journal::create(const fs::path& file, std::string_view genesis, const JournalOptions& options) {
  Disk& disk = disk_of(options);
  if (Result<void> clear = check_nothing_left(disk, file); !clear) return tl::unexpected(clear.error());
  const fs::path partial = with(file, kPartial);
  if (const auto there = disk.open(partial); !there) return tl::unexpected(there.error());
  auto lock = take_lock(disk, partial, LockKind::exclusive);
  if (!lock) return tl::unexpected(lock.error());
  const auto remove_partial = [&] {
    return disk.remove(partial).and_then([&] { return disk.remove(wal_of(partial)); });
  };
  const DatabaseOptions as_made{.create = true, .durable = options.durable, .page_bytes = options.page_bytes};
  const Result<void> made = check_nothing_left(disk, file)  // again: another process may have made one since
                                .and_then([&] { return disk.create(partial).map([](const auto&) {}); })
                                .and_then([&] { return disk.remove(wal_of(partial)); })
                                .and_then([&] { return JournalFile::make(partial, genesis, disk, as_made); })
                                .and_then([&] { return disk.remove(wal_of(partial)); })
                                .and_then([&] { return disk.rename(partial, file); })
                                .and_then([&] { return disk.sync_folder(folder_of(file)); });
  if (!made) {
    static_cast<void>(remove_partial());
    return tl::unexpected(made.error());
  }
  return open_locked(file, options, std::move(*lock));
}

Result<Journal> Journal::open(const fs::path& file, const JournalOptions& options) {
  Disk& disk = disk_of(options);
  if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
  auto lock = take_lock(disk, file, LockKind::exclusive);
  if (!lock) return tl::unexpected(lock.error());
  return open_locked(file, options, std::move(*lock));
}

Result<Journal> Journal::open_to_read(const fs::path& file, Disk* given) {
  const JournalOptions options{.disk = given};
  Disk& disk = disk_of(options);
  if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
  auto lock = take_lock(disk, file, LockKind::shared);
  if (!lock) return tl::unexpected(lock.error());
  auto opened = JournalFile::open_to_read(file, disk);
  if (!opened) return tl::unexpected(opened.error());
  Journal journal(std::unique_ptr<State>(new State{file, options, &disk, std::move(*lock), std::move(*opened), {}}));
  State& state = *journal.state_;
  state.only_read = true;
  Inspection found = state.file.inspect(false);
  state.head = found.head;
  state.notes = std::move(found.notes);
  if (!found.faults.empty()) state.closed = Error{ErrorCode::unavailable, found.faults.front()};
  return journal;
}

Result<Journal> Journal::open_locked(const fs::path& file, const JournalOptions& options,
                                     std::unique_ptr<DiskLock> lock) {
  Disk& disk = disk_of(options);
  if (Result<void> renewed = renew_wal(disk, wal_of(file)); !renewed) return tl::unexpected(renewed.error());
  auto opened = JournalFile::open(file, disk, {.durable = options.durable});
  if (!opened) return tl::unexpected(opened.error());
  if (opened->version() < kVersionWithTimes)
    return failure(ErrorCode::unsupported,
                   file.string() + " is a journal of version " + std::to_string(opened->version()) +
                       "; migrate it into a copy of version " + std::to_string(kJournalVersion));
  const auto identity = disk.identity(file);
  if (!identity) return tl::unexpected(identity.error());
  if (!*identity) return failure(ErrorCode::not_found, file.string() + " was removed while it was opened");
  Journal journal(
      std::unique_ptr<State>(new State{file, options, &disk, std::move(lock), std::move(*opened), **identity}));
  State& state = *journal.state_;
  Inspection found = state.file.inspect(false);
  state.head = found.head;
  state.notes = std::move(found.notes);
  if (!found.faults.empty()) {
    state.closed = Error{ErrorCode::unavailable, found.faults.front()};
    return journal;
  }
  const auto recovered = state.file.find_register(kRecoveredRegister);
  if (!recovered) return tl::unexpected(recovered.error());
  if (*recovered) state.recovered_to = RoomSeq{decode_number(**recovered).value_or(0)};

  if (const Result<void> signing = journal.begin_signing(); !signing) {
    if (signing.error().code != ErrorCode::unavailable) return tl::unexpected(signing.error());
    state.closed = signing.error();
    return journal;
  }
  const auto kept = state.file.checkpoints();
  if (!kept) return tl::unexpected(kept.error());
  if (Result<void> cleared = remove_stale_files(disk, file, *kept); !cleared) return tl::unexpected(cleared.error());
  if (Result<void> begun = journal.begin_log(); !begun) return tl::unexpected(begun.error());
  return journal;
}

// First the database durably gets everything in the old log files, because a sync of these files may have failed in a
// process that died. Then a new generation begins.
Result<void> Journal::begin_log() {
  State& state = *state_;
  if (Result<void> kept = state.file.keep_log(); !kept) return kept;
  state.identity.size = 0;  // SQLite may have cut off what did not belong to it
  auto log = MirroredLog::open(state.path, state.options.log_bytes, *state.disk, state.options.durable);
  if (!log) return tl::unexpected(log.error());
  state.log = std::move(*log);
  state.generation = state.file.generation();
  return note_keys().and_then([&] { return carry(); });
}

// Whoever has a later or an earlier key of the same server finds here that the keys belong together.
Result<void> Journal::note_keys() {
  State& state = *state_;
  if (!state.options.keys) return {};
  const auto stored = state.file.find_register(kKeysRegister);
  if (!stored) return tl::unexpected(stored.error());
  std::vector<Succession> all =
      *stored ? decode_successions(**stored).value_or(std::vector<Succession>{}) : std::vector<Succession>{};
  const std::size_t known = all.size();
  for (const Succession& one : state.options.keys->successions())
    if (std::ranges::find(all, one) == all.end()) all.push_back(one);
  return all.size() == known ? Result<void>{} : state.file.set_register(kKeysRegister, encode_successions(all));
}

Result<void> Journal::begin_signing() {
  State& state = *state_;
  const SigningKeys* keys = state.options.keys.get();
  if (keys == nullptr) return {};
  state.file.sign_with(&keys->key());
  const auto all = state.file.signed_entries();
  if (!all) return tl::unexpected(all.error());
  const auto last =
      std::find_if(all->rbegin(), all->rend(), [&](const SignedEntries& one) { return keys->trusts(one.key); });
  const RoomSeq head = state.head.seq;
  const bool any = last != all->rend();
  const Result<bool> erased = is_vouched_for(kErasedRegister);
  if (!erased) return tl::unexpected(erased.error());
  if (any && !*erased)
    return failure(
        ErrorCode::unavailable,
        state.path.string() + ": somebody without this server's key has replaced entries of it; go on from a backup");
  if (any && last->head.seq == head) {
    state.signed_since = last->since;
    return {};
  }
  state.signed_since = RoomSeq{head.value + 1};
  if (head.value == 0) return {};
  const RoomSeq signed_to = any ? last->head.seq : RoomSeq{};
  const std::string entries = "entries " + std::to_string(signed_to.value + 1) + " to " + std::to_string(head.value);
  // A person who had the key salvaged the journal and thereby accepted these entries.
  const Result<bool> accepted = is_vouched_for(kRecoveredRegister);
  if (!accepted) return tl::unexpected(accepted.error());
  if (any && (!*accepted || head > state.recovered_to.value_or(RoomSeq{})))
    return failure(
        ErrorCode::unavailable,
        state.path.string() + ": this server's key signed the entries up to " + std::to_string(signed_to.value) +
            ", but not " + entries +
            ": somebody else wrote them; salvage the signed ones into a new journal: osteon-server salvage " +
            state.path.string() + " NEW --to " + std::to_string(signed_to.value) + " --signing-key KEY");
  state.notes.push_back(entries + " were not signed by this server's key, which signs those after them");
  return {};
}

Result<bool> Journal::is_vouched_for(std::string_view name) {
  const SigningKeys* keys = state_->options.keys.get();
  if (keys == nullptr) return true;
  const auto found = state_->file.find_sealed(name);
  if (!found) return tl::unexpected(found.error());
  if (!*found) return true;
  const auto signer = state_->file.signer_of(**found);
  return signer && keys->trusts(*signer);
}

bool Journal::is_signed() const { return state_->options.keys != nullptr; }

bool Journal::is_vouched_for(const Checkpoint& checkpoint) const {
  const SigningKeys* keys = state_->options.keys.get();
  const auto signer = state_->file.signer_of(checkpoint);
  return keys == nullptr || (signer && keys->trusts(*signer));
}

Result<void> Journal::keep_signature() {
  State& state = *state_;
  return state.last_signature ? state.file.add_signed_entries(*state.last_signature) : Result<void>{};
}

// At every moment either the database or one of the log files has each entry: see MirroredLog::begin_mirror().
Result<void> Journal::carry() {
  State& state = *state_;
  Database& database = state.file.database();
  LogStart start{state.file.identity(), state.generation + 1, state.head};
  if (state.signed_since) start.signer = {state.options.keys->key().public_key(), *state.signed_since};
  return keep_signature()
      .and_then([&] { return database.commit(); })
      .and_then([&] { return state.log->begin_mirror(start); })
      .and_then([&] { return database.begin(); })
      .and_then([&] { return state.file.note_generation(start); })
      .and_then([&] { return database.commit(); })
      .and_then([&] { return database.carry_log(); })
      .and_then([&] { return state.log->begin_log(start); })
      .and_then([&] { return database.begin(); })
      .and_then([&] { return state.disk->identity(state.path); })
      .and_then([&](const std::optional<FileIdentity>& now) -> Result<void> {
        if (now && now->same_file(state.identity)) state.identity = *now;  // at least the present size
        state.generation = start.generation;
        state.last_signature.reset();
        return {};
      });
}

const Error* Journal::closed_because() const { return state_->closed ? &*state_->closed : nullptr; }

void Journal::close_to_entries(Error reason) {
  if (!state_->closed) state_->closed = std::move(reason);
}

const JournalHead& Journal::head() const { return state_->head; }
const std::string& Journal::genesis() const { return state_->file.genesis(); }
std::optional<RoomSeq> Journal::recovered_to() const { return state_->recovered_to; }

// All changes go through here, and none is made after the first that fails. It is then unknown whether that change
// reached the disk, and what the system shows of the file cannot be trusted. So a note beside the file stops the next
// process from continuing, too.
Result<void> Journal::write(const std::function<Result<void>()>& work) {
  State& state = *state_;
  if (state.closed) return tl::unexpected(*state.closed);
  if (state.only_read) return failure(ErrorCode::unavailable, state.path.string() + " was opened only to be read");
  Result<void> done = check_named();
  if (done) done = work();
  if (done) return done;
  close_for_good({ErrorCode::unavailable,
                  state.path.string() + " takes no more entries because a write to it failed: " + done.error().message +
                      "; salvage it into a new journal"});
  return tl::unexpected(*state.closed);
}

// If somebody replaced or removed the open file, the entries would be written to a file that nobody finds.
Result<void> Journal::check_named() {
  State& state = *state_;
  const auto now = state.disk->identity(state.path);
  if (!now) return tl::unexpected(now.error());
  if (*now && (*now)->same_file(state.identity) && (*now)->size >= state.identity.size) return {};
  return failure(ErrorCode::internal,
                 std::string("the file was ") + (*now ? "replaced or cut" : "removed") + " while its room was open");
}

Result<void> Journal::write_through(const std::function<Result<void>()>& work) {
  return write([&] { return work().and_then([&] { return carry(); }); });
}

const std::vector<std::string>& Journal::notes() const { return state_->notes; }

void Journal::close_for_good(Error reason) {
  State& state = *state_;
  close_to_entries(std::move(reason));
  if (auto note = DurableFile::begin(*state.disk, failed_of(state.path)); note && note->write(state.closed->message))
    static_cast<void>(note->finish());  // best effort: the disk may accept no data at all
}

Result<void> Journal::append(std::span<const JournalEntry> entries) {
  State& state = *state_;
  if (state.closed) return tl::unexpected(*state.closed);
  for (const JournalEntry& entry : entries)
    if (entry.bytes.size() > state.options.most_entry_bytes)
      return failure(ErrorCode::invalid_input,
                     state.path.string() + ": entry " + std::to_string(entry.seq.value) + " has " +
                         std::to_string(entry.bytes.size()) + " bytes, more than the " +
                         std::to_string(state.options.most_entry_bytes) + " that an entry may have");
  if (entries.empty()) return {};
  JournalHead head = state.head;
  // Adds them to the transaction, which is in memory, and to the log, which makes them durable.
  Result<void> done = write([&] {
    return state.file.add_entries(entries, head).and_then([&] {
      std::optional<Signature> signature;
      if (state.signed_since) {
        state.last_signature = sign_entries(state.options.keys->key(), *state.signed_since, head);
        signature = state.last_signature->signature;
      }
      return state.log->append(entries, head, signature);
    });
  });
  if (!done) return done;
  state.head = head;
  // The entries are already durable, so an error here does not matter to the caller.
  if (state.log->is_full()) static_cast<void>(write([&] { return carry(); }));
  return {};
}

Result<void> Journal::read(RoomSeq from, const std::function<bool(const JournalEntry&)>& take) {
  State& state = *state_;
  OSTEON_CHECK(from.value >= 1);
  if (from > state.head.seq) return {};
  const RoomSeq before{from.value - 1};
  const auto chain = state.file.chain_at(before);
  if (!chain) return tl::unexpected(chain.error());
  const Walk walked = state.file.walk({before, chain->value_or(Digest{})}, state.head.seq,
                                      [&](const JournalEntry& entry, const JournalHead&) { return take(entry); });
  if (walked.stopped) return tl::unexpected(*walked.stopped);
  return {};
}

Result<JournalHead> Journal::head_at(RoomSeq seq) {
  const auto chain = state_->file.chain_at(seq);
  if (!chain) return tl::unexpected(chain.error());
  if (*chain) return JournalHead{seq, **chain};
  return failure(ErrorCode::invalid_input, state_->path.string() + " has no entry " + std::to_string(seq.value) +
                                               ", its last is " + std::to_string(state_->head.seq.value));
}

JournalSlice Journal::read_slice(const JournalHead& after, RoomSeq last, std::size_t most_entries) {
  JournalSlice slice;
  std::size_t bytes = 0;
  Walk walked =
      state_->file.walk(after, std::min(last, state_->head.seq), [&](const JournalEntry& entry, const JournalHead&) {
        slice.entries.push_back(entry);
        bytes += entry.bytes.size();
        return slice.entries.size() < most_entries && bytes < kSliceBytes;
      });
  slice.head = walked.head;
  slice.stopped = std::move(walked.stopped);
  return slice;
}

Result<void> Journal::check_witness(const JournalHead& witness) {
  State& state = *state_;
  const std::string seq = std::to_string(witness.seq.value), file = state.path.string();
  if (witness.seq > state.head.seq && state.recovered_to)
    return failure(ErrorCode::unavailable, file + " was salvaged up to event " +
                                               std::to_string(state.recovered_to->value) +
                                               ", and a client knows event " + seq +
                                               ": what it knows beyond that is lost; it has to join again");
  if (witness.seq > state.head.seq) {
    // The note also closes the journal for the next process, because the witness may never come back to report this.
    close_for_good({ErrorCode::unavailable,
                    file + " goes to event " + std::to_string(state.head.seq.value) +
                        ", but a client was told that event " + seq +
                        " is durable: entries were lost; salvage it into a new journal, or go on from a backup"});
    return tl::unexpected(*state.closed);
  }
  const auto chain = state.file.chain_at(witness.seq);
  if (chain && *chain == witness.chain) return {};
  // After a failed write, what the system shows of the file says nothing about the client.
  if (state.closed) return tl::unexpected(*state.closed);
  if (!chain) return tl::unexpected(chain.error());
  return failure(ErrorCode::invalid_input,
                 file + " and a client know different histories up to event " + seq + "; it has to join again");
}

Result<CheckpointFile> Journal::begin_checkpoint(const JournalHead& at, std::string_view meta, std::string_view seal) {
  State& state = *state_;
  if (state.closed) return tl::unexpected(*state.closed);
  const auto chain = state.file.chain_at(at.seq);
  if (!chain) return tl::unexpected(chain.error());
  if (at.seq > state.head.seq || *chain != at.chain)
    return failure(ErrorCode::invalid_input, state.path.string() + ": a checkpoint at event " +
                                                 std::to_string(at.seq.value) +
                                                 " is of another history than the journal's");
  const auto all = checkpoints();
  if (!all) return tl::unexpected(all.error());
  if (std::any_of(all->begin(), all->end(), [&](const Checkpoint& c) { return c.at == at; }))
    return failure(ErrorCode::exists,
                   state.path.string() + " has a checkpoint at event " + std::to_string(at.seq.value));
  auto file = DurableFile::begin(*state.disk, checkpoint_file(state.path, at));
  if (!file) return tl::unexpected(file.error());
  return CheckpointFile({at, std::string(meta), 0, {}, std::string(seal)}, std::move(*file));
}

Result<void> Journal::add_checkpoint(CheckpointFile file) {
  State& state = *state_;
  OSTEON_CHECK(file.finished_);
  auto all = checkpoints();
  if (!all) return tl::unexpected(all.error());
  all->push_back(file.about_);
  std::sort(all->begin(), all->end(), [](const Checkpoint& a, const Checkpoint& b) { return a.at.seq > b.at.seq; });
  const auto kept = static_cast<std::ptrdiff_t>(std::min(kCheckpointsKept, all->size()));
  const std::vector<Checkpoint> old(all->begin() + kept, all->end());
  Result<void> noted = write_through([&] {
    Result<void> done = state.file.add_checkpoint(file.about_);
    for (const Checkpoint& checkpoint : old)
      if (done)
        done = state.file.database().run("DELETE FROM checkpoints WHERE place = " +
                                         std::to_string(checkpoint.at.seq.value));
    return done;
  });
  if (!noted) return noted;
  // A file that cannot be removed now is removed when the journal is opened next.
  for (const Checkpoint& checkpoint : old)
    static_cast<void>(state.disk->remove(checkpoint_file(state.path, checkpoint.at)));
  return {};
}

Result<std::vector<Checkpoint>> Journal::checkpoints() { return state_->file.checkpoints(); }

Result<std::string> Journal::read_checkpoint(const Checkpoint& checkpoint) {
  const fs::path file = checkpoint_file(state_->path, checkpoint.at);
  std::string bytes;
  const auto read = read_in_pieces(*state_->disk, file, [&](std::string_view piece) {
    bytes += piece;
    return Result<void>{};
  });
  if (!read) return tl::unexpected(read.error());
  if (read->size == checkpoint.size && read->digest == checkpoint.digest) return bytes;
  return failure(ErrorCode::invalid_input,
                 file.string() + " is not what was written; take the checkpoint before it, or all entries");
}

Result<void> Journal::set_register(std::string_view name, std::string_view value) {
  return set_beside({{std::string(name), std::string(value)}}, {});
}

Result<void> Journal::set_beside(const Registers& registers, const std::vector<Person>& people) {
  return write_through([&] {
    Result<void> done;
    for (const auto& [name, value] : registers) {
      OSTEON_CHECK(name != kGenesisRegister && name != kFooterRegister && name != kGenerationRegister &&
                   name != kIdRegister && name != kKeysRegister && name != kErasedRegister);
      if (done) done = state_->file.set_register(name, value);
    }
    for (const Person& person : people)
      if (done) done = state_->file.add_person(person);
    return done;
  });
}

Result<std::optional<std::string>> Journal::find_register(std::string_view name) {
  return state_->file.find_register(name);
}

Result<std::uint64_t> Journal::next_server_epoch() {
  const auto known = find_register(kEpochRegister);
  if (!known) return tl::unexpected(known.error());
  const std::uint64_t next = (*known ? decode_number(**known).value_or(0) : 0) + 1;
  return set_register(kEpochRegister, encode_number(next)).map([&] { return next; });
}

Result<void> Journal::set_person(const Person& person) { return set_beside({}, {person}); }

Result<std::vector<Person>> Journal::people() { return state_->file.people(); }

// A deleted row is overwritten, but a copy may remain where the tree once moved the row to another page. So the whole
// table is emptied, which overwrites every page that it ever had, and the remaining people are written again. SQLite's
// log contains the old pages. It is truncated whenever the journal's log is copied into the database.
Result<std::size_t> Journal::keep_people(const std::function<bool(const Person&)>& kept) {
  const auto all = people();
  if (!all) return tl::unexpected(all.error());
  const auto staying = static_cast<std::size_t>(std::count_if(all->begin(), all->end(), kept));
  if (staying == all->size()) return 0;
  Database& database = state_->file.database();
  const Result<void> done = write_through([&]() -> Result<void> {
    if (Result<void> emptied = database.run("DELETE FROM people"); !emptied) return emptied;
    for (const Person& person : *all)
      if (kept(person))
        if (Result<void> put = state_->file.add_person(person); !put) return put;
    return {};
  });
  if (!done) return tl::unexpected(done.error());
  return all->size() - staying;
}

Result<std::size_t> Journal::erase_person(std::string_view pseudonym) {
  return keep_people([&](const Person& person) { return person.pseudonym != pseudonym; });
}

Result<std::size_t> Journal::erase_people_before(std::int32_t day) {
  return keep_people([&](const Person& person) { return person.joined_day >= day; });
}

Result<std::size_t> Journal::erase_people_if(const std::function<bool(const Person&)>& whom) {
  return keep_people([&](const Person& person) { return !whom(person); });
}

Result<void> Journal::tidy() {
  if (state_->closed || !state_->log || state_->log->used_bytes() < std::min(kTidyBytes, state_->options.log_bytes))
    return {};
  return write([&] { return carry(); });
}

Result<void> Journal::close() {
  State& state = *state_;
  const auto lock = std::move(state.lock);  // held to the end
  Disk& disk = *state.disk;
  const fs::path path = state.path;
  Result<void> done;
  const bool vouched = !state.closed && !state.only_read;
  if (vouched) {
    Database& database = state.file.database();
    done = write([&] {
      return keep_signature()
          .and_then([&] {
            return state.file.set_register(kFooterRegister, encode_footer({state.head, true}));
          })
          .and_then([&] { return database.commit(); })
          .and_then([&] { return database.carry_log(); });
    });
  }
  state_.reset();
  if (vouched && done) {
    static_cast<void>(disk.remove(wal_of(path)));  // it is empty
    static_cast<void>(remove_log(path, disk));     // no longer needed, as the footer says
  }
  return done;
}

}  // namespace osteon
