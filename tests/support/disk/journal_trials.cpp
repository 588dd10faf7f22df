#include "tests/support/disk/journal_trials.hpp"

#include <sodium.h>

#include <algorithm>
#include <cerrno>

#include "common/core/check.hpp"
#include "server/journal/maintenance.hpp"

namespace osteon::test {
namespace {

std::string little_endian(std::uint64_t value) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
  return bytes;
}

Digest sha256(const std::string& bytes) {
  Digest digest;
  crypto_hash_sha256(digest.bytes.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  return digest;
}

std::string raw(const Digest& digest) { return {digest.bytes.begin(), digest.bytes.end()}; }

bool same(const JournalEntry& a, const JournalEntry& b) {
  return a.seq == b.seq && a.at_ns == b.at_ns && a.bytes == b.bytes;
}

void add(Tally& tally, const JournalWriter& writer, std::uint64_t seed, bool failed) {
  ++tally.trials;
  tally.acknowledged += writer.acknowledged().size() - writer.kept_unasked() + writer.lost();
  tally.recovered += writer.acknowledged().size();
  tally.kept_unasked += writer.kept_unasked();
  tally.lost += writer.lost();
  tally.failed += failed ? 1 : 0;
  tally.bad_trials += writer.faults().empty() ? 0 : 1;
  if (!writer.faults().empty() && tally.faults.size() < 5)
    tally.faults.push_back("seed " + std::to_string(seed) + ": " + writer.faults().front());
}

}  // namespace

JournalHead plain_head(const std::string& genesis, const std::vector<JournalEntry>& entries) {
  const std::string name = "osteon journal";
  JournalHead head{RoomSeq{0}, sha256(little_endian(name.size()) + name + little_endian(genesis.size()) + genesis)};
  for (const JournalEntry& entry : entries)
    head = {entry.seq, sha256(raw(head.chain) + little_endian(entry.seq.value) +
                              little_endian(static_cast<std::uint64_t>(entry.at_ns)) +
                              little_endian(entry.bytes.size()) + entry.bytes)};
  return head;
}

JournalWriter::JournalWriter(std::uint64_t seed, MemoryDisk& disk, bool durable, std::string genesis)
    : random_(seed), disk_(disk), genesis_(std::move(genesis)) {
  options_.disk = &disk;
  options_.durable = durable;
  options_.page_bytes = disk.sector_bytes() < 4096 && below(2) == 0 ? 1024 : 4096;
  options_.log_bytes = 4096 << below(6);  // so that the log is moved into the file every few entries
  if (seed % 2 == 0)
    options_.keys = std::make_shared<const SigningKeys>(SigningKey::from_seed({static_cast<std::uint8_t>(seed)}));
}

bool JournalWriter::open() {
  const auto exists = disk_.size(file_);
  if (!exists) return false;
  if (made_ && !*exists) {
    fault("the journal is gone");
    made_ = false;
  }
  Result<Journal> opened = *exists ? Journal::open(file_, options_) : Journal::create(file_, genesis_, options_);
  if (!opened) {
    if (!disk_.has_failed()) fault("cannot be opened: " + opened.error().message);
    return false;
  }
  made_ = true;
  journal_ = std::move(*opened);
  return true;
}

bool JournalWriter::append() {
  asked_.clear();
  const std::uint64_t count = 1 + below(4);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::size_t size = below(20) == 0 ? below(12000) : below(300);
    asked_.push_back({RoomSeq{acknowledged_.size() + i + 1}, static_cast<std::int64_t>(random_() >> 2),
                      std::string(size, static_cast<char>(random_()))});
  }
  if (!journal_->append(asked_)) return false;
  acknowledged_.insert(acknowledged_.end(), asked_.begin(), asked_.end());
  asked_.clear();
  return true;
}

bool JournalWriter::write_checkpoint() {
  std::string bytes;
  auto file = journal_->begin_checkpoint(journal_->head(), "meta");
  if (!file) return file.error().code == ErrorCode::exists && !disk_.has_failed();
  for (std::uint64_t pieces = below(4); pieces > 0; --pieces) {
    const std::size_t size = below(2000);
    const std::string piece(size, static_cast<char>(random_()));
    bytes += piece;
    if (!file->write(piece)) return false;
  }
  const std::uint64_t seq = journal_->head().seq.value;
  if (!file->finish() || !journal_->add_checkpoint(std::move(*file))) return false;
  checkpoints_[seq] = bytes;
  return true;
}

bool JournalWriter::work(int count) {
  for (; count > 0; --count) {
    bool done = true;
    switch (below(16)) {
      case 0:
        done = write_checkpoint();
        break;
      case 1: {
        const auto epoch = journal_->next_server_epoch();
        done = epoch.has_value();
        if (epoch && *epoch <= epoch_) fault("server epoch " + std::to_string(*epoch) + " was given before");
        if (epoch) epoch_ = *epoch;
        break;
      }
      case 2: {
        const Person person{"p" + std::to_string(below(6)), std::string(below(40), 'n'),
                            static_cast<std::int32_t>(below(9))};
        person_asked_ = person.pseudonym;
        done = journal_->set_person(person).has_value();
        if (done) people_[person.pseudonym] = person;
        if (done) person_asked_.reset();
        break;
      }
      case 3: {
        const std::string pseudonym = "p" + std::to_string(below(6));
        person_asked_ = pseudonym;
        done = journal_->erase_person(pseudonym).has_value();
        if (done) people_.erase(pseudonym);
        if (done) person_asked_.reset();
        break;
      }
      case 4:
        done = journal_->tidy().has_value();
        break;
      case 5:
        done = journal_->close().has_value();
        journal_.reset();
        done = done && open();
        break;
      default:
        done = append();
    }
    if (done && journal_->closed_because() == nullptr) continue;
    if (!asked_.empty() && journal_ && journal_->closed_because() == nullptr)
      fault("an append failed without a word why");
    if (!disk_.has_failed()) fault("refuses work on a sound disk");
    return false;
  }
  return true;
}

void JournalWriter::check() {
  std::vector<JournalEntry> entries;
  const Result<void> read = journal_->read(RoomSeq{1}, [&](const JournalEntry& entry) {
    entries.push_back(entry);
    return true;
  });
  if (!read) fault("cannot be read: " + read.error().message);
  const std::size_t promised = acknowledged_.size();
  for (std::size_t i = 0; i < std::min(entries.size(), promised); ++i)
    if (!same(entries[i], acknowledged_[i])) fault("entry " + std::to_string(i + 1) + " differs");
  if (entries.size() < promised) {
    lost_ += promised - entries.size();
    fault("entries " + std::to_string(entries.size() + 1) + " to " + std::to_string(promised) + " are lost");
  }
  // A batch that was not acknowledged must be there as a whole or not at all.
  if (entries.size() > promised) {
    kept_unasked_ += entries.size() - promised;
    bool whole = entries.size() == promised + asked_.size();
    for (std::size_t i = 0; whole && i < asked_.size(); ++i) whole = same(entries[promised + i], asked_[i]);
    if (!whole) fault("there are entries that nobody asked for, or half of those that were");
  }
  asked_.clear();
  acknowledged_ = std::move(entries);
  if (plain_head(genesis_, acknowledged_) != journal_->head()) fault("the chain is another than that of the entries");

  const auto people = journal_->people();
  if (!people) return fault(people.error().message);
  std::map<std::string, Person> found;
  for (const Person& person : *people) found[person.pseudonym] = person;
  for (auto* all : {&found, &people_})
    if (person_asked_) all->erase(*person_asked_);
  if (found != people_) fault("people were lost or came back");
  if (person_asked_)
    for (const Person& person : *people)
      if (person.pseudonym == *person_asked_) found[person.pseudonym] = person;
  people_ = std::move(found);
  person_asked_.reset();

  const auto checkpoints = journal_->checkpoints();
  if (!checkpoints) return fault(checkpoints.error().message);
  if (checkpoints->size() > 2) fault("more than two checkpoints are kept");
  if (checkpoints->size() < std::min<std::size_t>(2, checkpoints_.size())) fault("a checkpoint is lost");
  for (const Checkpoint& checkpoint : *checkpoints) {
    const auto bytes = journal_->read_checkpoint(checkpoint);
    if (!bytes) fault(bytes.error().message);
    const auto known = checkpoints_.find(checkpoint.at.seq.value);
    if (bytes && known != checkpoints_.end() && known->second != *bytes) fault("a checkpoint differs");
  }
}

void JournalWriter::check_failed() {
  if (!journal_ || journal_->closed_because() == nullptr) return;
  const JournalEntry next{RoomSeq{journal_->head().seq.value + 1}, 0, "late"};
  if (journal_->append({&next, 1}) || journal_->next_server_epoch()) fault("goes on after a write that failed");
}

void JournalWriter::recover() {
  drop();
  const std::filesystem::path to = "/room/journal" + std::to_string(++recoveries_);
  const auto report = salvage_journal(file_, to, &disk_);
  if (!report) return fault("cannot be recovered: " + report.error().message);
  file_ = to;
}

Tally power_loss_trials(std::uint64_t first_seed, std::uint64_t count, bool durable) {
  Tally tally;
  for (std::uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
    std::mt19937_64 random(seed * 2 + 1);
    MemoryDisk disk(seed, random() % 2 == 0 ? 512 : 4096);
    JournalWriter writer(seed, disk, durable);
    bool failed = false;
    const std::uint64_t lives = 1 + random() % 3;
    for (std::uint64_t life = 0; life < lives; ++life) {
      const bool soon = life == 0 && random() % 8 == 0;  // while the journal is being made
      disk.fail_power_at(1 + random() % (soon ? 30 : 400));
      if (writer.open() && (life == 0 || writer.journal().closed_because() == nullptr)) writer.work(60);
      failed = failed || disk.has_failed();
      writer.drop();
      disk.power_returns();
      if (!writer.open()) break;
      if (writer.journal().closed_because() != nullptr) ++tally.closed;
      writer.check();
      if (!writer.faults().empty()) break;
      writer.drop();
    }
    writer.drop();
    add(tally, writer, seed, failed);
  }
  return tally;
}

Tally failing_disk_trials(std::uint64_t first_seed, std::uint64_t count, int error) {
  Tally tally;
  for (std::uint64_t n = 1; n <= count; ++n) {
    const std::uint64_t seed = first_seed + n;
    std::mt19937_64 random(seed * 2 + 1);
    MemoryDisk disk(seed, random() % 2 == 0 ? 512 : 4096);
    JournalWriter writer(seed, disk);
    disk.fail_at(n, error, random() % 2 == 0 ? MemoryDisk::Lasting::once : MemoryDisk::Lasting::from_then_on);
    if (writer.open()) writer.work(1000);
    const bool failed = disk.has_failed();
    disk.mend();
    writer.check_failed();
    writer.drop();
    if (random() % 2 == 0) disk.power_returns();
    // The power may also fail while the next process repairs the journal.
    if (random() % 2 == 0) {
      disk.fail_power_at(1 + random() % 40);
      static_cast<void>(writer.open());
      writer.drop();
      disk.power_returns();
    }
    if (writer.open() && writer.journal().closed_because() != nullptr) {
      ++tally.closed;
      writer.recover();
      static_cast<void>(writer.open());
    }
    if (writer.is_open()) {
      writer.check();
      writer.work(10);
      writer.drop();
      disk.power_returns();
      if (writer.open()) writer.check();
      writer.drop();
    }
    add(tally, writer, seed, failed);
  }
  return tally;
}

Tally forgotten_sync_trials(std::uint64_t first_seed, std::uint64_t count) {
  Tally tally;
  for (std::uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
    std::mt19937_64 random(seed * 2 + 1);
    MemoryDisk disk(seed, random() % 2 == 0 ? 512 : 4096);
    JournalWriter writer(seed, disk);
    if (writer.open()) writer.work(static_cast<int>(random() % 12));
    disk.fail_sync_at(1, EIO, MemoryDisk::Lasting::from_then_on);
    if (writer.is_open()) writer.work(20);
    const bool failed = disk.has_failed();
    writer.drop();
    disk.mend();
    disk.fail_power_at(1 + random() % 24);
    static_cast<void>(writer.open());
    writer.drop();
    disk.power_returns();
    if (writer.open()) writer.check();
    tally.closed += writer.is_open() && writer.journal().closed_because() != nullptr ? 1 : 0;
    writer.drop();
    add(tally, writer, seed, failed);
  }
  return tally;
}

}  // namespace osteon::test
