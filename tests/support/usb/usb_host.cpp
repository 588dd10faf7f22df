// osteon-usb-host: plays the USB devices of a machine for a program under libumockdev-preload. It prints the folder of
// its testbed. Then it takes commands on standard input and answers each with one line. It ends with its input.
// Commands (DEVICE: falcon, spacemouse, switch, joystick; ids in hex):
//
//   plug falcon [loaded]
//   plug DEVICE [VENDOR PRODUCT]
//   unplug DEVICE
//   report DEVICE HEX…
//   written DEVICE
//   unread DEVICE
//   falcon encoders A B C | buttons N | homed N | silent N | spoil N | deaf N | fail N | false-echo AT | power-cut
//   falcon told
#include <glib-unix.h>
#include <umockdev.h>

#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "tests/support/usb/mock_falcon.hpp"
#include "tests/support/usb/mock_hid.hpp"

namespace {

using namespace osteon::test;

// A cap with six axes of 16 bits in one report, and two buttons.
const std::vector<std::uint8_t> kCap{0x05, 0x01, 0x09, 0x08, 0xa1, 0x01, 0x85, 0x01, 0x16, 0xa2, 0xfe, 0x26, 0x5e, 0x01,
                                     0x75, 0x10, 0x95, 0x06, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32, 0x09, 0x33, 0x09, 0x34,
                                     0x09, 0x35, 0x81, 0x02, 0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x02, 0x15, 0x00,
                                     0x25, 0x01, 0x75, 0x01, 0x95, 0x02, 0x81, 0x02, 0x95, 0x0e, 0x81, 0x03, 0xc0};
// Three switches in two bytes.
const std::vector<std::uint8_t> kSwitch{0x05, 0x0c, 0x09, 0x03, 0xa1, 0x01, 0x05, 0x09, 0x19,
                                        0x01, 0x29, 0x03, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01,
                                        0x95, 0x03, 0x81, 0x02, 0x95, 0x0d, 0x81, 0x03, 0xc0};
// Two buttons and six unused bits, then x of 8 bits and z of 10, both from zero.
const std::vector<std::uint8_t> kJoystick{
    0x05, 0x01, 0x09, 0x04, 0xa1, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x02, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95,
    0x02, 0x81, 0x02, 0x95, 0x06, 0x81, 0x03, 0x05, 0x01, 0x09, 0x30, 0x26, 0xff, 0x00, 0x75, 0x08, 0x95, 0x01, 0x81,
    0x02, 0x09, 0x32, 0x26, 0xff, 0x03, 0x75, 0x0a, 0x95, 0x01, 0x81, 0x02, 0x75, 0x06, 0x81, 0x03, 0xc0};

class Host {
 public:
  Host() : testbed_(umockdev_testbed_new()) {}
  ~Host() {
    falcon_.reset();
    hids_.clear();
    g_object_unref(testbed_);
  }

  std::string root() const {
    gchar* root = umockdev_testbed_get_root_dir(testbed_);
    std::string out = root;
    g_free(root);
    return out;
  }

  std::string answer(const std::string& line) {
    std::istringstream words(line);
    std::string verb, device;
    words >> verb >> device;
    if (verb == "plug") return plug(device, words);
    if (verb == "unplug") return unplug(device);
    if (verb == "falcon") return falcon(device, words);
    const auto hid = hids_.find(device);
    if (hid == hids_.end()) return "no " + device;
    if (verb == "report") {
      std::vector<std::uint8_t> bytes;
      for (unsigned byte = 0; words >> std::hex >> byte;) bytes.push_back(static_cast<std::uint8_t>(byte));
      hid->second->report(bytes);
      return "ok";
    }
    if (verb == "unread") return std::to_string(hid->second->unread());
    if (verb == "written") {
      std::ostringstream out;
      for (const std::uint8_t byte : hid->second->written) out << std::hex << static_cast<int>(byte) << ' ';
      return out.str();
    }
    return "no command " + verb;
  }

 private:
  std::string plug(const std::string& device, std::istringstream& words) {
    if (device == "falcon") {
      std::string how;
      words >> how;
      falcon_ = std::make_unique<MockFalcon>(testbed_, how == "loaded");
      return "ok";
    }
    HidKind kind;
    if (device == "spacemouse")
      kind = {0x256f, 0xc635, "SpaceMouse Compact", kCap, 4};
    else if (device == "switch")
      kind = {0x05f3, 0x00ff, "VEC Footpedal", kSwitch, 6};
    else if (device == "joystick")
      kind = {0x068e, 0x00f2, "Emulated Pedals", kJoystick, 7};
    else
      return "no device " + device;
    unsigned vendor = 0, model = 0;
    if (words >> std::hex >> vendor >> model) {
      kind.vendor = static_cast<std::uint16_t>(vendor);
      kind.model = static_cast<std::uint16_t>(model);
    }
    kind.node = nodes_++;
    hids_.erase(device);
    hids_.emplace(device, std::make_unique<MockHid>(testbed_, kind));
    return "ok";
  }

  std::string unplug(const std::string& device) {
    if (device == "falcon")
      falcon_.reset();
    else
      hids_.erase(device);
    return "ok";
  }

  std::string falcon(const std::string& what, std::istringstream& words) {
    if (!falcon_) return "no falcon";
    FalconModel& model = falcon_->model;
    if (what == "told") {
      const FalconModel::Told& told = model.told();
      std::ostringstream out;
      out << told.frames << ' ' << told.bad_frames << ' ' << told.with_force << ' ' << told.motors[0] << ' '
          << told.motors[1] << ' ' << told.motors[2] << ' ' << told.control << ' ' << told.image_bytes << ' '
          << falcon_->transfers;
      return out.str();
    }
    if (what == "power-cut") {
      model.forget_image();
      return "ok";
    }
    long value = 0;
    words >> value;
    if (what == "encoders") {
      model.encoders[0] = static_cast<std::int16_t>(value);
      for (std::size_t i = 1; i < 3; ++i) words >> model.encoders[i];
    } else if (what == "buttons")
      model.buttons = static_cast<int>(value);
    else if (what == "homed")
      model.homed = static_cast<int>(value);
    else if (what == "silent")
      model.silent = value != 0;
    else if (what == "spoil")
      model.spoil = static_cast<int>(value);
    else if (what == "deaf")
      model.deaf = static_cast<int>(value);
    else if (what == "fail")
      falcon_->failing = static_cast<int>(value);
    else if (what == "false-echo")
      model.false_echo_at = value;
    else
      return "no command falcon " + what;
    return "ok";
  }

  UMockdevTestbed* testbed_;
  std::unique_ptr<MockFalcon> falcon_;
  std::map<std::string, std::unique_ptr<MockHid>> hids_;
  int nodes_ = 0;
};

struct Session {
  Host host;
  GMainLoop* loop = g_main_loop_new(nullptr, FALSE);
  GIOChannel* input = g_io_channel_unix_new(0);
};

gboolean heard(GIOChannel* input, GIOCondition, gpointer data) {
  auto* session = static_cast<Session*>(data);
  gchar* line = nullptr;
  gsize end = 0;
  if (g_io_channel_read_line(input, &line, nullptr, &end, nullptr) != G_IO_STATUS_NORMAL) {
    g_main_loop_quit(session->loop);
    return G_SOURCE_REMOVE;
  }
  {
    const std::lock_guard lock(node_lock());
    std::cout << session->host.answer(std::string(line, end)) << std::endl;
  }
  g_free(line);
  return G_SOURCE_CONTINUE;
}

}  // namespace

int main() {
  Session session;
  std::cout << session.host.root() << std::endl;
  g_io_add_watch(session.input, static_cast<GIOCondition>(G_IO_IN | G_IO_HUP), &heard, &session);
  g_main_loop_run(session.loop);
}
