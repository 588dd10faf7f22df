#include "haptic_client/device/falcon_usb.hpp"

#include <libusb.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::uint16_t kVendor = 0x0403, kProduct = 0xcb48;
constexpr std::uint8_t kOut = 0x02, kIn = 0x81, kSettingType = 0x40;
constexpr int kInterface = 0;
constexpr std::size_t kPacket = 64;
constexpr milliseconds kSettingPatience = 500ms, kAnswerPatience = 50ms, kEchoPatience = 1000ms,
                       kCancelPatience = 500ms;
constexpr milliseconds kStopPatience = 100ms;
constexpr int kFailuresInARow = 3;  // of transfers; then the device counts as lost
constexpr const char* kReplug = "unplug it, switch its power off and on, and plug it in again";

tl::unexpected<Error> unavailable(std::string message) { return failure(ErrorCode::unavailable, std::move(message)); }

tl::unexpected<Error> went_wrong(const std::string& doing, int code) {
  if (code == LIBUSB_ERROR_NO_DEVICE) return unavailable("the Falcon was unplugged; plug it in again");
  return unavailable(doing + " the Falcon failed (" + libusb_error_name(code) + "); " + kReplug);
}

unsigned in_ms(milliseconds patience) { return static_cast<unsigned>(std::max<std::int64_t>(1, patience.count())); }

struct DeviceList {
  explicit DeviceList(libusb_context* context) { count = libusb_get_device_list(context, &list); }
  ~DeviceList() {
    if (count >= 0) libusb_free_device_list(list, 1);
  }
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;

  libusb_device** list = nullptr;
  ssize_t count = 0;
};

bool is_falcon(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  return libusb_get_device_descriptor(device, &descriptor) == 0 && descriptor.idVendor == kVendor &&
         descriptor.idProduct == kProduct;
}

std::string place_of(libusb_device* device) {
  return "USB bus " + std::to_string(libusb_get_bus_number(device)) + ", device " +
         std::to_string(libusb_get_device_address(device));
}

std::string serial_of(libusb_device* device, libusb_device_handle* handle) {
  libusb_device_descriptor descriptor{};
  std::array<unsigned char, 128> text{};
  if (libusb_get_device_descriptor(device, &descriptor) != 0 || descriptor.iSerialNumber == 0) return {};
  const int size =
      libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text.data(), static_cast<int>(text.size()));
  return size > 0 ? std::string(reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(size))
                  : std::string();
}

// A transfer that is submitted repeatedly.
struct Transfer {
  libusb_transfer* raw = nullptr;
  std::array<std::uint8_t, kPacket> bytes{};
  bool pending = false;

  static void LIBUSB_CALL done(libusb_transfer* transfer) {
    static_cast<Transfer*>(transfer->user_data)->pending = false;
  }

  int submit(libusb_device_handle* handle, std::uint8_t endpoint, std::size_t size) {
    libusb_fill_bulk_transfer(raw, handle, endpoint, bytes.data(), static_cast<int>(size), &done, this, 0);
    const int code = libusb_submit_transfer(raw);
    pending = code == 0;
    return code;
  }
};

int code_of(libusb_transfer_status status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return 0;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return LIBUSB_ERROR_NO_DEVICE;
    case LIBUSB_TRANSFER_STALL:
      return LIBUSB_ERROR_PIPE;
    case LIBUSB_TRANSFER_OVERFLOW:
      return LIBUSB_ERROR_OVERFLOW;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return LIBUSB_ERROR_TIMEOUT;
    default:
      return LIBUSB_ERROR_IO;
  }
}

}  // namespace

struct FalconUsb::Wire {
  libusb_context* context = nullptr;
  libusb_device_handle* handle = nullptr;
  int node = -1;  // the device's file, libusb's own; -1: unknown
  FalconFrame without_force = encode(FalconCommand{});
  std::atomic<bool> stopped{false};  // no frame is sent any more
  Transfer out, in;
  FalconFrameReader reader;
  std::string serial;
  int failures = 0;

  Wire() {
    out.raw = libusb_alloc_transfer(0);
    in.raw = libusb_alloc_transfer(0);
  }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  ~Wire() {
    if (handle != nullptr) {
      cancel();
      libusb_release_interface(handle, kInterface);
      libusb_close(handle);
    }
    libusb_free_transfer(out.raw);
    libusb_free_transfer(in.raw);
    if (context != nullptr) libusb_exit(context);
  }

  void handle_events(milliseconds patience) {
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(patience).count();
    timeval wait{static_cast<time_t>(us / 1000000), static_cast<suseconds_t>(us % 1000000)};
    libusb_handle_events_timeout_completed(context, &wait, nullptr);
  }

  // libusb waits for several files. The device's file is the only one that it waits to write to.
  void find_node() {
    const libusb_pollfd** files = libusb_get_pollfds(context);
    for (const libusb_pollfd** file = files; file != nullptr && *file != nullptr; ++file)
      if ((*file)->events & POLLOUT) node = (*file)->fd;
    libusb_free_pollfds(files);
  }

  // No transfer may be under way when its memory is freed.
  void cancel() {
    for (Transfer* transfer : {&out, &in})
      if (transfer->pending) libusb_cancel_transfer(transfer->raw);
    const auto deadline = Clock::now() + kCancelPatience;
    while ((out.pending || in.pending) && Clock::now() < deadline) handle_events(20ms);
  }

  Result<void> set(std::span<const FalconSetting> settings) {
    for (const FalconSetting& setting : settings) {
      const int code = libusb_control_transfer(handle, kSettingType, setting.request, setting.value, 0, nullptr, 0,
                                               in_ms(kSettingPatience));
      if (code < 0) return went_wrong("setting", code);
    }
    return {};
  }

  Result<void> send(std::span<const std::uint8_t> bytes) {
    std::array<std::uint8_t, kPacket> copy{};
    std::copy(bytes.begin(), bytes.end(), copy.begin());
    int sent = 0;
    const int code =
        libusb_bulk_transfer(handle, kOut, copy.data(), static_cast<int>(bytes.size()), &sent, in_ms(kEchoPatience));
    if (code < 0) return went_wrong("writing to", code);
    if (sent != static_cast<int>(bytes.size()))
      return unavailable(std::string("the Falcon took only a part of what was sent; ") + kReplug);
    return {};
  }

  // Up to `most` bytes of data within `patience`; fewer when the device sends no more.
  Result<std::size_t> receive(std::span<std::uint8_t> into, milliseconds patience) {
    const auto deadline = Clock::now() + patience;
    std::size_t have = 0;
    while (have < into.size()) {
      const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now());
      if (left <= 0ms) break;
      std::array<std::uint8_t, kPacket> packet{};
      int size = 0;
      const int code =
          libusb_bulk_transfer(handle, kIn, packet.data(), static_cast<int>(packet.size()), &size, in_ms(left));
      if (code < 0 && code != LIBUSB_ERROR_TIMEOUT) return went_wrong("reading from", code);
      const auto data = without_modem_status(std::span(packet).first(static_cast<std::size_t>(size)));
      const std::size_t taken = std::min(data.size(), into.size() - have);
      std::copy_n(data.begin(), taken, into.begin() + static_cast<std::ptrdiff_t>(have));
      have += taken;
    }
    return have;
  }

  // An occasional failed transfer is the cable's fault. Several without a frame in between, or a disconnected device,
  // are reported.
  Result<void> check(const std::string& doing, int code) {
    if (code == 0) return {};
    if (code == LIBUSB_ERROR_PIPE) {
      libusb_clear_halt(handle, kOut);
      libusb_clear_halt(handle, kIn);
    }
    if (code == LIBUSB_ERROR_NO_DEVICE || ++failures >= kFailuresInARow) return went_wrong(doing, code);
    return {};
  }
};

FalconUsb::FalconUsb(std::unique_ptr<Wire> wire) noexcept : wire_(std::move(wire)) {}
FalconUsb::FalconUsb(FalconUsb&&) noexcept = default;
FalconUsb& FalconUsb::operator=(FalconUsb&&) noexcept = default;
FalconUsb::~FalconUsb() = default;

const std::string& FalconUsb::serial() const noexcept { return wire_->serial; }

// Bypasses libusb, whose locks the crashed thread may hold. The kernel's own synchronous transfer is one system call,
// which a handler may make. It queues behind transfers under way. The I/O thread may be submitting a frame between the
// flag and the first transfer; the second transfer comes after that frame too.
void FalconUsb::stop_motors() noexcept {
  Wire& wire = *wire_;
  wire.stopped = true;
  for (int i = 0; i < 2 && wire.node >= 0; ++i) {
    usbdevfs_bulktransfer transfer{kOut, static_cast<unsigned>(wire.without_force.size()), in_ms(kStopPatience),
                                   wire.without_force.data()};
    (void)::ioctl(wire.node, USBDEVFS_BULK, &transfer);
  }
}

Result<FalconUsb> FalconUsb::open() {
  auto wire = std::make_unique<Wire>();
  if (wire->out.raw == nullptr || wire->in.raw == nullptr)
    return failure(ErrorCode::internal, "libusb has no memory for its transfers");
  if (const int code = libusb_init(&wire->context); code != 0) {
    wire->context = nullptr;
    return failure(ErrorCode::internal, std::string("libusb does not start (") + libusb_error_name(code) +
                                            "); is this machine's USB in order?");
  }
  const DeviceList devices(wire->context);
  int why = LIBUSB_ERROR_NOT_FOUND;
  std::string where;
  for (ssize_t i = 0; i < devices.count; ++i) {
    libusb_device* device = devices.list[i];
    if (!is_falcon(device)) continue;
    where = place_of(device);
    why = libusb_open(device, &wire->handle);
    if (why != 0) {
      wire->handle = nullptr;
      continue;
    }
    libusb_set_auto_detach_kernel_driver(wire->handle, 1);
    why = libusb_claim_interface(wire->handle, kInterface);
    if (why == 0) {
      wire->serial = serial_of(device, wire->handle);
      wire->find_node();
      return FalconUsb(std::move(wire));
    }
    libusb_close(wire->handle);
    wire->handle = nullptr;
  }
  if (where.empty())
    return failure(ErrorCode::not_found, "no Novint Falcon is there; plug it in and switch its power on");
  if (why == LIBUSB_ERROR_ACCESS)
    return unavailable("no permission to use the Falcon at " + where +
                       "; install deploy/udev/70-osteon-devices.rules and plug it in again");
  if (why == LIBUSB_ERROR_BUSY) return unavailable("another program uses the Falcon at " + where + "; end it");
  return went_wrong("opening", why);
}

DeviceFinding FalconUsb::look() {
  DeviceFinding finding;
  libusb_context* context = nullptr;
  if (const int code = libusb_init(&context); code != 0) {
    finding.missing =
        std::string("libusb does not start (") + libusb_error_name(code) + "); is this machine's USB in order?";
    return finding;
  }
  {
    const DeviceList devices(context);
    for (ssize_t i = 0; i < devices.count; ++i)
      if (is_falcon(devices.list[i])) finding.found.push_back("Novint Falcon, " + place_of(devices.list[i]));
  }
  libusb_exit(context);
  return finding;
}

Result<bool> FalconUsb::runs(milliseconds patience) {
  if (Result<void> set = wire_->set(falcon_running_settings()); !set) return tl::unexpected(set.error());
  wire_->reader.reset();
  const auto deadline = Clock::now() + patience;
  do {
    // Without force or homing: a frame that firmware in any state may receive.
    const Result<std::optional<FalconState>> state = exchange({}, kAnswerPatience);
    if (!state) return tl::unexpected(state.error());
    if (state->has_value()) return true;
  } while (Clock::now() < deadline);
  return false;
}

Result<void> FalconUsb::load(std::span<const std::uint8_t> image) {
  Wire& wire = *wire_;
  wire.cancel();  // the answer to a frame that no firmware has received
  if (Result<void> set = wire.set(falcon_greeting_settings()); !set) return set;
  bool greeted = false;
  for (int i = 0; i < kFalconGreetings && !greeted; ++i) {
    if (Result<void> sent = wire.send(kFalconGreeting); !sent) return sent;
    // Some systems send a zero byte before the answer.
    std::array<std::uint8_t, kFalconGreetingAnswer.size() + 1> answer{};
    const Result<std::size_t> size = wire.receive(answer, kAnswerPatience);
    if (!size) return tl::unexpected(size.error());
    const auto bytes = std::span(answer).first(*size);
    const auto reply = bytes.subspan(!bytes.empty() && bytes[0] == 0 ? 1 : 0);
    greeted = std::equal(reply.begin(), reply.end(), kFalconGreetingAnswer.begin(), kFalconGreetingAnswer.end());
  }
  if (!greeted) return unavailable(std::string("the Falcon's boot loader does not answer; ") + kReplug);

  if (Result<void> set = wire.set(falcon_loading_settings()); !set) return set;
  if (Result<void> sent = wire.send(std::span(&kFalconReady, 1)); !sent) return sent;
  std::uint8_t ready = 0;
  const Result<std::size_t> echoed = wire.receive(std::span(&ready, 1), kEchoPatience);
  if (!echoed) return tl::unexpected(echoed.error());
  if (*echoed != 1 || ready != kFalconReady)
    return unavailable(std::string("the Falcon is not ready for its firmware; ") + kReplug);

  for (std::size_t at = 0; at < image.size(); at += kFalconPiece) {
    const auto piece = image.subspan(at, std::min(kFalconPiece, image.size() - at));
    if (Result<void> sent = wire.send(piece); !sent) return sent;
    std::array<std::uint8_t, kFalconPiece> echo{};
    const Result<std::size_t> size = wire.receive(std::span(echo).first(piece.size()), kEchoPatience);
    if (!size) return tl::unexpected(size.error());
    if (*size != piece.size() || !std::equal(piece.begin(), piece.end(), echo.begin()))
      return failure(ErrorCode::unsupported,
                     "the Falcon did not take its firmware: of the piece at byte " + std::to_string(at) +
                         (*size < piece.size() ? " not everything came back; " : " something else came back; ") +
                         kReplug);
  }
  return {};
}

Result<std::optional<FalconState>> FalconUsb::exchange(const FalconCommand& command, milliseconds patience) {
  Wire& wire = *wire_;
  const auto deadline = Clock::now() + patience;
  if (!wire.out.pending && !wire.stopped) {
    const FalconFrame frame = encode(command);
    std::copy(frame.begin(), frame.end(), wire.out.bytes.begin());
    if (Result<void> ok = wire.check("writing to", wire.out.submit(wire.handle, kOut, frame.size())); !ok)
      return tl::unexpected(ok.error());
  }
  bool writing = wire.out.pending;
  std::optional<FalconState> newest;
  while (true) {
    if (!wire.in.pending && !newest)
      if (Result<void> ok = wire.check("reading from", wire.in.submit(wire.handle, kIn, kPacket)); !ok)
        return tl::unexpected(ok.error());
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now() + 999us);
    if (left <= 0ms) return newest;
    const bool reading = wire.in.pending;
    if (reading || wire.out.pending) wire.handle_events(left);
    if (writing && !wire.out.pending) {
      writing = false;
      if (Result<void> ok = wire.check("writing to", code_of(wire.out.raw->status)); !ok)
        return tl::unexpected(ok.error());
    }
    if (reading && !wire.in.pending) {
      if (Result<void> ok = wire.check("reading from", code_of(wire.in.raw->status)); !ok)
        return tl::unexpected(ok.error());
      const auto size = static_cast<std::size_t>(std::max(0, wire.in.raw->actual_length));
      if (wire.in.raw->status == LIBUSB_TRANSFER_COMPLETED)
        if (const auto state = wire.reader.take(without_modem_status(std::span(wire.in.bytes).first(size))))
          newest = state;
    }
    if (newest) wire.failures = 0;
    if (newest && !wire.out.pending) return newest;
  }
}

}  // namespace osteon::haptic
