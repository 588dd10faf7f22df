#include "tests/support/usb/mock_node.hpp"

#include <fcntl.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>

namespace osteon::test {
namespace {

[[noreturn]] void give_up(const char* what) {
  std::perror(what);
  std::exit(2);
}

// A call may arrive while its node is being removed.
std::set<void*>& nodes() {
  static std::set<void*> all;
  return all;
}

gboolean answer(std::function<void(Call*)> MockNode::*how, Call* call, gpointer self) {
  const std::lock_guard lock(node_lock());
  if (!nodes().contains(self)) {
    complete(call, -1, ENODEV);
    return TRUE;
  }
  const auto& call_it = static_cast<MockNode*>(self)->*how;
  if (!call_it) return FALSE;
  call_it(call);
  return TRUE;
}

}  // namespace

std::recursive_mutex& node_lock() {
  static std::recursive_mutex mutex;
  return mutex;
}

MockNode::MockNode(UMockdevTestbed* testbed, const std::string& path)
    : testbed_(testbed), path_(path), base_(umockdev_ioctl_base_new()) {
  nodes().insert(this);
  char name[128];
  termios raw{};
  cfmakeraw(&raw);
  if (openpty(&master_, &slave_, name, &raw, nullptr) != 0) give_up("openpty");
  for (const int fd : {master_, slave_}) fcntl(fd, F_SETFD, FD_CLOEXEC);
  fcntl(slave_, F_SETFL, O_NONBLOCK);
  let_write(false);

  gchar* root = umockdev_testbed_get_root_dir(testbed);
  const std::filesystem::path node = std::string(root) + path;
  g_free(root);
  std::filesystem::remove(node);
  std::filesystem::create_symlink(name, node);

  g_signal_connect(base_, "handle-ioctl", G_CALLBACK(&MockNode::handle_ioctl), this);
  g_signal_connect(base_, "handle-read", G_CALLBACK(&MockNode::handle_read), this);
  g_signal_connect(base_, "handle-write", G_CALLBACK(&MockNode::handle_write), this);
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(testbed, path.c_str(), base_, &error)) {
    std::fprintf(stderr, "attaching to %s: %s\n", path.c_str(), error->message);
    std::exit(2);
  }
}

MockNode::~MockNode() {
  nodes().erase(this);
  umockdev_testbed_detach_ioctl(testbed_, path_.c_str(), nullptr);
  g_signal_handlers_disconnect_by_data(base_, this);
  // Remaining clients get the error that the device is gone.
  const auto gone = +[](UMockdevIoctlBase*, Call* call, gpointer) -> gboolean {
    complete(call, -1, ENODEV);
    return TRUE;
  };
  for (const char* signal : {"handle-ioctl", "handle-read", "handle-write"})
    g_signal_connect(base_, signal, G_CALLBACK(gone), nullptr);
  // The handler stays as long as clients use it. It is freed only at the process' end.
  close(master_);
  close(slave_);
}

void MockNode::let_write(bool ready) { tcflow(slave_, ready ? TCOON : TCOOFF); }

void MockNode::add_readable() {
  if (write(master_, "x", 1) != 1) give_up("pseudo terminal");
}

void MockNode::take_readable() {
  char byte;
  if (read(slave_, &byte, 1) != 1 && errno != EAGAIN) give_up("pseudo terminal");
}

gboolean MockNode::handle_ioctl(UMockdevIoctlBase*, Call* call, gpointer self) {
  return answer(&MockNode::on_ioctl, call, self);
}
gboolean MockNode::handle_read(UMockdevIoctlBase*, Call* call, gpointer self) {
  return answer(&MockNode::on_read, call, self);
}
gboolean MockNode::handle_write(UMockdevIoctlBase*, Call* call, gpointer self) {
  return answer(&MockNode::on_write, call, self);
}

void complete(Call* call, long result, int error) {
  g_object_ref(call);
  umockdev_ioctl_client_complete(call, result, error);
  g_object_unref(call);
}

void unplug(UMockdevTestbed* testbed, const std::string& path) {
  namespace fs = std::filesystem;
  umockdev_testbed_remove_device(testbed, path.c_str());
  gchar* folder = umockdev_testbed_get_root_dir(testbed);
  const fs::path root = folder;
  g_free(folder);
  std::error_code ignored;
  fs::remove_all(root / path.substr(1), ignored);
  // Links to it, or to a device below it, now lead nowhere.
  std::vector<fs::path> dangling;
  for (const char* place : {"sys/bus", "sys/class", "sys/dev"}) {
    if (!fs::exists(root / place)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / place))
      if (entry.is_symlink() && !fs::exists(entry.path(), ignored)) dangling.push_back(entry.path());
  }
  for (const fs::path& link : dangling) fs::remove(link, ignored);
}

}  // namespace osteon::test
