// Novint Falcon: its wire, by libusb. Everything here blocks, within its stated patience, and belongs to one thread at
// a time: the connection's until the device runs, then the device's I/O thread.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/core/result.hpp"
#include "haptic_client/device/falcon_frames.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

class FalconUsb {
 public:
  // The first Falcon on this machine that no other program has. Errors: not_found, unavailable (in use, no permission),
  // internal.
  [[nodiscard]] static Result<FalconUsb> open();
  [[nodiscard]] static DeviceFinding look();
  FalconUsb(FalconUsb&&) noexcept;
  FalconUsb& operator=(FalconUsb&&) noexcept;
  ~FalconUsb();

  [[nodiscard]] const std::string& serial() const noexcept;

  // Sets the wire for frames; true when firmware runs and answers one within `patience`. Error: unavailable.
  [[nodiscard]] Result<bool> runs(std::chrono::milliseconds patience);
  // Hands the boot loader an image; runs() tells whether it works. Errors: unavailable (no answer, or it went away),
  // unsupported (the device did not take the image as it is).
  [[nodiscard]] Result<void> load(std::span<const std::uint8_t> image);

  // One frame out and the newest one back; empty when there was none within `patience`. Error: unavailable (it went
  // away or fails again and again).
  [[nodiscard]] Result<std::optional<FalconState>> exchange(const FalconCommand& command,
                                                            std::chrono::milliseconds patience);

  // The last of all, for a process that ends: sends a frame without force, and after it none goes out. Any thread, also
  // in a signal's handler, whatever the other calls are doing.
  void stop_motors() noexcept;

 private:
  struct Wire;
  explicit FalconUsb(std::unique_ptr<Wire> wire) noexcept;
  std::unique_ptr<Wire> wire_;
};

}  // namespace osteon::haptic
