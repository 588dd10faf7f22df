#include "haptic_client/device/connection.hpp"

#include "haptic_client/device/emergency_stop.hpp"

namespace osteon::haptic {

DeviceConnection::DeviceConnection(HapticDevice& device, DeviceNotice notice, const ConnectionPace& pace)
    : device_(device), notice_(std::move(notice)), pace_(pace) {}

DeviceConnection::~DeviceConnection() { stop(); }

Result<void> DeviceConnection::start() {
  stop();
  if (Result<void> opened = device_.open(); !opened) return opened;
  connected_ = true;
  {
    const MutexLock lock(mutex_);
    stopping_ = false;
  }
  tell_advice();
  thread_ = std::thread([this] { keep(); });
  return {};
}

void DeviceConnection::stop() noexcept {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (connected_.exchange(false)) device_.close();
}

void DeviceConnection::tell_advice() {
  const std::string now = device_.advice();
  if (now == advice_) return;
  advice_ = now;
  if (now.empty())
    notice_(DeviceEvent::ready, device_.name(), "it is ready");
  else
    notice_(DeviceEvent::advice, device_.name(), now);
}

void DeviceConnection::keep() {
  std::string last_error;  // why it could not be reopened, so that the reason is reported once
  while (true) {
    {
      MutexLock lock(mutex_);
      if (wake_.wait_for(lock, connected_ ? pace_.tend : pace_.again,
                         [this]() OSTEON_REQUIRES(mutex_) { return stopping_; }))
        return;
    }
    // A device whose motors were stopped for good looks like a lost one.
    if (EmergencyStop::process_ends()) return;
    if (connected_) {
      const Result<void> well = device_.tend();
      if (well) {
        tell_advice();
        continue;
      }
      device_.close();
      connected_ = false;
      ++losses_;
      advice_.clear();
      last_error.clear();
      notice_(DeviceEvent::lost, device_.name(), well.error().message);
    } else {
      const Result<void> opened = device_.open();
      if (!opened) {
        if (opened.error().message != last_error && losses_ > 0)
          notice_(DeviceEvent::advice, device_.name(), last_error = opened.error().message);
        continue;
      }
      connected_ = true;
      notice_(DeviceEvent::back, device_.name(), "it is connected again");
      tell_advice();
    }
  }
}

}  // namespace osteon::haptic
