// Whether the room follows what this client cuts. Bone that only this client has seen go must stay little, so that a
// server that is slow or gone cannot take much of it back.
#pragma once
#include <cstddef>
#include <cstdint>

namespace osteon::haptic {

enum class RoomHealth : std::uint8_t {
  follows,
  behind,  // too many own cuts are unconfirmed
  silent,  // nothing has come for a while although cuts are unconfirmed
  lost,    // and for so long that waiting makes no sense
};

[[nodiscard]] inline const char* name(RoomHealth health) {
  switch (health) {
    case RoomHealth::follows:
      return "the server follows";
    case RoomHealth::behind:
      return "the server is behind";
    case RoomHealth::silent:
      return "the server is silent";
    case RoomHealth::lost:
      return "the server is lost";
  }
  return "unknown";
}

class ConfirmationMonitor {
 public:
  static constexpr std::size_t kMostUnconfirmed = 512;
  static constexpr std::size_t kFewUnconfirmed = 256;  // cutting goes on from here
  static constexpr double kSilence_s = 2.0;
  static constexpr double kLost_s = 20.0;  // its connection waits longer: common/wire/room_client.cpp

  // `heard`: something has come from the room since the last call. `now_s`: of a clock that never goes back.
  RoomHealth update(double now_s, bool heard, std::size_t unconfirmed) noexcept {
    if (heard || unconfirmed == 0) waiting_since_s_ = now_s;
    const double silence_s = now_s - waiting_since_s_;
    behind_ = unconfirmed > (behind_ ? kFewUnconfirmed : kMostUnconfirmed);
    return silence_s > kLost_s      ? RoomHealth::lost
           : silence_s > kSilence_s ? RoomHealth::silent
           : behind_                ? RoomHealth::behind
                                    : RoomHealth::follows;
  }

 private:
  double waiting_since_s_ = 0;  // for an answer to what is unconfirmed
  bool behind_ = false;
};

}  // namespace osteon::haptic
