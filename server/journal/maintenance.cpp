#include "server/journal/maintenance.hpp"

#include <algorithm>
#include <utility>

#include "common/core/check.hpp"
#include "server/journal/journal_state.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// More openings than the lost part of any journal can have counted.
constexpr std::uint64_t kEpochsSkipped = 1'000'000;

constexpr std::string_view kLock = ".lock";  // of earlier versions

// Name of an unfinished copy.
fs::path growing_copy(const fs::path& to) { return to.string() + ".copying"; }

// A journal that is opened for reading only, while nobody writes to it.
class Source {
 public:
  static Result<Source> open(const fs::path& file, Disk& disk) {
    if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
    auto lock = take_lock(disk, file, LockKind::shared);
    if (!lock) return tl::unexpected(lock.error());
    auto opened = JournalFile::open_to_read(file, disk);
    if (!opened) return tl::unexpected(opened.error());
    return Source(std::move(*lock), std::move(*opened));
  }
  JournalFile& operator*() { return journal_; }
  JournalFile* operator->() { return &journal_; }

 private:
  Source(std::unique_ptr<DiskLock> lock, JournalFile journal) : lock_(std::move(lock)), journal_(std::move(journal)) {}
  std::unique_ptr<DiskLock> lock_;
  JournalFile journal_;
};

Disk& or_system(Disk* disk) { return disk != nullptr ? *disk : system_disk(); }

VerifyReport report_of(JournalFile& file) {
  Inspection found = file.inspect(true);
  VerifyReport report{.version = file.version(),
                      .head = found.head,
                      .first_bad = found.first_bad,
                      .witnessed = found.witnessed,
                      .closed_cleanly = found.closed_cleanly,
                      .faults = std::move(found.faults),
                      .notes = std::move(found.notes)};
  if (!report.sound()) return report;  // nobody vouches for damaged data
  const auto entries = file.signed_entries();
  const auto checkpoints = file.checkpoints();
  const auto keys = file.find_register(kKeysRegister);
  if (entries)
    for (const SignedEntries& one : *entries) report.signed_range.push_back({one.since, one.head.seq, one.key});
  if (keys && *keys) report.successions = decode_successions(**keys).value_or(std::vector<Succession>{});
  if (checkpoints)
    for (const Checkpoint& one : *checkpoints)
      report.seals.emplace_back("the checkpoint at event " + std::to_string(one.at.seq.value), file.signer_of(one));
  if (const auto names = file.registers())
    for (const std::string& name : *names) {
      if (name == kGenerationRegister || name == kIdRegister || name == kKeysRegister) continue;
      if (const auto one = file.find_sealed(name); one && *one)
        report.seals.emplace_back("the register \"" + name + "\"", file.signer_of(**one));
    }
  std::vector<std::optional<PublicKey>> signers;
  if (const auto people = file.people(&signers))
    for (std::size_t i = 0; i < people->size(); ++i)
      report.seals.emplace_back("the name of person " + (*people)[i].pseudonym, signers[i]);
  if (const auto footer = file.find_sealed(kFooterRegister); footer && *footer && report.closed_cleanly)
    report.seals.emplace_back("the footer", file.signer_of(**footer));
  return report;
}

}  // namespace

Result<VerifyReport> verify_journal(const fs::path& file, Disk* disk) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  return report_of(**source);
}

Vouched vouched_by(const PublicKey& key, const VerifyReport& report) {
  const std::set<PublicKey> own = keys_of_line(key, report.successions);
  Vouched vouched;
  // All entries between two of these sequence numbers are signed by the same keys.
  std::set<std::uint64_t> ends{report.head.seq.value};
  for (const SignedRange& range : report.signed_range) ends.insert({range.from.value - 1, range.to.value});
  RoomSeq from{1};
  for (const std::uint64_t end : ends) {
    const RoomSeq to{end};
    if (to < from || to > report.head.seq) continue;
    const SignedRange* by = nullptr;
    for (const SignedRange& range : report.signed_range)
      if (range.from <= from && to <= range.to && (by == nullptr || own.contains(range.key))) by = &range;
    if (by == nullptr) {
      auto& none = vouched.by_nobody;
      if (!none.empty() && none.back().second.value + 1 == from.value)
        none.back().second = to;
      else
        none.emplace_back(from, to);
    } else {
      auto& some = own.contains(by->key) ? vouched.ranges : vouched.by_others;
      if (!some.empty() && some.back().key == by->key && some.back().to.value + 1 == from.value)
        some.back().to = to;
      else
        some.push_back({from, to, by->key});
    }
    from.value = end + 1;
  }
  for (const auto& [what, signer] : report.seals) {
    if (signer && own.contains(*signer))
      ++vouched.seals;
    else
      vouched.other_seals.push_back(what);
  }
  return vouched;
}

std::vector<std::string> verify_beside(Journal& journal) {
  auto& state = JournalInside::of(journal);
  static_cast<void>(JournalInside::carry(journal));  // a failure is among the faults
  state.file.database().forget_pages();
  Inspection found;
  found.head = state.head;
  state.file.inspect_beside(false, found);
  return std::move(found.faults);
}

Result<VerifyReport> verify_journal(Journal& journal) {
  auto& state = JournalInside::of(journal);
  static_cast<void>(JournalInside::carry(journal));  // a failure is among the faults
  state.file.database().forget_pages();
  return report_of(state.file);
}

// The copy grows under another name in the target folder, and gets its name when it is complete.
struct JournalCopy::State {
  fs::path from, to, growing;
  Disk* disk;
  JournalFile* source;
  std::string genesis;  // of the copy
  JournalHead copied;   // as the source has it
  JournalHead head;     // as the copy has it
  RoomSeq last;
  std::optional<std::vector<std::string>> only = {};  // a branch: these registers, and no people
  bool damaged = false;                               // what cannot be read is left out
  std::optional<std::uint64_t> epochs = {};           // salvaged: more openings than the lost part can have counted
  std::shared_ptr<const SigningKeys> keys = {};       // they sign what is not copied as it is
  bool signs_entries = false;                         // those of a branch, which has another chain
  std::optional<Journal> target = {};
  // Taken from the source and not yet put into the target.
  std::vector<JournalEntry> entries = {};
  std::vector<SealedRegister> registers = {};
  std::vector<SignedEntries> signatures = {};
  std::vector<Person> people = {};
  std::vector<Checkpoint> checkpoints = {};
  std::optional<Error> no_checkpoint = {};  // why the last of them could not be copied
  bool begun = false, all_taken = false, put_beside = false;
};

struct JournalCopying {
  static Result<JournalCopy> begin(const fs::path& from, JournalFile& source, RoomSeq last, const fs::path& to,
                                   Disk& disk) {
    if (Result<void> clear = check_nothing_left(disk, to); !clear) return tl::unexpected(clear.error());
    const std::string& genesis = source.genesis();
    return JournalCopy(std::make_unique<JournalCopy::State>(JournalCopy::State{
        from, to, growing_copy(to), &disk, &source, genesis, first_head(genesis), first_head(genesis), last}));
  }

  static JournalCopy::State& state(JournalCopy& copy) { return *copy.state_; }

  static Result<void> begin_target(JournalCopy::State& state) {
    const auto nobody = take_lock(*state.disk, state.growing, LockKind::exclusive);
    if (!nobody && nobody.error().code != ErrorCode::not_found) return tl::unexpected(nobody.error());
    state.begun = true;
    if (Result<void> cleared = clear_growing(state); !cleared) return cleared;
    auto target = Journal::create(state.growing, state.genesis,
                                  {.disk = state.disk, .keys = state.signs_entries ? state.keys : nullptr});
    if (!target) return tl::unexpected(target.error());
    state.target = std::move(*target);
    // The copy keeps the chain of the original entries. A branch has another chain, computed from their present
    // content.
    if (!state.only) JournalInside::of(*state.target).file.take_erased(state.source->erased());
    return {};
  }

  // Also removes what an earlier, interrupted copy left.
  static Result<void> clear_growing(const JournalCopy::State& state) {
    const auto names = state.disk->list(folder_of(state.growing));
    if (!names) return tl::unexpected(names.error());
    for (const std::string& name : *names)
      if (belongs_to(state.growing, name))
        if (Result<void> gone = state.disk->remove(folder_of(state.growing) / name); !gone) return gone;
    return {};
  }

  static Result<void> left_out(const JournalCopy::State& state, const Error& error) {
    if (state.damaged) return {};
    return tl::unexpected(error);
  }

  static Result<void> take_entries(JournalCopy::State& state, std::size_t most_entries) {
    std::size_t bytes = 0;
    const Walk walked =
        state.source->walk(state.copied, state.last, [&](const JournalEntry& entry, const JournalHead&) {
          state.entries.push_back(entry);
          bytes += entry.bytes.size();
          return state.entries.size() < most_entries && bytes < kSliceBytes;
        });
    if (walked.stopped && !state.damaged) return tl::unexpected(*walked.stopped);
    if (walked.stopped) state.last = walked.head.seq;
    state.copied = walked.head;
    return {};
  }

  static Result<void> take_beside(JournalCopy::State& state) {
    const auto names = state.only ? Result<std::vector<std::string>>(*state.only) : state.source->registers();
    if (!names) {
      if (Result<void> on = left_out(state, names.error()); !on) return on;
    } else {
      for (const std::string& name : *names) {
        if (name == kGenerationRegister || name == kIdRegister) continue;  // the copy has its own
        const auto found = state.source->find_sealed(name);
        if (found && *found) state.registers.push_back(**found);
        if (!found)
          if (Result<void> on = left_out(state, found.error()); !on) return on;
      }
    }
    if (!state.only) {
      const auto signatures = state.source->signed_entries();
      if (!signatures) {
        if (Result<void> on = left_out(state, signatures.error()); !on) return on;
      } else {
        for (const SignedEntries& one : *signatures)
          if (const auto chain = state.source->chain_at(one.head.seq);
              one.head.seq <= state.copied.seq && fits(one) && chain && *chain == one.head.chain)
            state.signatures.push_back(one);
      }
      auto people = state.source->people();
      if (people)
        state.people = std::move(*people);
      else if (Result<void> on = left_out(state, people.error()); !on)
        return on;
    }
    auto checkpoints = state.source->checkpoints();
    if (!checkpoints) return left_out(state, checkpoints.error());
    std::erase_if(*checkpoints, [&](const Checkpoint& one) { return one.at.seq > state.copied.seq; });
    state.checkpoints = {checkpoints->rbegin(), checkpoints->rend()};
    return {};
  }

  // A checkpoint that could not be copied may have been replaced by a newer one in the meantime.
  static Result<void> pass_over(JournalCopy::State& state) {
    const auto known = state.source->checkpoints();
    const Error why = *std::exchange(state.no_checkpoint, std::nullopt);
    const auto is_it = [&](const Checkpoint& one) { return one.at == state.checkpoints.back().at; };
    if (!known || std::ranges::any_of(*known, is_it))
      if (Result<void> on = left_out(state, why); !on) return on;
    state.checkpoints.pop_back();
    return {};
  }

  static Result<void> take(JournalCopy::State& state, std::size_t most_entries) {
    if (state.no_checkpoint) return pass_over(state);
    if (state.all_taken) return {};
    if (Result<void> taken = take_entries(state, most_entries); !taken) return taken;
    if (state.copied.seq < state.last) return {};
    state.all_taken = true;
    return take_beside(state);
  }

  static Result<bool> put(JournalCopy::State& state) {
    if (!state.target)
      if (Result<void> begun = begin_target(state); !begun) return tl::unexpected(begun.error());
    if (const auto entries = std::exchange(state.entries, {}); !entries.empty())
      if (Result<void> put = state.target->append(entries); !put) return tl::unexpected(put.error());
    state.head = state.target->head();
    if (!state.all_taken) return false;
    if (!std::exchange(state.put_beside, true))
      if (Result<void> put = put_beside(state); !put) return tl::unexpected(put.error());
    if (!state.checkpoints.empty()) {
      if (Result<void> copied = copy_checkpoint(state, state.checkpoints.back()); copied)
        state.checkpoints.pop_back();
      else
        state.no_checkpoint = copied.error();
      return false;
    }
    return finish(state).map([] { return true; });
  }

  static Result<void> put_beside(JournalCopy::State& state) {
    return JournalInside::write_through(*state.target, [&](JournalFile& file) {
      Result<void> done;
      if (state.keys) file.sign_with(&state.keys->key());
      // Another genesis needs other seals.
      for (const SealedRegister& one : state.registers)
        if (done) done = state.only ? file.set_register(one.name, one.value) : file.add_register(one);
      for (const SignedEntries& one : state.signatures)
        if (done) done = file.add_signed_entries(one);
      for (const Person& person : state.people)
        if (done) done = file.add_person(person);
      if (done && state.epochs)
        done = file.set_register(kRecoveredRegister, encode_number(state.copied.seq.value)).and_then([&] {
          return file.set_register(kEpochRegister, encode_number(*state.epochs));
        });
      return done;
    });
  }

  static Result<void> copy_checkpoint(JournalCopy::State& state, const Checkpoint& checkpoint) {
    // A branch has the same entries under a chain of its own.
    JournalHead at = checkpoint.at;
    if (state.only) {
      const auto head = state.target->head_at(at.seq);
      if (!head) return tl::unexpected(head.error());
      at = *head;
    }
    auto file = state.target->begin_checkpoint(at, checkpoint.meta, state.only ? "" : checkpoint.seal);
    if (!file) return tl::unexpected(file.error());
    const fs::path from = checkpoint_file(state.from, checkpoint.at);
    const auto read = read_in_pieces(*state.disk, from, [&](std::string_view piece) { return file->write(piece); });
    if (!read) return tl::unexpected(read.error());
    if (read->size != checkpoint.size || read->digest != checkpoint.digest)
      return failure(ErrorCode::invalid_input, from.string() + " is not what was written; remove it to copy the rest");
    if (Result<void> finished = file->finish(); !finished) return finished;
    return state.target->add_checkpoint(std::move(*file));
  }

  static Result<void> finish(JournalCopy::State& state) {
    const auto checkpoints = state.target->checkpoints();
    if (!checkpoints) return tl::unexpected(checkpoints.error());
    Result<void> done = state.target->close();
    state.target.reset();
    for (const Checkpoint& checkpoint : *checkpoints) {
      if (!done) break;
      done =
          state.disk->rename(checkpoint_file(state.growing, checkpoint.at), checkpoint_file(state.to, checkpoint.at));
    }
    if (done) done = state.disk->rename(state.growing, state.to);  // last: everything that vouches for it is there
    if (done) done = state.disk->sync_folder(folder_of(state.to));
    return done;
  }
};

JournalCopy::JournalCopy(std::unique_ptr<State> state) : state_(std::move(state)) {}
JournalCopy::JournalCopy(JournalCopy&&) noexcept = default;
JournalCopy::~JournalCopy() {
  if (!state_ || !state_->begun) return;
  state_->target.reset();
  static_cast<void>(JournalCopying::clear_growing(*state_));
}

Result<JournalCopy> JournalCopy::begin(Journal& source, const fs::path& to) {
  auto& state = JournalInside::of(source);
  // Stores the signature of the newest entries where the copy reads it. If that fails, the copy gets an earlier
  // signature.
  if (state.signed_since) static_cast<void>(JournalInside::carry(source));
  auto copy = JournalCopying::begin(state.path, state.file, state.head.seq, to, *state.disk);
  if (copy) copy->state_->keys = state.options.keys;
  return copy;
}

Result<JournalCopy> JournalCopy::begin_branch(Journal& source, const fs::path& to, RoomSeq last, std::string genesis,
                                              std::vector<std::string> registers) {
  auto& state = JournalInside::of(source);
  OSTEON_CHECK(last <= state.head.seq);
  auto copy = JournalCopying::begin(state.path, state.file, last, to, *state.disk);
  if (!copy) return copy;
  copy->state_->genesis = std::move(genesis);
  copy->state_->only = std::move(registers);
  copy->state_->keys = state.options.keys;
  copy->state_->signs_entries = state.signed_since == RoomSeq{1};  // the server vouches for everything that it copies
  return copy;
}

Result<void> JournalCopy::take(std::size_t most_entries) { return JournalCopying::take(*state_, most_entries); }
Result<bool> JournalCopy::put() { return JournalCopying::put(*state_); }

Result<bool> JournalCopy::step(std::size_t most_entries) {
  return take(most_entries).and_then([&] { return put(); });
}

const JournalHead& JournalCopy::head() const { return state_->head; }

double JournalCopy::fraction() const {
  const auto last = static_cast<double>(state_->last.value);
  return last > 0 ? static_cast<double>(state_->copied.seq.value) / last : 1.0;
}

namespace {

Result<void> copy_all(JournalCopy& copy) {
  Result<bool> done = false;
  while (done && !*done) done = copy.step();
  if (!done) return tl::unexpected(done.error());
  return {};
}

Result<void> copy_sound(const fs::path& file, JournalFile& source, const fs::path& to, Disk& disk,
                        std::shared_ptr<const SigningKeys> keys) {
  const Inspection found = source.inspect(true);
  if (!found.faults.empty()) return failure(ErrorCode::invalid_input, found.faults.front());
  auto copy = JournalCopying::begin(file, source, found.head.seq, to, disk);
  if (!copy) return tl::unexpected(copy.error());
  JournalCopying::state(*copy).keys = std::move(keys);
  return copy_all(*copy);
}

}  // namespace

Result<void> backup_journal(const fs::path& file, const fs::path& to, Disk* disk,
                            std::shared_ptr<const SigningKeys> keys) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  return copy_sound(file, **source, to, or_system(disk), std::move(keys));
}

Result<void> migrate_journal(const fs::path& file, const fs::path& to, Disk* disk,
                             std::shared_ptr<const SigningKeys> keys) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  if ((*source)->version() == kJournalVersion)
    return failure(ErrorCode::exists,
                   file.string() + " is of version " + std::to_string(kJournalVersion) + " already; open it as it is");
  return copy_sound(file, **source, to, or_system(disk), std::move(keys));
}

Result<bool> has_head(const fs::path& file, const JournalHead& head, Disk* disk) {
  auto source = Source::open(file, or_system(disk));
  if (source) return (*source)->chain_at(head.seq).map([&](const auto& chain) { return chain == head.chain; });
  if (source.error().code != ErrorCode::exists) return tl::unexpected(source.error());
  // What is read during a write may be incomplete. Only an entry that fits the one before it counts.
  auto peeked = JournalFile::peek(file, or_system(disk));
  if (!peeked) return tl::unexpected(source.error());
  if (!head.seq) return first_head(peeked->genesis()) == head;
  const RoomSeq before{head.seq.value - 1};
  const auto chain = peeked->chain_at(before);
  if (!chain || !*chain) return tl::unexpected(source.error());
  const Walk walked =
      peeked->walk({before, **chain}, head.seq, [](const JournalEntry&, const JournalHead&) { return true; });
  if (walked.stopped || walked.head.seq != head.seq) return tl::unexpected(source.error());
  return walked.head == head;
}

Result<void> delete_journals(const std::vector<fs::path>& files, Disk* given) {
  Disk& disk = or_system(given);
  struct Doomed {
    fs::path file;
    std::vector<fs::path> others;
    std::unique_ptr<DiskLock> lock;
  };
  std::vector<Doomed> all;
  for (const fs::path& file : files) {
    const auto names = disk.list(folder_of(file));
    if (!names) return tl::unexpected(names.error());
    Doomed doomed{file, {}, nullptr};
    bool there = false;
    for (const std::string& name : *names) {
      const bool of_copy = belongs_to(growing_copy(file), name);
      if (!of_copy && !belongs_to(file, name)) continue;
      there = there || !name.ends_with(kLock);
      if (name != file.filename()) doomed.others.push_back(folder_of(file) / name);
    }
    if (!there) return failure(ErrorCode::not_found, "there is no journal " + file.string());
    auto lock = take_lock(disk, file, LockKind::exclusive);
    if (!lock && lock.error().code != ErrorCode::not_found) return tl::unexpected(lock.error());
    if (lock) doomed.lock = std::move(*lock);
    all.push_back(std::move(doomed));
  }
  for (Doomed& doomed : all) {
    // The file itself is removed first, and durably. Without its log it would be a shorter journal that nothing
    // contradicts once the checkpoints are gone. A log without its file is harmless.
    const fs::path folder = folder_of(doomed.file);
    Result<void> done = disk.remove(doomed.file).and_then([&] { return disk.sync_folder(folder); });
    for (const fs::path& other : doomed.others)
      if (done) done = disk.remove(other);
    if (done) done = disk.sync_folder(folder);
    if (!done) return done;
    doomed.lock.reset();
  }
  return {};
}

Result<RecoverReport> salvage_journal(const fs::path& file, const fs::path& to, Disk* disk,
                                      const std::vector<JournalHead>& known, RoomSeq last,
                                      std::shared_ptr<const SigningKeys> keys) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  Inspection found = (*source)->inspect(true);
  RecoverReport report{found.head, found.witnessed, std::move(found.faults)};
  for (const JournalHead& head : known) report.witnessed = std::max(report.witnessed, head.seq);

  const RoomSeq end = last ? std::min(last, found.head.seq) : found.head.seq;
  auto copy = JournalCopying::begin(file, **source, end, to, or_system(disk));
  if (!copy) return tl::unexpected(copy.error());
  auto& state = JournalCopying::state(*copy);
  state.keys = std::move(keys);
  state.damaged = true;
  const std::uint64_t epoch = (*source)
                                  ->find_register(kEpochRegister)
                                  .map([](const auto& value) { return value ? decode_number(*value).value_or(0) : 0; })
                                  .value_or(0);
  state.epochs = epoch + kEpochsSkipped;
  if (const Result<void> done = copy_all(*copy); !done) return tl::unexpected(done.error());
  report.head = state.copied;
  return report;
}

}  // namespace osteon
