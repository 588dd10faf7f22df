// Novint Falcon: its USB transfer, by libusb. Every function blocks, at most for its stated time. Only one thread at a
// time may use an object: the connection's thread until the device runs, then the device's I/O thread.
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
  // Opens the first Falcon on this machine that no other program uses. Errors: not_found, unavailable (in use, no
  // permission), internal.
  [[nodiscard]] static Result<FalconUsb> open();
  [[nodiscard]] static DeviceFinding look();
  FalconUsb(FalconUsb&&) noexcept;
  FalconUsb& operator=(FalconUsb&&) noexcept;
  ~FalconUsb();

  [[nodiscard]] const std::string& serial() const noexcept;

  // Sets up the connection for frames. True: firmware runs and answers one frame within `patience`. Error: unavailable.
  [[nodiscard]] Result<bool> runs(std::chrono::milliseconds patience);
  // Sends an image to the boot loader; runs() says whether it works. Errors: unavailable (no answer, or the device was
  // disconnected), unsupported (the device did not accept the image as it is).
  [[nodiscard]] Result<void> load(std::span<const std::uint8_t> image);

  // Sends one frame and returns the newest received one; empty when there was none within `patience`. Error:
  // unavailable (the device was disconnected or fails repeatedly).
  [[nodiscard]] Result<std::optional<FalconState>> exchange(const FalconCommand& command,
                                                            std::chrono::milliseconds patience);

  // The last call, for a process that ends: sends a frame without force; after it none is sent. Any thread, even in a
  // signal handler, whatever the other calls are doing.
  void stop_motors() noexcept;

 private:
  struct Wire;
  explicit FalconUsb(std::unique_ptr<Wire> wire) noexcept;
  std::unique_ptr<Wire> wire_;
};

}  // namespace osteon::haptic
