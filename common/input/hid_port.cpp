#include "common/input/hid_port.hpp"

#include <hidapi/hidapi.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <cwchar>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace osteon {
namespace {

constexpr std::size_t kLargestReport = 64;

// Guards hidapi, whose enumeration and initialisation are not thread safe.
Mutex& library() {
  static Mutex mutex{LockRank::leaf};
  return mutex;
}

std::string narrow(const wchar_t* text) {
  std::string out;
  for (; text != nullptr && *text != 0; ++text) out += *text < 0x7f ? static_cast<char>(*text) : '?';
  return out;
}

}  // namespace

struct HidPort::Handle {
  hid_device* device = nullptr;
  std::string path, what;
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (device != nullptr) hid_close(device);
  }
};

std::vector<HidFound> list_hid_devices() {
  const MutexLock lock(library());
  std::vector<HidFound> found;
  hid_device_info* const list = hid_enumerate(0, 0);
  for (const hid_device_info* info = list; info != nullptr; info = info->next) {
    found.push_back({info->path == nullptr ? std::string() : info->path, narrow(info->product_string),
                     narrow(info->serial_number), info->vendor_id, info->product_id, info->usage_page, info->usage});
  }
  hid_free_enumeration(list);
  return found;
}

Error hid_open_error(const std::string& what, const std::string& path, int number) {
  const auto say = [](std::string sentence) { return Error{ErrorCode::unavailable, std::move(sentence)}; };
  switch (number) {
    case EACCES:
    case EPERM:
      return say("no permission to use " + what + " at " + path +
                 "; install deploy/udev/70-osteon-devices.rules and plug it in again");
    case ENOENT:
    case ENODEV:
    case ENOTTY:  // the node still exists for a moment, but not the device
    case ENXIO:
      return say(what + " at " + path + " was unplugged; plug it in again");
    case EBUSY:
      return say("another program uses " + what + " at " + path + "; end it");
    default:
      return say(what + " at " + path + " cannot be opened (" +
                 (number != 0 ? std::strerror(number) : "hidapi gives no reason") +
                 "); unplug it and plug it in again");
  }
}

HidPort::HidPort(std::unique_ptr<Handle> handle) noexcept : handle_(std::move(handle)) {}
HidPort::HidPort(HidPort&&) noexcept = default;
HidPort& HidPort::operator=(HidPort&&) noexcept = default;
HidPort::~HidPort() = default;

Result<HidPort> HidPort::open(const HidFound& found, std::string what) {
  const MutexLock lock(library());
  auto handle = std::make_unique<Handle>();
  handle->path = found.path;
  handle->what = std::move(what);
  errno = 0;
  handle->device = hid_open_path(found.path.c_str());
  if (handle->device == nullptr) return tl::unexpected(hid_open_error(handle->what, found.path, errno));
  return HidPort(std::move(handle));
}

Result<std::size_t> HidPort::read(std::span<std::uint8_t> into, std::chrono::milliseconds patience) {
  const int size = hid_read_timeout(handle_->device, into.data(), into.size(), static_cast<int>(patience.count()));
  if (size < 0) return failure(ErrorCode::unavailable, handle_->what + " was unplugged; plug it in again");
  return static_cast<std::size_t>(size);
}

Result<void> HidPort::write(std::span<const std::uint8_t> report) {
  if (hid_write(handle_->device, report.data(), report.size()) >= 0) return {};
  return failure(ErrorCode::unavailable,
                 handle_->what + " does not take what it is sent; unplug it and plug it in again");
}

std::vector<std::uint8_t> HidPort::descriptor() const {
  const auto node = std::filesystem::path(handle_->path).filename();
  std::ifstream in("/sys/class/hidraw/" + node.string() + "/device/report_descriptor", std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void HidReader::start(HidPort port, std::chrono::milliseconds pause, Calls calls) {
  stop();
  port_ = std::make_unique<HidPort>(std::move(port));
  calls_ = std::move(calls);
  stopping_ = false;
  ended_ = false;
  thread_ = std::thread([this, pause] { run(pause); });
}

void HidReader::stop() noexcept {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  port_.reset();
}

Result<void> HidReader::health() const {
  if (!ended_) return {};
  const MutexLock lock(mutex_);
  return tl::unexpected(why_ended_);
}

void HidReader::run(std::chrono::milliseconds pause) {
  std::array<std::uint8_t, kLargestReport> report{};
  while (!stopping_) {
    const Result<std::size_t> size = port_->read(report, pause);
    if (!size) {
      {
        const MutexLock lock(mutex_);
        why_ended_ = size.error();
      }
      if (calls_.at_end) calls_.at_end();
      ended_ = true;
      return;
    }
    calls_.take(std::span(report).first(*size));
  }
  if (calls_.before_close) calls_.before_close(*port_);
}

}  // namespace osteon
