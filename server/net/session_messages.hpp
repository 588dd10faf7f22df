// Serialises a room's events as messages to its members: each once, shared by all streams.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/link/sealed.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "server/journal/chain.hpp"
#include "server/net/send_queue.hpp"
#include "server/room/room.hpp"

namespace osteon {

// A whole WatchMeshResponse.
[[nodiscard]] Bytes block_message(const BlockKey& key, const StoredBlock& block);

// Whole SessionResponses.
[[nodiscard]] Bytes cut_message(RoomSeq seq, const Cut& cut);
[[nodiscard]] Bytes rejection_message(RoomSeq seq, std::uint64_t author_seq, std::uint64_t lease_epoch,
                                      Rejection reason);
[[nodiscard]] Bytes link_message(const SessionKeys& keys, std::uint16_t udp_port);
[[nodiscard]] Bytes durable_message(const Witness& witness);
[[nodiscard]] Bytes redial_message(std::chrono::milliseconds after, const std::string& why);
[[nodiscard]] Bytes tool_message(RoomSeq seq, const Tool& tool, std::uint32_t number);
[[nodiscard]] Bytes scene_message(RoomSeq seq, const std::vector<SceneItem>& items);
// What an instructor has decided. `seq` null: what was valid before. `by`: who decided it, as far as known.
[[nodiscard]] Bytes supervised_message(RoomSeq seq, const Restrictions& supervision, std::uint64_t lease_epoch,
                                       const Decider& by);
[[nodiscard]] Bytes said_message(RoomSeq seq, AuthorId from, const WordsEntry& words);
[[nodiscard]] Bytes partner_entry(const CuttingState& state);
[[nodiscard]] Bytes bone_entry(const MountPose& seen);
[[nodiscard]] Bytes noted_entry(RoomSeq seq, const std::string& mark);
[[nodiscard]] MessageParts change_entries(const RoomEvent& event);  // at least one; each of bounded size

}  // namespace osteon
