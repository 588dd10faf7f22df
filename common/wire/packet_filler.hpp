// Fills a packet of the fast path up to a number of bytes: first what must go, then items, then what may wait.
#pragma once
#include <chrono>
#include <cstddef>
#include <string>

#include "common/link/send_window.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// Bytes of a run beside its head and items: two tags and two lengths below 16 KiB. For
// SendWindowLimits::bytes_per_head.
inline constexpr std::size_t kRunBytes = 6;

// Parts of a packet may be concatenated byte by byte, so each part is added if it fits. `Packet`: v1::UpPacket or
// v1::DownPacket.
template <class Packet>
class PacketFiller {
 public:
  // `most_bytes`: largest plain packet, before sealing.
  explicit PacketFiller(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  // Adds a packet with only some fields set. False, with nothing added, if it does not fit. A nested message must not
  // be in two parts, because they would be merged. Repeated fields may be.
  bool add(const Packet& part);
  // Adds the items that the window picks for the room that is left.
  SendWindow::Picked add_items(SendWindow& window, SendWindow::Time now, int repeats);

  [[nodiscard]] std::size_t room() const { return most_bytes_ - bytes_.size(); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }  // call once

 private:
  std::size_t most_bytes_;
  std::string bytes_;
};

extern template class PacketFiller<v1::UpPacket>;
extern template class PacketFiller<v1::DownPacket>;

}  // namespace osteon::wire
