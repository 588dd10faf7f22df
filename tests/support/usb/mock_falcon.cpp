#include "tests/support/usb/mock_falcon.hpp"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace osteon::test {
namespace {

constexpr const char* kNode = "/dev/bus/usb/001/005";
constexpr const char* kSysPath = "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-3";
// Device, configuration, interface and two bulk endpoints of 64 bytes, like a full-speed serial chip.
constexpr const char* kDescription =
    "P: /devices/pci0000:00/0000:00:14.0/usb1/1-3\n"
    "N: bus/usb/001/005\n"
    "E: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=001\nE: DEVNUM=005\nE: DEVNAME=/dev/bus/usb/001/005\n"
    "E: MAJOR=189\nE: MINOR=4\n"
    "A: busnum=1\\n\nA: devnum=5\\n\nA: idVendor=0403\\n\nA: idProduct=cb48\\n\nA: bConfigurationValue=1\\n\nA: "
    "speed=12\\n\n"
    "H: descriptors="
    "12011001000000400304 48CB0004010203 01"
    "0902200001010080 32"
    "0904000002FFFFFF00"
    "07058102400000"
    "07050202400000\n\n";
constexpr std::string_view kSerial = "EMULATED-1";
constexpr guint kLatency_ms = 16;  // of the serial chip: then it sends its status, with or without data
constexpr std::array<std::uint8_t, 2> kModemStatus{0x01, 0x60};
constexpr std::size_t kPacket = 64;

// The description without the spaces that make it readable.
std::string description() {
  std::string text = kDescription;
  const std::size_t hex = text.find("descriptors=");
  text.erase(std::remove(text.begin() + static_cast<std::ptrdiff_t>(hex), text.end(), ' '), text.end());
  return text;
}

// The client's memory behind a pointer in other client memory. Null if the client has died.
UMockdevIoctlData* resolve(UMockdevIoctlData* data, gsize at, gsize size) {
  return umockdev_ioctl_data_resolve(data, at, size, nullptr);
}

usbdevfs_urb* urb_of(UMockdevIoctlData* data) { return reinterpret_cast<usbdevfs_urb*>(data->data); }

}  // namespace

MockFalcon::MockFalcon(UMockdevTestbed* testbed, bool loaded) : model(loaded), testbed_(testbed) {
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(testbed, description().c_str(), &error)) {
    std::fprintf(stderr, "adding the Falcon: %s\n", error->message);
    std::exit(2);
  }
  node_ = std::make_unique<MockNode>(testbed, kNode);
  node_->on_ioctl = [this](Call* call) { ioctl(call); };
  timer_ = g_timeout_add(kLatency_ms, &MockFalcon::latency_passed, this);
}

MockFalcon::~MockFalcon() {
  g_source_remove(timer_);
  node_.reset();
  unplug(testbed_, kSysPath);
}

void MockFalcon::ioctl(Call* call) {
  switch (static_cast<unsigned>(umockdev_ioctl_client_get_request(call))) {
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* data =
          umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(call), 0, sizeof(__u32), nullptr);
      const __u32 capabilities =
          USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_BULK_CONTINUATION;
      std::memcpy(data->data, &capabilities, sizeof(capabilities));
      complete(call, 0);
      g_object_unref(data);
      return;
    }
    case USBDEVFS_SUBMITURB:
      return submit(call);
    case static_cast<unsigned>(USBDEVFS_BULK):
      return bulk(call);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(call);
    case USBDEVFS_DISCARDURB:
      return discard(call);
    case static_cast<unsigned>(USBDEVFS_DISCONNECT_CLAIM):
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_CLEAR_HALT:
    case USBDEVFS_RESET:
      return complete(call, 0);
    default:
      return complete(call, -1, ENOTTY);
  }
}

void MockFalcon::submit(Call* call) {
  std::uint64_t address = 0;
  UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(call);
  std::memcpy(&address, arg->data, sizeof(address));
  Block block{resolve(arg, 0, sizeof(usbdevfs_urb)), nullptr, address};
  if (block.urb == nullptr) return complete(call, -1, ENODEV);
  usbdevfs_urb* urb = urb_of(block.urb);
  if (urb->buffer_length > 0) {
    block.buffer = resolve(block.urb, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(urb->buffer_length));
    if (block.buffer == nullptr) return complete(call, -1, ENODEV);
  }
  complete(call, 0);
  ++transfers;
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) return control(block);
  if (failing > 0) {
    --failing;
    return finish(block, -EPROTO, 0);
  }
  if (urb->endpoint & 0x80) {
    reading_.push_back(block);
  } else {
    model.take({block.buffer->data, static_cast<std::size_t>(urb->buffer_length)});
    finish(block, 0, static_cast<std::size_t>(urb->buffer_length));
  }
  answer_reads(false);
}

// The kernel's synchronous transfer. Only out, because the driver uses only that.
void MockFalcon::bulk(Call* call) {
  UMockdevIoctlData* data = resolve(umockdev_ioctl_client_get_arg(call), 0, sizeof(usbdevfs_bulktransfer));
  if (data == nullptr) return complete(call, -1, ENODEV);
  usbdevfs_bulktransfer transfer{};
  std::memcpy(&transfer, data->data, sizeof(transfer));
  UMockdevIoctlData* bytes = resolve(data, offsetof(usbdevfs_bulktransfer, data), transfer.len);
  if (bytes == nullptr) return complete(call, -1, ENODEV);
  ++transfers;
  model.take({bytes->data, static_cast<std::size_t>(transfer.len)});
  complete(call, static_cast<long>(transfer.len));
  g_object_unref(bytes);
  g_object_unref(data);
  answer_reads(false);
}

void MockFalcon::control(Block& block) {
  const std::uint8_t* setup = block.buffer->data;  // type, request, value, index, length; then data
  const int value = setup[2] | setup[3] << 8, length = setup[6] | setup[7] << 8;
  if (setup[0] == 0x40) {
    model.set(setup[1], value);
    return finish(block, 0, 0);
  }
  // Strings: 0 languages, any other the serial number.
  if (setup[0] != 0x80 || setup[1] != 6 || value >> 8 != 3) return finish(block, -EPIPE, 0);
  std::vector<std::uint8_t> text{0, 3, 0x09, 0x04};
  if ((value & 0xff) != 0) {
    text.resize(2);
    for (const char c : kSerial) text.insert(text.end(), {static_cast<std::uint8_t>(c), 0});
  }
  text[0] = static_cast<std::uint8_t>(text.size());
  const std::size_t size = std::min(text.size(), static_cast<std::size_t>(length));
  std::copy_n(text.begin(), size, block.buffer->data + 8);
  finish(block, 0, size);
}

void MockFalcon::finish(const Block& block, int status, std::size_t length) {
  usbdevfs_urb* urb = urb_of(block.urb);
  urb->status = status;
  urb->actual_length = static_cast<int>(length);
  done_.push_back(block);
  node_->let_write(true);
}

void MockFalcon::answer_reads(bool also_without_data) {
  while (!reading_.empty() && (also_without_data || !model.waiting.empty())) {
    const Block block = reading_.front();
    reading_.pop_front();
    const auto room = std::min(static_cast<std::size_t>(urb_of(block.urb)->buffer_length), kPacket);
    std::size_t size = 0;
    for (; size < kModemStatus.size(); ++size) block.buffer->data[size] = kModemStatus[size];
    for (; size < room && !model.waiting.empty(); ++size) {
      block.buffer->data[size] = model.waiting.front();
      model.waiting.pop_front();
    }
    finish(block, 0, size);
    also_without_data = false;
  }
}

void MockFalcon::reap(Call* call) {
  if (done_.empty()) return complete(call, -1, EAGAIN);
  const Block block = done_.front();
  done_.pop_front();
  if (done_.empty()) node_->let_write(false);
  UMockdevIoctlData* place = resolve(umockdev_ioctl_client_get_arg(call), 0, sizeof(void*));
  if (place == nullptr) return complete(call, -1, ENODEV);
  umockdev_ioctl_data_set_ptr(place, 0, block.urb);
  complete(call, 0);
  g_object_unref(place);
  if (block.buffer != nullptr) g_object_unref(block.buffer);
  g_object_unref(block.urb);
}

void MockFalcon::discard(Call* call) {
  std::uint64_t address = 0;
  std::memcpy(&address, umockdev_ioctl_client_get_arg(call)->data, sizeof(address));
  const auto found =
      std::find_if(reading_.begin(), reading_.end(), [&](const Block& block) { return block.address == address; });
  if (found == reading_.end()) return complete(call, -1, EINVAL);
  const Block block = *found;
  reading_.erase(found);
  complete(call, 0);
  finish(block, -ENOENT, 0);
}

gboolean MockFalcon::latency_passed(gpointer self) {
  const std::lock_guard lock(node_lock());
  static_cast<MockFalcon*>(self)->answer_reads(true);
  return G_SOURCE_CONTINUE;
}

}  // namespace osteon::test
