// The running haptic client: opens the room and the logs, and runs three workers on threads of their own. They share
// no lock with the haptic thread; data crosses by WorkerExchange.
#pragma once
#include <filesystem>

#include "common/runtime/stop_signal.hpp"
#include "haptic_client/app/client_outcome.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/net/room_session.hpp"

namespace osteon::haptic {

struct ClientOptions {
  std::filesystem::path session_log;
  std::filesystem::path record;  // HDF5
  // The recording that moves the handle; the room's bone must be as it was when the recording began.
  const RecordedDevice* played = nullptr;
  bool status = false;  // a line each second on standard output
};

// Runs a session to its end and waits until the room has confirmed every cut. When the server disappears or stops
// confirming, force and spindle are down by the end. The outcome then gives the reason (`lost`) and what was done until
// then. Error internal: a log or recording cannot be created; nothing was begun.
[[nodiscard]] Result<ClientOutcome> run_client(RoomSession& room, Session& session, const ClientOptions& options,
                                               const StopSignal& stop);

}  // namespace osteon::haptic
