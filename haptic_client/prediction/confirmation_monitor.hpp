// Watches whether the room still confirms the cuts of this client. The amount of bone that only this client has removed
// must stay small. Then a slow or lost server cannot give much of it back.
#pragma once
#include <cstddef>
#include <cstdint>

namespace osteon::haptic {

enum class RoomHealth : std::uint8_t {
  follows,
  behind,  // too many own cuts are unconfirmed
  silent,  // nothing was received for a while although cuts are unconfirmed
  lost,    // silent for so long that waiting makes no sense
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
  static constexpr std::size_t kFewUnconfirmed = 256;  // cutting continues from here
  static constexpr double kSilence_s = 2.0;
  static constexpr double kLost_s = 20.0;  // the connection itself waits longer: common/wire/room_client.cpp

  // `any_received`: something was received from the room since the last call. `now_s`: time of a clock that never goes
  // back.
  RoomHealth update(double now_s, bool any_received, std::size_t unconfirmed) noexcept {
    if (any_received || unconfirmed == 0) waiting_since_s_ = now_s;
    const double silence_s = now_s - waiting_since_s_;
    behind_ = unconfirmed > (behind_ ? kFewUnconfirmed : kMostUnconfirmed);
    return silence_s > kLost_s      ? RoomHealth::lost
           : silence_s > kSilence_s ? RoomHealth::silent
           : behind_                ? RoomHealth::behind
                                    : RoomHealth::follows;
  }

 private:
  double waiting_since_s_ = 0;  // start of the present wait for a confirmation
  bool behind_ = false;
};

}  // namespace osteon::haptic
