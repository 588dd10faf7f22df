// What a room's events look like on their way to its members: serialised once, shared by all streams.
#pragma once
#include <vector>

#include "server/net/outbox.hpp"
#include "server/room/room.hpp"

namespace osteon {

// A whole WatchMeshResponse.
[[nodiscard]] Bytes block_message(const BlockKey& key, const StoredBlock& block);

// Whole SessionResponses.
[[nodiscard]] Bytes tool_row(RoomSeq place, const Tool& tool);
[[nodiscard]] Bytes scene_row(RoomSeq place, const std::vector<SceneItem>& items);
[[nodiscard]] MessageParts change_rows(const RoomEvent& event);  // at least one; each of a bounded size

}  // namespace osteon
