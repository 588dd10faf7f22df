#include "common/wire/cut_run.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include "common/core/check.hpp"
#include "common/wire/convert.hpp"

namespace osteon::wire {
namespace {

void put_varint(std::string& out, std::uint64_t value) {
  for (; value >= 128; value >>= 7) out += static_cast<char>(value | 128);
  out += static_cast<char>(value);
}

std::uint64_t zigzag(std::int64_t value) {
  return static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63);
}
std::int64_t unzigzag(std::uint64_t value) { return static_cast<std::int64_t>(value >> 1 ^ (0 - (value & 1))); }

// Reads coded values. After the first fault every value is 0 and `good` is false.
struct Reader {
  std::string_view rest;
  bool good = true;

  std::uint8_t byte() {
    if (rest.empty()) good = false;
    if (!good) return 0;
    const auto value = static_cast<std::uint8_t>(rest.front());
    rest.remove_prefix(1);
    return value;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t next = byte();
      value |= static_cast<std::uint64_t>(next & 127) << shift;
      if (next < 128) return good ? value : 0;
    }
    good = false;
    return 0;
  }
};

// A pose as its seven numbers. Those of the rotation have 16 bits. All wrap around, so any pose can follow any other.
using Numbers = std::array<std::uint32_t, 7>;
constexpr std::size_t kPositions = 3;
constexpr std::uint8_t kSecondOrder = 128;

Numbers numbers_of(const QuantisedPose& pose) {
  Numbers out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<std::uint32_t>(pose.position[i]);
  for (std::size_t i = 0; i < 4; ++i) out[3 + i] = static_cast<std::uint16_t>(pose.rotation[i]);
  return out;
}

QuantisedPose pose_of(const Numbers& numbers) {
  QuantisedPose out;
  for (std::size_t i = 0; i < 3; ++i) out.position[i] = static_cast<std::int32_t>(numbers[i]);
  for (std::size_t i = 0; i < 4; ++i) out.rotation[i] = static_cast<std::int16_t>(numbers[3 + i]);
  return out;
}

// The signed difference a - b, with wrap-around.
std::int64_t difference(const Numbers& a, const Numbers& b, std::size_t i) {
  return i < kPositions ? static_cast<std::int32_t>(a[i] - b[i]) : static_cast<std::int16_t>(a[i] - b[i]);
}

Numbers moved(const Numbers& from, const Numbers& by) {
  Numbers out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = i < kPositions ? from[i] + by[i] : (from[i] + by[i]) & 0xffff;
  return out;
}

Numbers step(const Numbers& from, const Numbers& to) {
  Numbers out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint32_t>(difference(to, from, i));
  return out;
}

std::string coded_knot(const Numbers& knot, const Numbers& expected, std::uint8_t flag) {
  std::string out(1, '\0');
  for (std::size_t i = 0; i < knot.size(); ++i) {
    if (knot[i] == expected[i]) continue;
    flag = static_cast<std::uint8_t>(flag | 1u << i);
    put_varint(out, zigzag(difference(knot, expected, i)));
  }
  out[0] = static_cast<char>(flag);
  return out;
}

// `before`: the previous cut, which mostly has about the same time and speed.
void put_cut(std::string& out, const Cut& cut, const QuantisedPose& from, const Cut& before) {
  const bool own_first = cut.path.empty() || cut.path.front() != from;
  const bool own_time = cut.path_us != before.path_us, own_speed = cut.spindle_rpm != before.spindle_rpm;
  const std::size_t first = own_first ? 0 : 1;
  put_varint(out,
             (cut.path.size() - first) << 3 | (own_speed ? 4u : 0u) | (own_first ? 2u : 0u) | (own_time ? 1u : 0u));
  if (own_time) put_varint(out, cut.path_us);
  if (own_speed) put_varint(out, zigzag(std::int64_t{cut.spindle_rpm} - std::int64_t{before.spindle_rpm}));
  Numbers last = numbers_of(from), by{};
  for (std::size_t k = first; k < cut.path.size(); ++k) {
    const Numbers knot = numbers_of(cut.path[k]);
    const std::string plain = coded_knot(knot, last, 0), second = coded_knot(knot, moved(last, by), kSecondOrder);
    out += second.size() < plain.size() ? second : plain;
    by = step(last, knot);
    last = knot;
  }
}

// Appends to the path of `cut`, whose other fields are set. `cut.path_us` and `cut.spindle_rpm` are those of the
// previous cut.
bool get_cut(Reader& in, Cut& cut, const QuantisedPose& from) {
  const std::uint64_t what = in.varint();
  const std::uint64_t knots = what >> 3;
  if ((what & 1) != 0) {
    const std::uint64_t path_us = in.varint();
    if (path_us > std::numeric_limits<std::uint32_t>::max()) return false;
    cut.path_us = static_cast<std::uint32_t>(path_us);
  }
  if ((what & 4) != 0) {
    // An overflowing sum wraps around and gives no valid speed.
    const auto speed = static_cast<std::int64_t>(cut.spindle_rpm + static_cast<std::uint64_t>(unzigzag(in.varint())));
    if (speed < 0 || speed > std::numeric_limits<std::uint32_t>::max()) return false;
    cut.spindle_rpm = static_cast<std::uint32_t>(speed);
  }
  if ((what & 2) == 0) cut.path.push_back(from);
  Numbers last = numbers_of(from), by{};
  for (std::uint64_t k = 0; k < knots; ++k) {  // each takes at least one byte, so the size of the input limits them
    const std::uint8_t flag = in.byte();
    Numbers knot = (flag & kSecondOrder) != 0 ? moved(last, by) : last;
    for (std::size_t i = 0; i < knot.size(); ++i) {
      if ((flag >> i & 1) == 0) continue;
      const std::int64_t by_this = unzigzag(in.varint());
      const std::int64_t most = i < kPositions ? INT32_MAX : INT16_MAX;
      if (by_this > most || by_this < -most - 1) return false;
      knot[i] += static_cast<std::uint32_t>(by_this);
    }
    if (!in.good) return false;
    cut.path.push_back(pose_of(knot));
    by = step(last, knot);
    last = knot;
  }
  return in.good;
}

// Whether the cuts can be in one run: all fields that a run shares are equal.
bool same_run(const Cut& a, const Cut& b) {
  return a.author == b.author && a.lease_epoch == b.lease_epoch && a.body == b.body && a.tool == b.tool &&
         a.level == b.level;
}

RunState state_before(const Cut& first) {
  RunState state{first, first.path.empty() ? QuantisedPose{} : first.path.front()};
  state.last.path.clear();
  return state;
}

RunState state_after(const Cut& cut, const RunState& before) {
  RunState state{cut, cut.path.empty() ? before.pose : cut.path.back()};
  state.last.path.clear();
  return state;
}

v1::CutRun head_of(const Cut& cut, const RunState& before, const ToolNumbers& tools) {
  v1::CutRun head;
  head.set_author_seq(cut.author_seq);
  head.set_lease_epoch(cut.lease_epoch);
  head.set_body(cut.body.value);
  if (const auto number = tools.number_of(cut.tool))
    head.set_tool_number(*number);
  else
    head.set_tool_hash(to_wire(cut.tool));
  head.set_level(static_cast<std::uint32_t>(cut.level));
  head.set_spindle_rpm(before.last.spindle_rpm);
  for (const std::int32_t p : before.pose.position) head.add_start(p);
  for (const std::int16_t r : before.pose.rotation) head.add_start(r);
  head.set_path_us(before.last.path_us);
  return head;
}

// The state before a run's first cut. The fields of `last` are those of that cut.
Result<RunState> state_of(const v1::CutRun& head, AuthorId author, const ToolNumbers& tools) {
  RunState state;
  state.last.author = author;
  state.last.author_seq = head.author_seq();
  state.last.lease_epoch = head.lease_epoch();
  state.last.body = {head.body()};
  if (head.level() >= static_cast<std::uint32_t>(kLevels)) return bad_field("level", "must be 0, 1 or 2");
  state.last.level = static_cast<int>(head.level());
  state.last.spindle_rpm = head.spindle_rpm();
  state.last.path_us = head.path_us();
  if (head.start_size() != 7)
    return bad_field("start", "needs 7 numbers, this has " + std::to_string(head.start_size()));
  for (int i = 0; i < 3; ++i) state.pose.position[static_cast<std::size_t>(i)] = head.start(i);
  for (int i = 0; i < 4; ++i) {
    const std::int32_t r = head.start(3 + i);
    if (r != static_cast<std::int16_t>(r)) return bad_field("start", "has a rotation beyond 16 bits");
    state.pose.rotation[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(r);
  }
  if (head.tool_case() == v1::CutRun::kToolNumber) {
    const auto tool = tools.tool_of(head.tool_number());
    if (!tool)
      return failure(ErrorCode::not_found, "tool_number " + std::to_string(head.tool_number()) + " is not known yet");
    state.last.tool = *tool;
  } else {
    const auto tool = digest_from_wire(head.tool_hash());
    if (!tool) return bad_field("tool_hash:", tool.error().message);
    state.last.tool = *tool;
  }
  return state;
}

// The item of an entry that is not a cut. It is a part of a packet by itself.
SendItem piece_of(const SessionEntry& entry, std::uint64_t index) {
  v1::DownPacket packet;
  if (entry.kind == SessionEntryKind::rejected) {
    v1::RejectedEntry& out = *packet.add_rejected();
    out.set_index(index);
    out.set_room_seq(entry.room_seq.value);
    out.set_author_seq(entry.author_seq);
    out.set_reason(entry.reason);
    out.set_lease_epoch(entry.lease_epoch);
  } else if (entry.kind == SessionEntryKind::supervised) {
    v1::SupervisedEntry& out = *packet.add_supervised();
    out.set_index(index);
    out.set_room_seq(entry.room_seq.value);
    *out.mutable_supervision() = to_wire(entry.supervision);
    out.set_lease_epoch(entry.lease_epoch);
    out.set_decided_by(entry.by.author.value);
    out.set_decided_by_name(entry.by.name);
  } else {
    v1::StreamedEntry& out = *packet.add_streamed();
    out.set_index(index);
    out.set_room_seq(entry.room_seq.value);
  }
  return {packet.SerializeAsString(), {}, 0};
}

Result<void> entries_of_run(const v1::EntryRun& run, const ToolNumbers& tools, std::vector<IndexedEntry>& entries) {
  auto state = state_of(run.head(), AuthorId{run.author()}, tools);
  if (!state) return tl::unexpected(state.error());
  std::uint64_t index = run.index(), room_seq = run.room_seq();
  Reader in{run.entries()};
  if (in.rest.empty()) return bad_field("entries", "has none");
  for (bool first = true; !in.rest.empty(); first = false) {
    const std::uint64_t what = in.varint();
    const std::uint64_t index_step = (what >> 1) + 1;
    std::uint64_t room_step = index_step, author_step = 1;
    if ((what & 1) != 0) {
      room_step += static_cast<std::uint64_t>(unzigzag(in.varint()));
      author_step += in.varint();
    }
    if (!first) {
      index += index_step;
      room_seq += room_step;
      state->last.author_seq += author_step;
    }
    Cut cut = state->last;
    if (!get_cut(in, cut, state->pose)) return bad_field("entries", "is not a sequence of entries");
    state = state_after(cut, *state);
    entries.push_back({index, {.room_seq = {room_seq}, .kind = SessionEntryKind::committed, .cut = std::move(cut)}});
  }
  return {};
}

}  // namespace

void ToolNumbers::add(std::uint32_t number, const Digest& tool) {
  OSTEON_CHECK(number != 0);
  if (tools_.emplace(number, tool).second) numbers_.emplace(tool, number);
}

std::optional<std::uint32_t> ToolNumbers::number_of(const Digest& tool) const {
  const auto at = numbers_.find(tool);
  return at == numbers_.end() ? std::nullopt : std::optional(at->second);
}

std::optional<Digest> ToolNumbers::tool_of(std::uint32_t number) const {
  const auto at = tools_.find(number);
  return at == tools_.end() ? std::nullopt : std::optional(at->second);
}

bool CutSender::push(const Cut& cut) {
  OSTEON_CHECK(cut.author_seq == window_.next() && cut.level >= 0 && cut.level < kLevels && fits_a_packet(cut));
  const RunState before = state_ ? *state_ : state_before(cut);
  SendItem item;
  put_cut(item.bytes, cut, before.pose, before.last);
  item.head = head_of(cut, before, tools_).SerializeAsString();
  if (state_ && same_run(before.last, cut)) item.follows = cut.author_seq - 1;
  if (!window_.push(std::move(item))) return false;
  state_ = state_after(cut, before);
  return true;
}

bool EntrySender::push(const SessionEntry& entry) {
  const std::uint64_t index = window_.next();
  if (entry.kind != SessionEntryKind::committed) return window_.push(piece_of(entry, index)).has_value();
  const Cut& cut = entry.cut;
  OSTEON_CHECK(cut.level >= 0 && cut.level < kLevels && fits_a_packet(cut));
  const auto known = states_.find(cut.author);
  const RunState before = known != states_.end() ? known->second.run : state_before(cut);
  const bool follows = known != states_.end() && same_run(before.last, cut);
  SendItem item;
  if (follows) {
    item.follows = known->second.index;
    const std::uint64_t index_step = index - known->second.index, author_step = cut.author_seq - before.last.author_seq;
    const auto beside = static_cast<std::int64_t>(entry.room_seq.value - known->second.room_seq.value - index_step);
    const bool more = beside != 0 || author_step != 1;
    put_varint(item.bytes, (index_step - 1) << 1 | (more ? 1u : 0u));
    if (more) {
      put_varint(item.bytes, zigzag(beside));
      put_varint(item.bytes, author_step - 1);
    }
  } else {
    put_varint(item.bytes, 0);
  }
  put_cut(item.bytes, cut, before.pose, before.last);
  v1::EntryRun head;
  head.set_author(cut.author.value);
  head.set_index(index);
  head.set_room_seq(entry.room_seq.value);
  *head.mutable_head() = head_of(cut, before, tools_);
  item.head = head.SerializeAsString();
  if (!window_.push(std::move(item))) return false;
  states_[cut.author] = {state_after(cut, before), index, entry.room_seq};
  return true;
}

Result<std::vector<Cut>> cuts_of(const v1::CutRun& run, AuthorId author, const ToolNumbers& tools) {
  auto state = state_of(run, author, tools);
  if (!state) return tl::unexpected(state.error());
  std::vector<Cut> cuts;
  Reader in{run.cuts()};
  if (in.rest.empty()) return bad_field("cuts", "has none");
  while (!in.rest.empty()) {
    Cut cut = state->last;
    cut.author_seq = run.author_seq() + cuts.size();
    if (!get_cut(in, cut, state->pose)) return bad_field("cuts", "is not a sequence of cuts");
    state = state_after(cut, *state);
    cuts.push_back(std::move(cut));
  }
  return cuts;
}

Result<std::vector<IndexedEntry>> entries_of(const v1::DownPacket& packet, const ToolNumbers& tools,
                                             std::size_t* left_out) {
  std::vector<IndexedEntry> entries;
  for (const v1::EntryRun& run : packet.entries()) {
    const auto read = entries_of_run(run, tools, entries);
    if (read) continue;
    if (read.error().code != ErrorCode::not_found) return tl::unexpected(read.error());
    if (left_out != nullptr) ++*left_out;
  }
  for (const v1::RejectedEntry& entry : packet.rejected()) {
    entries.push_back({entry.index(),
                       {.room_seq = {entry.room_seq()},
                        .kind = SessionEntryKind::rejected,
                        .author_seq = entry.author_seq(),
                        .reason = entry.reason(),
                        .lease_epoch = entry.lease_epoch()}});
  }
  for (const v1::SupervisedEntry& entry : packet.supervised()) {
    Result<Restrictions> supervision = from_wire(entry.supervision());
    if (!supervision) return tl::unexpected(supervision.error());
    entries.push_back({entry.index(),
                       {.room_seq = {entry.room_seq()},
                        .kind = SessionEntryKind::supervised,
                        .lease_epoch = entry.lease_epoch(),
                        .supervision = std::move(*supervision),
                        .by = {AuthorId{entry.decided_by()}, entry.decided_by_name()}}});
  }
  for (const v1::StreamedEntry& entry : packet.streamed())
    entries.push_back({entry.index(), {.room_seq = {entry.room_seq()}}});
  std::ranges::sort(entries, {}, &IndexedEntry::index);
  return entries;
}

}  // namespace osteon::wire
