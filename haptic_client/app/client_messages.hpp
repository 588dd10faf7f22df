// What the threads of the haptic client hand to each other besides the messages of the room.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/field/cut.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/tools/scene.hpp"
#include "haptic_client/contact/obstacle.hpp"
#include "haptic_client/net/room_messages.hpp"
#include "haptic_client/rendering/guidance_spring.hpp"

namespace osteon::haptic {

// A time of the monotonic clock, as every log of the session counts it.
[[nodiscard]] inline std::int64_t mono_ns(std::chrono::steady_clock::time_point at) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(at.time_since_epoch()).count();
}
[[nodiscard]] inline std::int64_t mono_ns() noexcept { return mono_ns(std::chrono::steady_clock::now()); }

// Others' tools, as last received.
struct Partners {
  static constexpr std::size_t kMost = 16;
  struct Partner {
    AuthorId author;  // null: none
    std::uint64_t state_seq = 0;
    Pose pose_bone_tool, pose_bone_device;
    std::int64_t received_ns = 0;
    std::size_t tool = 0;  // hash of its name
  };
  std::array<Partner, kMost> of;
};

// The solids of tools that others hold, by their names' hashes. They live as long as the client.
struct PartnerSolids {
  static constexpr std::size_t kMost = 32;
  std::array<std::pair<std::size_t, const SolidLattice*>, kMost> of{};
  std::size_t count = 0;
  [[nodiscard]] const SolidLattice* find(std::size_t tool) const noexcept {
    for (std::size_t i = 0; i < count; ++i)
      if (of[i].first == tool) return of[i].second;
    return nullptr;
  }
};

// What is known of the tool that guides this one; nothing: its author holds none.
[[nodiscard]] GuideSeen guide_among(const Partners& partners, AuthorId guide);

// Pose of the bone on its mount. Connections to the room are counted from 1.
struct MountUpdate {
  std::uint64_t line = 0;
  MountPose seen;
};

// Pose of the tool, for the replica's thread.
struct ToolPlace {
  Pose pose_bone_tool;
  int tool = 0;
  std::uint32_t step = 0;
  bool taken_up = false;
};

}  // namespace osteon::haptic
