#include "server/journal/upkeep.hpp"

#include <algorithm>
#include <utility>

#include "server/journal/journal_state.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSliceBytes = std::size_t{8} << 20;
// More openings than any lost part of a journal can have counted.
constexpr std::uint64_t kEpochsSkipped = 1'000'000;

// A journal that is only read. SQLite makes an empty log even for that: then it goes again.
class Source {
 public:
  static Result<Source> open(const fs::path& file, Disk& disk) {
    const auto size = disk.size(file);
    if (!size) return tl::unexpected(size.error());
    if (!*size) return failure(ErrorCode::not_found, "there is no journal " + file.string());
    auto lock = take_lock(disk, file);
    if (!lock) return tl::unexpected(lock.error());
    const auto log = disk.size(log_of(file));
    if (!log) return tl::unexpected(log.error());
    Source source(file, disk, std::move(*lock), !*log);
    auto opened = JournalFile::open(file, disk, {});
    if (!opened) return tl::unexpected(opened.error());
    source.journal_ = std::make_unique<JournalFile>(std::move(*opened));
    return source;
  }
  Source(Source&&) noexcept = default;
  Source& operator=(Source&&) = delete;
  ~Source() {
    if (!lock_) return;
    journal_.reset();
    if (clear_log_) static_cast<void>(disk_->remove(log_of(file_)));
  }
  JournalFile& operator*() { return *journal_; }
  JournalFile* operator->() { return journal_.get(); }

 private:
  Source(fs::path file, Disk& disk, std::unique_ptr<DiskLock> lock, bool clear_log)
      : file_(std::move(file)), disk_(&disk), lock_(std::move(lock)), clear_log_(clear_log) {}
  fs::path file_;
  Disk* disk_;
  std::unique_ptr<DiskLock> lock_;
  std::unique_ptr<JournalFile> journal_;
  bool clear_log_;
};

Disk& or_system(Disk* disk) { return disk != nullptr ? *disk : system_disk(); }

VerifyReport report_of(JournalFile& file) {
  Inspection found = file.inspect(true);
  return {file.version(), found.head, found.first_bad, found.witnessed, found.closed_cleanly, std::move(found.faults)};
}

}  // namespace

Result<VerifyReport> verify_journal(const fs::path& file, Disk* disk) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  return report_of(**source);
}

Result<VerifyReport> verify_journal(Journal& journal) { return report_of(JournalInside::of(journal).file); }

// The copy grows under a name of its own beside its place, and gets its name when it is whole.
struct JournalCopy::State {
  fs::path from, to, growing;
  Disk* disk;
  JournalFile* source;
  RoomSeq last;
  JournalHead copied;
  std::optional<Journal> target;
  bool damaged = false;  // what cannot be read is left out
};

struct JournalCopying {
  static Result<JournalCopy> begin(const fs::path& from, JournalFile& source, RoomSeq last, const fs::path& to, Disk& disk) {
    if (Result<void> clear = check_nothing_left(disk, to); !clear) return tl::unexpected(clear.error());
    const fs::path growing = to.string() + ".copying";
    JournalCopy copy(std::make_unique<JournalCopy::State>(
        JournalCopy::State{from, to, growing, &disk, &source, last, first_head(source.genesis()), std::nullopt, false}));
    if (Result<void> cleared = clear_growing(*copy.state_); !cleared) return tl::unexpected(cleared.error());
    auto target = Journal::create(growing, source.genesis(), {.disk = &disk});
    if (!target) return tl::unexpected(target.error());
    copy.state_->target = std::move(*target);
    return copy;
  }

  static JournalCopy::State& state(JournalCopy& copy) { return *copy.state_; }

  // Also what an earlier copy that was cut short left behind.
  static Result<void> clear_growing(const JournalCopy::State& state) {
    const auto names = state.disk->list(folder_of(state.growing));
    if (!names) return tl::unexpected(names.error());
    const std::string growing = state.growing.filename().string();
    for (const std::string& name : *names)
      if (name == growing || name == growing + ".lock" || name == log_of(growing) || name == failed_of(growing) ||
          is_partial_of(growing, name) || parse_checkpoint_file(growing, name))
        if (Result<void> gone = state.disk->remove(folder_of(state.growing) / name); !gone) return gone;
    return {};
  }

  static Result<void> copy_rows(JournalCopy::State& state, std::size_t most_rows) {
    std::vector<JournalRow> rows;
    std::size_t bytes = 0;
    const Walk walked = state.source->walk(state.copied, state.last, [&](const JournalRow& row, const JournalHead&) {
      rows.push_back(row);
      bytes += row.bytes.size();
      return rows.size() < most_rows && bytes < kSliceBytes;
    });
    if (walked.stopped && !state.damaged) return tl::unexpected(*walked.stopped);
    if (walked.stopped) state.last = walked.head.place;
    state.copied = walked.head;
    return rows.empty() ? Result<void>{} : state.target->append(rows);
  }

  static Result<void> copy_rest(JournalCopy::State& state) {
    const auto left_out = [&](const Error& error) -> Result<void> {
      if (state.damaged) return {};
      return tl::unexpected(error);
    };
    const auto names = state.source->registers();
    if (!names) {
      if (Result<void> on = left_out(names.error()); !on) return on;
    } else {
      for (const std::string& name : *names) {
        const auto value = state.source->find_register(name);
        Result<void> set;
        if (!value) set = left_out(value.error());
        if (value && *value) set = state.target->set_register(name, **value);
        if (!set) return set;
      }
    }
    const auto people = state.source->people();
    if (!people) {
      if (Result<void> on = left_out(people.error()); !on) return on;
    } else {
      for (const Person& person : *people)
        if (Result<void> set = state.target->set_person(person); !set) return set;
    }
    const auto checkpoints = state.source->checkpoints();
    if (!checkpoints) return left_out(checkpoints.error());
    for (const Checkpoint& checkpoint : *checkpoints) {
      if (checkpoint.at.place > state.copied.place) continue;
      if (Result<void> copied = copy_checkpoint(state, checkpoint); !copied)
        if (Result<void> on = left_out(copied.error()); !on) return on;
    }
    return {};
  }

  static Result<void> copy_checkpoint(JournalCopy::State& state, const Checkpoint& checkpoint) {
    auto file = state.target->begin_checkpoint(checkpoint.at, checkpoint.meta);
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
      done = state.disk->rename(checkpoint_file(state.growing, checkpoint.at), checkpoint_file(state.to, checkpoint.at));
    }
    if (done) done = state.disk->rename(state.growing, state.to);  // last: what vouches for it is there
    if (done) done = state.disk->sync_folder(folder_of(state.to));
    return done;
  }
};

JournalCopy::JournalCopy(std::unique_ptr<State> state) : state_(std::move(state)) {}
JournalCopy::JournalCopy(JournalCopy&&) noexcept = default;
JournalCopy::~JournalCopy() {
  if (!state_) return;
  state_->target.reset();
  static_cast<void>(JournalCopying::clear_growing(*state_));
}

Result<JournalCopy> JournalCopy::begin(Journal& source, const fs::path& to) {
  auto& state = JournalInside::of(source);
  return JournalCopying::begin(state.path, state.file, state.head.place, to, *state.disk);
}

Result<bool> JournalCopy::step(std::size_t most_rows) {
  if (Result<void> copied = JournalCopying::copy_rows(*state_, most_rows); !copied) return tl::unexpected(copied.error());
  if (state_->copied.place < state_->last) return false;
  const Result<void> done = JournalCopying::copy_rest(*state_).and_then([&] { return JournalCopying::finish(*state_); });
  if (!done) return tl::unexpected(done.error());
  return true;
}

namespace {

Result<void> copy_all(JournalCopy& copy) {
  Result<bool> done = false;
  while (done && !*done) done = copy.step();
  if (!done) return tl::unexpected(done.error());
  return {};
}

Result<void> copy_sound(const fs::path& file, JournalFile& source, const fs::path& to, Disk& disk) {
  const Inspection found = source.inspect(true);
  if (!found.faults.empty()) return failure(ErrorCode::invalid_input, found.faults.front());
  auto copy = JournalCopying::begin(file, source, found.head.place, to, disk);
  if (!copy) return tl::unexpected(copy.error());
  return copy_all(*copy);
}

}  // namespace

Result<void> backup_journal(const fs::path& file, const fs::path& to, Disk* disk) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  return copy_sound(file, **source, to, or_system(disk));
}

Result<void> migrate_journal(const fs::path& file, const fs::path& to, Disk* disk) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  if ((*source)->version() == kJournalVersion)
    return failure(ErrorCode::exists,
                   file.string() + " is of version " + std::to_string(kJournalVersion) + " already; open it as it is");
  return copy_sound(file, **source, to, or_system(disk));
}

Result<RecoverReport> recover_journal(const fs::path& file, const fs::path& to, Disk* disk,
                                      const std::vector<JournalHead>& known) {
  auto source = Source::open(file, or_system(disk));
  if (!source) return tl::unexpected(source.error());
  Inspection found = (*source)->inspect(true);
  RecoverReport report{found.head, found.witnessed, std::move(found.faults)};
  for (const JournalHead& head : known) report.witnessed = std::max(report.witnessed, head.place);

  auto copy = JournalCopying::begin(file, **source, found.head.place, to, or_system(disk));
  if (!copy) return tl::unexpected(copy.error());
  auto& state = JournalCopying::state(*copy);
  state.damaged = true;
  const std::uint64_t epoch = (*source)
                                  ->find_register(kEpochRegister)
                                  .map([](const auto& value) { return value ? decode_number(*value).value_or(0) : 0; })
                                  .value_or(0);
  Result<void> done;
  while (done && state.copied.place < state.last) done = JournalCopying::copy_rows(state, 1000);
  if (done) done = JournalCopying::copy_rest(state);
  if (done) done = state.target->set_register(kRecoveredRegister, encode_number(state.copied.place.value));
  if (done) done = state.target->set_register(kEpochRegister, encode_number(epoch + kEpochsSkipped));
  if (done) done = JournalCopying::finish(state);
  if (!done) return tl::unexpected(done.error());
  report.head = state.copied;
  return report;
}

}  // namespace osteon
