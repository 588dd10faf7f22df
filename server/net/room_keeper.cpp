#include "server/net/room_keeper.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "common/field/field_hash.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/journal.pb.h"

namespace osteon {
namespace {

constexpr std::size_t kPieceBytes = 128 * 1024;  // of a checkpoint, about

std::int32_t today() {
  return static_cast<std::int32_t>(
      std::chrono::duration_cast<std::chrono::days>(std::chrono::system_clock::now().time_since_epoch()).count());
}

// A piece of a checkpoint: its length, then a JournalFields.
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
  std::unique_lock lock(mutex_);
  const std::uint64_t mine = asked_++;
  next_.wait(lock, [&] { return served_ == mine; });
}

void InTurn::unlock() {
  const std::lock_guard lock(mutex_);
  ++served_;
  next_.notify_all();
}

RoomKeeper::RoomKeeper(std::filesystem::path file, Journal journal, RoomGenesis genesis, double pitch_mm, Disk& disk)
    : journal_(std::move(journal)), file_(std::move(file)), genesis_(std::move(genesis)), pitch_mm_(pitch_mm), disk_(disk) {}

tl::unexpected<Error> RoomKeeper::is_closed() const {
  return failure(ErrorCode::unavailable, "the room " + genesis_.room + " is closed; open it again");
}

Result<KeptRoom> RoomKeeper::open(const std::filesystem::path& file, const Case& bone, const Options& options,
                                  const std::function<void(double)>& progress) {
  Result<Journal> journal = Journal::open(file, options.journal);
  bool made = false;
  if (!journal && journal.error().code == ErrorCode::not_found) {
    const RoomGenesis genesis = genesis_of(Room(bone, options.limits, options.tools ? options.tools : builtin_tool_box()), options.name);
    journal = Journal::create(file, to_bytes(genesis), options.journal);
    made = true;
  }
  if (!journal) return tl::unexpected(journal.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(journal->genesis());
  if (!genesis) return failure(genesis.error().code, file.string() + ": " + genesis.error().message);
  std::unique_ptr<RoomKeeper> keeper(new RoomKeeper(file, std::move(*journal), std::move(*genesis), bone.pitch_mm(),
                                                    options.journal.disk != nullptr ? *options.journal.disk : system_disk()));
  if (const Error* closed = keeper->journal_->closed_because())
    log::warn("journal takes no rows", {{"file", file.string()}, {"reason", closed->message}});
  else if (Result<std::uint64_t> epoch = keeper->journal_->next_server_epoch(); epoch)
    keeper->server_epoch_ = *epoch;
  else
    return tl::unexpected(epoch.error());
  const Fields fields = keeper->newest_fields();
  Result<Room> room = keeper->replay(bone, options.limits, fields, progress);
  if (!room) return failure(room.error().code, file.string() + ": " + room.error().message);
  keeper->evaluated_ = keeper->journal_->head().place.value - fields.place.value;
  return KeptRoom{std::move(*room), std::move(keeper), made};
}

RoomKeeper::Fields RoomKeeper::newest_fields() {
  const Result<std::vector<Checkpoint>> checkpoints = journal_->checkpoints();
  if (!checkpoints) return {};
  for (const Checkpoint& one : *checkpoints) {
    if (one.at.place > journal_->head().place) continue;
    const Result<std::string> bytes = journal_->read_checkpoint(one);
    if (!bytes) continue;
    std::optional<std::vector<FieldLeaf>> leaves = leaves_of(*bytes);
    if (leaves && to_hex(field_hash(*leaves, pitch_mm_)) == one.meta) return {one.at.place, std::move(*leaves)};
    log::warn("a checkpoint is passed over", {{"place", one.at.place.value}});
  }
  return {};
}

Result<Room> RoomKeeper::replay(const Case& bone, const CutLimits& limits, const Fields& fields,
                                const std::function<void(double)>& progress) {
  Result<Room> room = begin_room(bone, genesis_, limits);
  if (!room) return room;
  const std::uint64_t rows = journal_->head().place.value;
  Result<void> replayed;
  const auto take = [&](const JournalRow& one) {
    Result<RoomRow> row = row_from_bytes(one.place, std::chrono::nanoseconds(one.at_ns), one.bytes);
    replayed = row ? room->replay(*row, one.place <= fields.place ? Room::Fields::leave : Room::Fields::evaluate)
                   : Result<void>(tl::unexpected(row.error()));
    if (replayed && one.place == fields.place) replayed = room->set_fields(fields.leaves);
    if (progress && one.place.value % 64 == 0) progress(static_cast<double>(one.place.value) / static_cast<double>(rows));
    return replayed.has_value();
  };
  if (Result<void> read = journal_->read(RoomSeq{1}, take); !read) return tl::unexpected(read.error());
  if (!replayed) return tl::unexpected(replayed.error());
  // Nobody has watched this room yet: all of its surface is made anew.
  (void)room->take_changes();
  return room;
}

Result<void> RoomKeeper::write(std::span<const RoomRow> rows) {
  std::vector<JournalRow> out;
  out.reserve(rows.size());
  for (const RoomRow& row : rows) out.push_back({row.place, row.at.count(), to_bytes(row)});
  return with_journal([&](Journal& journal) { return journal.append(out); });
}

JournalHead RoomKeeper::head() const {
  const std::lock_guard in_turn(turn_);
  return journal_ ? journal_->head() : last_;
}

Result<std::uint32_t> RoomKeeper::person(const std::string& label) {
  return with_journal([&](Journal& journal) -> Result<std::uint32_t> {
    const Result<std::vector<Person>> people = journal.people();
    if (!people) return tl::unexpected(people.error());
    std::uint32_t newest = 0;
    for (const Person& person : *people) {
      if (person.label == label) return static_cast<std::uint32_t>(std::stoul(person.pseudonym));
      newest = std::max(newest, static_cast<std::uint32_t>(std::stoul(person.pseudonym)));
    }
    // Never again the number of one who was forgotten.
    const Result<std::optional<std::string>> given = journal.find_register(kPeopleRegister);
    if (!given) return tl::unexpected(given.error());
    if (*given) newest = std::max(newest, static_cast<std::uint32_t>(std::stoul(**given)));
    const std::string pseudonym = std::to_string(newest + 1);
    if (Result<void> set = journal.set_register(kPeopleRegister, pseudonym); !set) return tl::unexpected(set.error());
    if (Result<void> set = journal.set_person({pseudonym, label, today()}); !set) return tl::unexpected(set.error());
    return newest + 1;
  });
}

Result<void> RoomKeeper::check_witness(const JournalHead& witness) {
  return with_journal([&](Journal& journal) { return journal.check_witness(witness); });
}

Result<void> RoomKeeper::checkpoint(RoomSeq place, std::span<const FieldLeaf> leaves) {
  return with_journal([&](Journal& journal) -> Result<void> {
    if (journal.head().place != place || !place) return {};
    if (const auto known = journal.checkpoints(); known && !known->empty() && known->front().at.place == place) return {};
    const Digest hash = field_hash({leaves.begin(), leaves.end()}, pitch_mm_);
    Result<CheckpointFile> file = journal.begin_checkpoint(journal.head(), to_hex(hash));
    if (!file) return tl::unexpected(file.error());
    for (std::size_t next = 0; next < leaves.size();) {
      v1::JournalFields piece;
      for (std::size_t size = 0; next < leaves.size() && size < kPieceBytes; ++next) {
        *piece.add_leaves() = wire::to_wire(leaves[next]);
        size += piece.leaves(piece.leaves_size() - 1).values().size() + 24;
      }
      if (Result<void> written = file->write(piece_of(piece)); !written) return written;
    }
    if (Result<void> finished = file->finish(); !finished) return finished;
    return journal.add_checkpoint(std::move(*file));
  });
}

Result<void> RoomKeeper::close() {
  return with_journal([&](Journal& journal) {
    last_ = journal.head();
    const Result<void> done = journal.close();
    journal_.reset();
    return done;
  });
}

}  // namespace osteon
