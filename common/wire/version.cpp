#include "common/wire/version.hpp"

#include <string>

namespace osteon::wire {
namespace {

// The version that introduced a kind of message. All before 4 know the first ten.
std::uint32_t version_of(v1::SessionResponse::MessageCase kind) {
  return kind > v1::SessionResponse::kNoted ? 4 : kOldestProtocolVersion;
}

// The sequence number of an event in the room. 0: the message is no event.
std::uint64_t room_seq_of(const v1::SessionResponse& row) {
  switch (row.message_case()) {
    case v1::SessionResponse::kSupervised:
      return row.supervised().room_seq();
    case v1::SessionResponse::kSaid:
      return row.said().room_seq();
    default:
      return 0;
  }
}

}  // namespace

Result<void> check_protocol_version(std::uint32_t clients) {
  if (clients >= kOldestProtocolVersion && clients <= kProtocolVersion) return {};
  const std::string versions = "the client speaks protocol version " + std::to_string(clients) +
                               " and the server protocol version " + std::to_string(kProtocolVersion) + ", or " +
                               std::to_string(kOldestProtocolVersion);
  return failure(ErrorCode::unsupported,
                 versions + (clients < kOldestProtocolVersion
                                 ? "; install a newer Osteon where the client runs"
                                 : "; install a newer Osteon where the server runs, before the clients"));
}

std::optional<v1::SessionResponse> entry_for_version(std::uint32_t version, const v1::SessionResponse& row) {
  if (version >= version_of(row.message_case())) return row;
  const std::uint64_t room_seq = room_seq_of(row);
  if (room_seq == 0) return std::nullopt;
  v1::SessionResponse noted;
  noted.mutable_noted()->set_room_seq(room_seq);
  noted.set_index(row.index());
  return noted;
}

}  // namespace osteon::wire
