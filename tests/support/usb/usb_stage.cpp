#include "tests/support/usb/usb_stage.hpp"

#include <sys/prctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>

#include "tests/support/usb/falcon_model.hpp"

namespace osteon::test {
namespace {

constexpr const char* kLibrary = "libumockdev-preload.so.0";

void write_image(const std::filesystem::path& file, std::string_view beginning, std::size_t size) {
  std::string image(beginning);
  // Every byte value, in an order that does not repeat with the chunks in which it is sent.
  for (std::size_t i = image.size(); i < size; ++i) image += static_cast<char>((i * 7 + i / 251) & 0xff);
  std::ofstream(file, std::ios::binary) << image;
}

}  // namespace

void enter_usb_emulation(char** argv) {
  const char* now = std::getenv("LD_PRELOAD");
  if (now != nullptr && std::string_view(now).find("umockdev") != std::string_view::npos) return;
  setenv("LD_PRELOAD", (std::string(kLibrary) + (now != nullptr && *now != 0 ? std::string(":") + now : "")).c_str(),
         1);
  // A sanitizer wants to be the first library. It works as well behind this one.
  const char* options = std::getenv("ASAN_OPTIONS");
  setenv("ASAN_OPTIONS", (std::string(options != nullptr ? options : "") + ":verify_asan_link_order=0").c_str(), 1);
  unsetenv("UMOCKDEV_DIR");
  // The library sleeps for "0 µs" after every call. The real duration is the timer's slack.
  prctl(PR_SET_TIMERSLACK, 1);
  execv("/proc/self/exe", argv);
  std::perror("execv");
  std::exit(2);
}

UsbStage::UsbStage() {
  ProcessOptions options;
  options.without = {"LD_PRELOAD", "UMOCKDEV_DIR"};
  host_ = std::make_unique<Process>(program("osteon-usb-host"), std::vector<std::string>{}, options);
  const std::optional<std::string> root = host_->read_line(kPatience);
  if (!root) {
    std::fprintf(stderr, "osteon-usb-host does not start: %s\n", host_->err().c_str());
    std::abort();
  }
  setenv("UMOCKDEV_DIR", root->c_str(), 1);
}

UsbStage::~UsbStage() {
  unsetenv("UMOCKDEV_DIR");
  host_->close_input();
  (void)host_->wait(kPatience);
}

std::string UsbStage::command(const std::string& line) {
  host_->write(line + "\n");
  std::optional<std::string> answer = host_->read_line(kPatience);
  if (!answer) {
    const int code = host_->wait(kPatience).value_or(-1);
    std::fprintf(stderr, "osteon-usb-host has died (%d) after \"%s\": %s\n", code, line.c_str(), host_->err().c_str());
    std::abort();
  }
  return *answer;
}

UsbStage::Told UsbStage::falcon_told() {
  Told told;
  std::istringstream words(command("falcon told"));
  words >> told.frames >> told.bad_frames >> told.with_force >> told.motors[0] >> told.motors[1] >> told.motors[2] >>
      told.control >> told.image_bytes >> told.transfers;
  return told;
}

void UsbStage::report(const std::string& device, const std::vector<std::uint8_t>& bytes) {
  std::ostringstream line;
  line << "report " << device << std::hex;
  for (const std::uint8_t byte : bytes) line << ' ' << static_cast<int>(byte);
  command(line.str());
}

void write_running_image(const std::filesystem::path& file, std::size_t size) {
  write_image(file, kRunningImage, size);
}
void write_other_image(const std::filesystem::path& file, std::size_t size) {
  write_image(file, "another device's firmware", size);
}

}  // namespace osteon::test
