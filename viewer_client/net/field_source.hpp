// The server as the source of a HeldBone.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>

#include "common/volume/case_cache.hpp"
#include "common/wire/room_client.hpp"
#include "viewer_client/net/held_bone.hpp"

namespace osteon {

struct FieldSourceOptions {
  std::function<wire::JoinedRoom()> room;  // newest join of the viewer, whose author asks; any thread
  std::filesystem::path cache = default_case_cache();
  // A restarted server refuses an author that it no longer knows. The viewer joins again meanwhile.
  std::chrono::milliseconds patience{5000};
};

[[nodiscard]] std::unique_ptr<FieldSource> field_of_server(FieldSourceOptions options);

}  // namespace osteon
