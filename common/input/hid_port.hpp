// HID devices by hidapi: lists them, opens one, and reads it on a thread.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"

namespace osteon {

struct HidFound {
  std::string path, product, serial;
  std::uint16_t vendor = 0, model = 0;      // USB ids
  std::uint16_t usage_page = 0, usage = 0;  // of the collection: 1/8 a multi-axis controller, 1/4 a joystick
};

// Any thread.
[[nodiscard]] std::vector<HidFound> list_hid_devices();

// The error for a device that could not be opened, by the system's error number (errno). `what` and `path` name the
// device. Unavailable.
[[nodiscard]] Error hid_open_error(const std::string& what, const std::string& path, int number);

class HidPort {
 public:
  // `what` names the device in messages, e.g. "the SpaceMouse". Error: unavailable.
  [[nodiscard]] static Result<HidPort> open(const HidFound& found, std::string what);
  HidPort(HidPort&&) noexcept;
  HidPort& operator=(HidPort&&) noexcept;
  ~HidPort();

  // The next report. 0 bytes if there is none within `patience`. Error: unavailable (the device was removed).
  [[nodiscard]] Result<std::size_t> read(std::span<std::uint8_t> into, std::chrono::milliseconds patience);
  // Sends an output report, id first. Error: unavailable.
  [[nodiscard]] Result<void> write(std::span<const std::uint8_t> report);
  // The report descriptor of the device. Empty if the system does not provide it.
  [[nodiscard]] std::vector<std::uint8_t> descriptor() const;

 private:
  struct Handle;
  explicit HidPort(std::unique_ptr<Handle> handle) noexcept;
  std::unique_ptr<Handle> handle_;
};

// Reads a port on a thread of its own.
class HidReader {
 public:
  // Called on the reading thread with each report, and with an empty one after each pause without a report.
  using Take = std::function<void(std::span<const std::uint8_t>)>;
  ~HidReader() { stop(); }

  // `at_end` is called on the reading thread when the device was removed. `before_close` is called there when the
  // reader is stopped and the device still exists.
  struct Calls {
    Take take;
    std::function<void()> at_end;
    std::function<void(HidPort&)> before_close;
  };
  void start(HidPort port, std::chrono::milliseconds pause, Calls calls);
  void stop() noexcept;
  // The error that ended the reading, if it ended by itself.
  [[nodiscard]] Result<void> health() const;

 private:
  void run(std::chrono::milliseconds pause);

  std::unique_ptr<HidPort> port_;
  Calls calls_;
  std::thread thread_;
  std::atomic<bool> stopping_{false}, ended_{false};
  mutable Mutex mutex_{LockRank::leaf};
  Error why_ended_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
