#include "server/storage/journal_entries.hpp"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/field/kernel.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/encoded_cut.hpp"
#include "osteon/v1/journal.pb.h"

namespace osteon {
namespace {

constexpr std::uint32_t kGenesisVersion = 1;

template <class List>
void put(const std::vector<RoomSeq>& seqs, List& out) {
  for (const RoomSeq seq : seqs) out.Add(seq.value);
}
template <class List>
std::vector<RoomSeq> seqs_of(const List& list) {
  std::vector<RoomSeq> seqs;
  for (const std::uint64_t seq : list) seqs.push_back(RoomSeq{seq});
  return seqs;
}

template <class List>
void put(const Mask& mask, List& out) {
  for (const FieldLeaf& leaf : *mask) *out.Add() = wire::to_wire(leaf);
}
template <class List>
Result<Mask> mask_of(const List& list) {
  auto mask = std::make_shared<std::vector<FieldLeaf>>();
  for (const v1::FieldLeaf& leaf : list) {
    Result<FieldLeaf> one = wire::from_wire(leaf);
    if (!one) return tl::unexpected(one.error());
    mask->push_back(std::move(*one));
  }
  return Mask(std::move(mask));
}

// A float does not hold a pose exactly, and a replayed room must have the same hash as the original.
void put(const Pose& pose, google::protobuf::RepeatedField<double>& out) {
  for (const double part : pose.position_mm) out.Add(part);
  for (const double part : pose.rotation.coeffs()) out.Add(part);
}
Result<Pose> pose_of(const google::protobuf::RepeatedField<double>& parts) {
  if (parts.size() != 7 || !std::ranges::all_of(parts, [](double part) { return std::isfinite(part); }))
    return bad_input("item.pose_bone_item has not 7 finite numbers");
  Pose pose{{parts[0], parts[1], parts[2]}, Eigen::Quaterniond(parts[6], parts[3], parts[4], parts[5])};
  if (std::abs(pose.rotation.norm() - 1.0) > 1e-3) return bad_input("item.pose_bone_item is not a unit quaternion");
  return pose;
}

// Text as JSON.
std::string json_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) {
      out += c;
      continue;
    }
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(c));
    out += escaped;
  }
  return out + '"';
}

struct Writer {
  v1::JournalEntry& out;

  void operator()(const JoinEntry& join) const {
    v1::JournalJoin& entry = *out.mutable_join();
    entry.set_author(join.author.value);
    entry.set_kind(static_cast<std::uint32_t>(join.kind));
    entry.set_person(join.person);
    entry.set_secret(wire::to_wire(join.secret));
    entry.set_role(static_cast<std::uint32_t>(join.role));
  }
  void operator()(const CutEntry& cut) const { *out.mutable_cut() = wire::to_wire(cut.cut); }
  void operator()(const RejectionEntry& rejection) const {
    v1::JournalRejection& entry = *out.mutable_rejection();
    entry.set_author(rejection.author.value);
    entry.set_author_seq(rejection.author_seq);
    entry.set_digest(wire::to_wire(rejection.bytes));
    entry.set_reason(static_cast<std::uint32_t>(rejection.reason));
  }
  void operator()(const SplitEntry& split) const {
    v1::JournalSplit& entry = *out.mutable_split();
    entry.set_parent(split.parent.value);
    put(split.taken, *entry.mutable_taken());
    for (const SplitPiece& piece : split.pieces) {
      v1::JournalPiece& one = *entry.add_pieces();
      one.set_body(piece.body.value);
      *one.mutable_reach_min() = wire::to_wire(piece.reach.min);
      *one.mutable_reach_max() = wire::to_wire(piece.reach.max);
      put(piece.left, *one.mutable_left());
    }
  }
  void operator()(const UndoEntry& undo) const { put(undo.seqs, *out.mutable_undo()->mutable_room_seqs()); }
  void operator()(const RedoEntry& redo) const {
    put(redo.undos, *out.mutable_redo()->mutable_undos());
    put(redo.seqs, *out.mutable_redo()->mutable_room_seqs());
  }
  void operator()(const RemoveBodyEntry& removal) const { out.mutable_removal()->set_body(removal.body.value); }
  void operator()(const ItemEntry& item) const {
    v1::JournalItem& entry = *out.mutable_item();
    entry.set_item(item.item);
    if (!item.set) return;
    *entry.mutable_set() = wire::to_wire(*item.set);
    entry.mutable_set()->clear_pose_bone_item();
    put(item.set->pose_bone_item, *entry.mutable_pose_bone_item());
  }
  void operator()(const ToolEntry& tool) const { *out.mutable_tool() = wire::to_wire(tool.tool); }
  void operator()(const MarkEntry& mark) const { out.mutable_mark()->set_label(mark.label); }
  void operator()(const SuperviseEntry& one) const {
    out.mutable_supervision()->set_subject(one.subject.value);
    *out.mutable_supervision()->mutable_supervision() = wire::to_wire(one.supervision);
  }
  void operator()(const AnnotationEntry& one) const {
    out.mutable_annotation()->set_annotation(one.id);
    if (one.drawn) *out.mutable_annotation()->mutable_drawn() = wire::to_wire(*one.drawn);
  }
  void operator()(const WordsEntry& said) const {
    out.mutable_words()->set_to(said.to.value);
    out.mutable_words()->set_words(said.words);
  }
};

using What = decltype(LogEntry::what);

Result<What> read(const v1::JournalJoin& entry) {
  if (entry.kind() > static_cast<std::uint32_t>(MemberKind::watcher)) return bad_input("join.kind is not known");
  const Result<Digest> secret = wire::digest_from_wire(entry.secret());
  if (!secret) return bad_input("join.secret: " + secret.error().message);
  if (entry.role() >= static_cast<std::uint32_t>(kRoles)) return bad_input("join.role is not known");
  return JoinEntry{AuthorId{entry.author()}, static_cast<MemberKind>(entry.kind()), entry.person(), *secret,
                   static_cast<Role>(entry.role())};
}

Result<What> read(const v1::Cut& entry) {
  Result<Cut> cut = wire::from_wire(entry);
  if (!cut) return tl::unexpected(cut.error());
  return CutEntry{std::move(*cut)};
}

Result<What> read(const v1::JournalRejection& entry) {
  const Result<Digest> bytes = wire::digest_from_wire(entry.digest());
  if (!bytes) return bad_input("rejection.digest: " + bytes.error().message);
  if (entry.reason() >= static_cast<std::uint32_t>(kRejections)) return bad_input("rejection.reason is not known");
  return RejectionEntry{AuthorId{entry.author()}, entry.author_seq(), *bytes, static_cast<Rejection>(entry.reason())};
}

Result<What> read(const v1::JournalSplit& entry) {
  SplitEntry split;
  split.parent = BodyId{entry.parent()};
  Result<Mask> taken = mask_of(entry.taken());
  if (!taken) return bad_input("split.taken: " + taken.error().message);
  split.taken = std::move(*taken);
  for (const v1::JournalPiece& one : entry.pieces()) {
    Result<Mask> left = mask_of(one.left());
    if (!left) return bad_input("split.pieces.left: " + left.error().message);
    const CoordBox reach{wire::from_wire(one.reach_min()), wire::from_wire(one.reach_max())};
    split.pieces.push_back({BodyId{one.body()}, reach, std::move(*left)});
  }
  return split;
}

Result<What> read(const v1::JournalItem& entry) {
  if (!entry.has_set()) return ItemEntry{entry.item(), std::nullopt};
  const Result<Pose> pose = pose_of(entry.pose_bone_item());
  if (!pose) return tl::unexpected(pose.error());
  v1::SceneItem set = entry.set();
  *set.mutable_pose_bone_item() = wire::to_wire(Pose{});
  Result<SceneItem> item = wire::from_wire(set);
  if (!item) return tl::unexpected(item.error());
  item->pose_bone_item = *pose;
  return ItemEntry{entry.item(), std::move(*item)};
}

Result<What> read(const v1::ToolDefinition& entry) {
  Result<Tool> tool = wire::from_wire(entry);
  if (!tool) return tl::unexpected(tool.error());
  return ToolEntry{std::move(*tool)};
}

Result<What> read(const v1::JournalSupervision& entry) {
  Result<Restrictions> set = wire::from_wire(entry.supervision());
  if (!set) return tl::unexpected(set.error());
  return SuperviseEntry{AuthorId{entry.subject()}, std::move(*set)};
}

Result<What> read(const v1::JournalAnnotation& entry) {
  if (!entry.has_drawn()) return AnnotationEntry{entry.annotation(), std::nullopt};
  Result<Annotation> drawn = wire::from_wire(entry.drawn());
  if (!drawn) return tl::unexpected(drawn.error());
  return AnnotationEntry{entry.annotation(), std::move(*drawn)};
}

Result<What> read(const v1::JournalEntry& entry) {
  switch (entry.what_case()) {
    case v1::JournalEntry::kJoin:
      return read(entry.join());
    case v1::JournalEntry::kCut:
      return read(entry.cut());
    case v1::JournalEntry::kRejection:
      return read(entry.rejection());
    case v1::JournalEntry::kSplit:
      return read(entry.split());
    case v1::JournalEntry::kUndo:
      return UndoEntry{seqs_of(entry.undo().room_seqs())};
    case v1::JournalEntry::kRedo:
      return RedoEntry{seqs_of(entry.redo().undos()), seqs_of(entry.redo().room_seqs())};
    case v1::JournalEntry::kRemoval:
      return RemoveBodyEntry{BodyId{entry.removal().body()}};
    case v1::JournalEntry::kItem:
      return read(entry.item());
    case v1::JournalEntry::kTool:
      return read(entry.tool());
    case v1::JournalEntry::kMark:
      return MarkEntry{entry.mark().label()};
    case v1::JournalEntry::kSupervision:
      return read(entry.supervision());
    case v1::JournalEntry::kAnnotation:
      return read(entry.annotation());
    case v1::JournalEntry::kWords:
      return WordsEntry{AuthorId{entry.words().to()}, entry.words().words()};
    case v1::JournalEntry::WHAT_NOT_SET:
      break;
  }
  return failure(ErrorCode::unsupported, "its event is of a kind that this release does not know");
}

}  // namespace

RoomGenesis genesis_of(const Room& room, std::string name) {
  RoomGenesis genesis;
  genesis.case_hash = room.bone().hash();
  genesis.kernel_version = kKernelVersion;
  for (const ToolBox::Entry* entry : room.tools()->entries()) genesis.tools.push_back(entry->tool);
  genesis.room_genesis = room.genesis();
  genesis.room = std::move(name);
  return genesis;
}

std::string to_bytes(const RoomGenesis& genesis) {
  v1::JournalGenesis out;
  out.set_version(kGenesisVersion);
  out.set_case_hash(wire::to_wire(genesis.case_hash));
  out.set_kernel_version(genesis.kernel_version);
  for (const Tool& tool : genesis.tools) *out.add_tools() = wire::to_wire(tool);
  out.set_room_genesis(wire::to_wire(genesis.room_genesis));
  out.set_room(genesis.room);
  out.set_parent(genesis.parent);
  out.set_parent_room_seq(genesis.parent_room_seq.value);
  if (!genesis.parent.empty()) out.set_parent_chain(wire::to_wire(genesis.parent_chain));
  return out.SerializeAsString();
}

Result<RoomGenesis> genesis_from_bytes(std::string_view bytes) {
  v1::JournalGenesis in;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return bad_input("the journal does not say what its room began as");
  if (in.version() != kGenesisVersion)
    return failure(ErrorCode::unsupported, "the journal is of version " + std::to_string(in.version()) +
                                               " and this release knows " + std::to_string(kGenesisVersion));
  RoomGenesis genesis;
  const Result<Digest> hash = wire::digest_from_wire(in.case_hash()), began = wire::digest_from_wire(in.room_genesis());
  if (!hash || !began) return bad_input("the journal does not name its case");
  genesis.case_hash = *hash;
  genesis.room_genesis = *began;
  genesis.kernel_version = in.kernel_version();
  for (const v1::ToolDefinition& tool : in.tools()) {
    Result<Tool> one = wire::from_wire(tool);
    if (!one) return bad_input("a tool of the journal: " + one.error().message);
    genesis.tools.push_back(std::move(*one));
  }
  genesis.room = in.room();
  genesis.parent = in.parent();
  genesis.parent_room_seq = RoomSeq{in.parent_room_seq()};
  if (const Result<Digest> chain = wire::digest_from_wire(in.parent_chain())) genesis.parent_chain = *chain;
  return genesis;
}

Result<Room> begin_room(const Case& bone, const RoomGenesis& genesis, const CutLimits& limits) {
  if (genesis.case_hash != bone.hash())
    return failure(ErrorCode::unsupported, "the journal is of the case " + to_hex(genesis.case_hash) + " and not of " +
                                               to_hex(bone.hash()) + "; start the server with that case");
  if (genesis.kernel_version != kKernelVersion)
    return failure(ErrorCode::unsupported, "the journal is of cut kernel version " +
                                               std::to_string(genesis.kernel_version) + " and this server's is " +
                                               std::to_string(kKernelVersion) +
                                               "; go on with the release that made it");
  // Not the server's own tool box: another release may have other tools.
  auto tools = std::make_shared<ToolBox>();
  for (const Tool& tool : genesis.tools) tools->add(tool);
  Room room(bone, limits, std::move(tools));
  if (room.genesis() != genesis.room_genesis)
    return bad_input("the journal's tools are not those that its room began with");
  return room;
}

std::string to_bytes(const LogEntry& entry) {
  v1::JournalEntry out;
  out.set_author(entry.author.value);
  if (const auto* cut = std::get_if<CutEntry>(&entry.what); cut && cut->encoded) {
    std::string bytes = out.SerializeAsString();
    wire::append_field(bytes, v1::JournalEntry::kCutFieldNumber, *cut->encoded);
    return bytes;
  }
  std::visit(Writer{out}, entry.what);
  return out.SerializeAsString();
}

Result<LogEntry> entry_from_bytes(RoomSeq seq, std::chrono::nanoseconds at, std::string_view bytes) {
  const auto in_entry = [&](const Error& error) {
    return failure(error.code, "entry " + std::to_string(seq.value) + ": " + error.message);
  };
  v1::JournalEntry in;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return in_entry({ErrorCode::invalid_input, "it is no entry of a room"});
  Result<What> what = read(in);
  if (!what) return in_entry(what.error());
  return LogEntry{seq, at, AuthorId{in.author()}, std::move(*what)};
}

Result<std::string> entry_as_json(RoomSeq seq, std::chrono::nanoseconds at, std::string_view bytes) {
  v1::JournalEntry in;
  std::string event;
  google::protobuf::util::JsonPrintOptions names;
  names.preserve_proto_field_names = true;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) ||
      !google::protobuf::util::MessageToJsonString(in, &event, names).ok())
    return bad_input("entry " + std::to_string(seq.value) + ": it is no entry of a room");
  return "{\"room_seq\":" + std::to_string(seq.value) +
         ",\"at_s\":" + std::to_string(std::chrono::duration<double>(at).count()) + ",\"event\":" + event + "}";
}

PersonExport::PersonExport(std::uint32_t person, const std::vector<Person>& people) : person_(person) {
  const std::string number = std::to_string(person);
  for (const Person& one : people)
    if (one.pseudonym == number)
      who_ = "{\"person\":" + number + ",\"label\":" + json_text(one.label) +
             ",\"joined_day\":" + std::to_string(one.joined_day) + "}";
}

Result<std::optional<std::string>> PersonExport::of(const JournalEntry& entry) {
  const std::chrono::nanoseconds at(entry.at_ns);
  const Result<LogEntry> read = entry_from_bytes(entry.seq, at, entry.bytes);
  if (!read) return tl::unexpected(read.error());
  const auto* join = std::get_if<JoinEntry>(&read->what);
  if (join != nullptr && join->person == person_) authors_.insert(join->author);
  const auto* cut = std::get_if<CutEntry>(&read->what);
  const auto* rejection = std::get_if<RejectionEntry>(&read->what);
  const AuthorId whose = join != nullptr        ? join->author
                         : cut != nullptr       ? cut->cut.author
                         : rejection != nullptr ? rejection->author
                                                : read->author;
  if (!authors_.contains(whose)) return std::nullopt;
  return entry_as_json(entry.seq, at, entry.bytes).map([](std::string line) { return std::optional(std::move(line)); });
}

tl::unexpected<Error> PersonExport::nobody() const {
  return failure(ErrorCode::not_found, "the journal has nothing of a person " + std::to_string(person_) +
                                           "; \"people\" lists those it knows");
}

}  // namespace osteon
