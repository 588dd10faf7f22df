// A machine's USB for one test: a testbed played by osteon-usb-host, seen by this process through libumockdev-preload,
// with the real libusb and hidapi in between. What is measured here is emulated, never a device.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.hpp"

namespace osteon::test {

// First in main(): runs this program again under the preloaded library unless it is already.
void enter_usb_emulation(char** argv);

class UsbStage {
 public:
  UsbStage();
  ~UsbStage();
  UsbStage(const UsbStage&) = delete;
  UsbStage& operator=(const UsbStage&) = delete;

  // One command of osteon-usb-host (see there); its answer. Fails the program when the host has died.
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

// Made-up images: one that the emulated Falcon runs, one that it takes and that then says nothing.
void write_running_image(const std::filesystem::path& file, std::size_t size);
void write_other_image(const std::filesystem::path& file, std::size_t size);

}  // namespace osteon::test
