#include "tests/support/usb/mock_hid.hpp"

#include <linux/hidraw.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace osteon::test {
namespace {

template <class... Values>
std::string text(const char* format, Values... values) {
  char line[512];
  std::snprintf(line, sizeof(line), format, values...);
  return line;
}

}  // namespace

MockHid::MockHid(UMockdevTestbed* testbed, const HidKind& kind) : testbed_(testbed), kind_(kind) {
  const std::string usb = text("/devices/pci0000:00/0000:00:14.0/usb1/1-%d", kind.port);
  const std::string interface = usb + text("/1-%d:1.0", kind.port);
  const std::string id = text("0003:%04X:%04X.%04X", kind.vendor, kind.model, kind.port);
  std::string hex;
  for (const std::uint8_t byte : kind.descriptor) hex += text("%02X", byte);
  // The kernel's chain: device, its interface, the HID layer's device, the node.
  std::string all = "P: " + usb + "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n";
  all += text("A: idVendor=%04x\\n\nA: idProduct=%04x\\n\nA: product=%s\\n\nA: bcdDevice=0100\\n\n\n", kind.vendor,
              kind.model, kind.name.c_str());
  all += "P: " + interface + "\nE: DEVTYPE=usb_interface\nE: SUBSYSTEM=usb\nA: bInterfaceNumber=00\\n\n\n";
  all += "P: " + interface + "/" + id + "\nE: SUBSYSTEM=hid\n";
  all += text("E: HID_ID=0003:%08X:%08X\nE: HID_NAME=%s\nE: HID_UNIQ=\n", kind.vendor, kind.model, kind.name.c_str());
  all += "H: report_descriptor=" + hex + "\n\n";
  all += "P: " + interface + "/" + id + text("/hidraw/hidraw%d\nN: hidraw%d\n", kind.node, kind.node);
  all += text("E: SUBSYSTEM=hidraw\nE: DEVNAME=/dev/hidraw%d\nE: MAJOR=244\nE: MINOR=%d\nL: device=../../../",
              kind.node, kind.node) +
         id + "\n\n";
  usb_path_ = "/sys" + usb;
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(testbed, all.c_str(), &error)) {
    std::fprintf(stderr, "adding %s: %s\n", kind.name.c_str(), error->message);
    std::exit(2);
  }
  node_ = std::make_unique<MockNode>(testbed, text("/dev/hidraw%d", kind.node));
  node_->let_write(true);
  node_->on_ioctl = [this](Call* call) { ioctl(call); };
  node_->on_read = [this](Call* call) { read(call); };
  node_->on_write = [this](Call* call) { write(call); };
}

MockHid::~MockHid() {
  node_.reset();
  unplug(testbed_, usb_path_);
}

void MockHid::report(std::vector<std::uint8_t> bytes) {
  reports_.push_back(std::move(bytes));
  node_->add_readable();
}

void MockHid::ioctl(Call* call) {
  if (static_cast<unsigned>(umockdev_ioctl_client_get_request(call)) != HIDIOCGRDESCSIZE)
    return complete(call, -1, ENOTTY);
  UMockdevIoctlData* data = umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(call), 0, sizeof(int), nullptr);
  const int size = static_cast<int>(kind_.descriptor.size());
  std::memcpy(data->data, &size, sizeof(size));
  complete(call, 0);
  g_object_unref(data);
}

void MockHid::read(Call* call) {
  if (reports_.empty()) return complete(call, -1, EAGAIN);
  UMockdevIoctlData* into = umockdev_ioctl_client_get_arg(call);
  const std::vector<std::uint8_t> bytes = std::move(reports_.front());
  reports_.pop_front();
  node_->take_readable();
  const std::size_t size = std::min(bytes.size(), static_cast<std::size_t>(into->data_len));
  std::copy_n(bytes.begin(), size, into->data);
  complete(call, static_cast<long>(size));
}

void MockHid::write(Call* call) {
  const UMockdevIoctlData* from = umockdev_ioctl_client_get_arg(call);
  written.assign(from->data, from->data + from->data_len);
  complete(call, from->data_len);
}

}  // namespace osteon::test
