// Keeps a device connected, on a thread of its own. It opens and tends the device, closes it when it is lost, and opens
// it again when it is back. The haptic thread does not take part: it reads the device, which is absent during that
// time.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "common/core/mutex.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

enum class DeviceEvent : std::uint8_t { lost, back, advice, ready };
// Receives a sentence about a device, for a person. Called on the connection's thread.
using DeviceNotice = std::function<void(DeviceEvent event, std::string_view device, const std::string& sentence)>;

struct ConnectionPace {
  std::chrono::milliseconds tend{100};
  std::chrono::milliseconds again{500};  // between two attempts to open a lost device
};

class DeviceConnection {
 public:
  // The device must outlive the connection.
  DeviceConnection(HapticDevice& device, DeviceNotice notice, const ConnectionPace& pace = {});
  ~DeviceConnection();  // stops the thread and closes the device
  DeviceConnection(const DeviceConnection&) = delete;
  DeviceConnection& operator=(const DeviceConnection&) = delete;

  // Opens the device on the calling thread, so that its limits are known afterwards. Keeps it connected from then on.
  // Error: that of the device; nothing is kept connected then.
  [[nodiscard]] Result<void> start();
  void stop() noexcept;
  [[nodiscard]] bool connected() const noexcept { return connected_; }
  [[nodiscard]] int losses() const noexcept { return losses_; }

 private:
  void keep();
  void tell_advice();

  HapticDevice& device_;
  DeviceNotice notice_;
  ConnectionPace pace_;
  std::thread thread_;
  Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  bool stopping_ OSTEON_GUARDED_BY(mutex_) = false;
  std::atomic<bool> connected_{false};
  std::atomic<int> losses_{0};
  std::string advice_;  // reported last
};

}  // namespace osteon::haptic
