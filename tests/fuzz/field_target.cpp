#include "tests/fuzz/field_target.hpp"

#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/field.pb.h"
#include "tests/fuzz/calls_messages.hpp"
#include "tests/fuzz/samples.hpp"
#include "viewer_client/net/field_follower.hpp"

namespace osteon::fuzz {
namespace {

using Message = v1::WatchFieldResponse;

constexpr std::size_t kMostBytes = std::size_t{8} << 20;
std::uint64_t messages_taken = 0, messages_refused = 0;

// An input is messages, each after its length in two bytes.
Bytes joined(const std::vector<Message>& messages) {
  Bytes bytes;
  for (const Message& message : messages) {
    const std::string one = message.SerializeAsString();
    bytes.push_back(static_cast<std::uint8_t>(one.size() & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(one.size() >> 8));
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  return bytes;
}

std::vector<Message> parted(std::span<const std::uint8_t> bytes) {
  std::vector<Message> messages;
  while (bytes.size() >= 2) {
    const std::size_t size = std::min<std::size_t>(bytes[0] | bytes[1] << 8, bytes.size() - 2);
    Message message;
    if (message.ParseFromArray(bytes.data() + 2, static_cast<int>(size))) messages.push_back(std::move(message));
    bytes = bytes.subspan(2 + size);
  }
  return messages;
}

// A beginning with a leaf, then an event of each kind.
std::vector<Message> a_stream() {
  std::vector<Message> messages(7);
  *messages[0].mutable_tool()->mutable_tool() = wire::to_wire(builtin_tools()[0]);
  *messages[1].mutable_leaf() = wire::to_wire(FieldLeaf{{}, 1, {0, 0, -8}, std::vector<std::int16_t>(kLeafVoxels, 7)});
  messages[2].mutable_complete()->set_room_seq(5);
  messages[2].mutable_complete()->add_bodies(0);
  messages[3].mutable_committed()->set_room_seq(6);
  *messages[3].mutable_committed()->mutable_cut() = wire::to_wire(a_cut());
  messages[4].mutable_noted()->set_room_seq(7);
  for (const int part : {5, 6}) {
    v1::BoneChange& change = *messages[static_cast<std::size_t>(part)].mutable_change();
    change.set_room_seq(8);
    change.set_kind(v1::BONE_CHANGE_KIND_SPLIT);
    for (const std::uint32_t body : {0u, 1u}) change.add_bodies(body);
    *change.add_leaves() = wire::to_wire(FieldLeaf{BodyId{1}, part - 5, {0, -8, -8}, {3}});
    change.set_last(part == 6);
  }
  for (std::uint64_t i = 3; i < messages.size(); ++i) messages[i].set_index(i - 2);
  return messages;
}

void feed(FieldFollower& follower, const std::vector<Message>& messages) {
  follower.begin();
  for (const Message& message : messages) {
    const Result<void> taken = follower.take(message);
    ++(taken ? messages_taken : messages_refused);
    if (taken) OSTEON_CHECK(follower.bytes() <= kMostBytes);
    if (taken) continue;
    OSTEON_CHECK(!taken.error().message.empty());
    return;
  }
}

void run(std::span<const std::uint8_t> data) {
  static const std::vector<Message> sound = a_stream();
  static const Digest expected = [] {
    FieldFollower follower(served_bone(), kMostBytes);
    feed(follower, sound);
    OSTEON_CHECK(follower.follows() && follower.bone().bodies().size() == 2);
    return follower.bone().hash();
  }();
  FieldFollower follower(served_bone(), kMostBytes);
  feed(follower, parted(data));
  if (follower.whole()) OSTEON_CHECK(!follower.bone().bodies().empty());
  (void)follower.take_changes();
  feed(follower, sound);
  // Tools that were sent are kept, and may have taken all that there is.
  if (follower.bytes() > kMostBytes) return;
  OSTEON_CHECK(follower.follows());
  OSTEON_CHECK(follower.bone().hash() == expected);
}

void change(Bytes& input, std::mt19937& random) {
  std::vector<Message> messages = parted(input);
  if (messages.empty()) return;
  const std::size_t which = random() % messages.size();
  switch (random() % 6) {
    case 0:
      messages.erase(messages.begin() + static_cast<std::ptrdiff_t>(which));
      break;
    case 1:
      std::swap(messages[which], messages[random() % messages.size()]);
      break;
    case 2:
      messages.push_back(messages[which]);
      break;
    default:
      change_message(messages[which], random);
      break;
  }
  input = joined(messages);
}

}  // namespace

Target field_messages_target() {
  Target target{"field_messages", run, {joined(a_stream())}};
  target.mutations = 500;
  target.change = change;
  target.figures = [] {
    return "messages taken " + std::to_string(messages_taken) + ", refused " + std::to_string(messages_refused);
  };
  return target;
}

}  // namespace osteon::fuzz
