// The USB of a machine for one test: a testbed served by osteon-usb-host. This process sees it through
// libumockdev-preload, with the real libusb and hidapi in between. All measurements here are of an emulation, never of
// a device.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.hpp"

namespace osteon::test {

// How long a test waits for what an emulated device must do.
inline constexpr std::chrono::seconds kPatience{20};

// Call it first in main(). Runs this program again under the preloaded library, unless it already is.
void enter_usb_emulation(char** argv);

class UsbStage {
 public:
  UsbStage();
  ~UsbStage();
  UsbStage(const UsbStage&) = delete;
  UsbStage& operator=(const UsbStage&) = delete;

  // Sends one command to osteon-usb-host (see there) and returns its answer. Fails the program if the host has died.
  std::string command(const std::string& line);

  struct Told {
    std::uint64_t frames = 0, bad_frames = 0, with_force = 0;
    std::array<int, 3> motors{};
    int control = 0;
    std::size_t image_bytes = 0;
    std::uint64_t transfers = 0;
  };
  [[nodiscard]] Told falcon_told();
  void report(const std::string& device, const std::vector<std::uint8_t>& bytes);

 private:
  std::unique_ptr<Process> host_;
};

// Made-up images: one that the emulated Falcon runs, and one that it accepts and then does not answer.
void write_running_image(const std::filesystem::path& file, std::size_t size);
void write_other_image(const std::filesystem::path& file, std::size_t size);

}  // namespace osteon::test
