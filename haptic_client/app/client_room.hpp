// The room as the threads of a haptic client see it. Its members live as long as the client.
#pragma once
#include <cstdint>
#include <memory>

#include "common/core/id.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/case.hpp"
#include "haptic_client/net/room_port.hpp"

namespace osteon::haptic {

struct ClientRoom {
  RoomPort& port;
  const Case& bone;
  std::shared_ptr<const ToolBox> tools;  // known to the room; grows with its events
  AuthorId author;                       // of all cuts and states
  std::uint64_t lease_epoch = 0;         // when the client joined
};

}  // namespace osteon::haptic
