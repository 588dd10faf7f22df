// A device node that a program under libumockdev-preload opens: a pseudo terminal, so that its poll() sleeps until we
// let it go on, and every ioctl, read and write of it answered here. They come on a thread of umockdev's own: whoever
// else touches a node, or what its answers use, holds the lock of all nodes.
#pragma once
#include <umockdev.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace osteon::test {

// One ioctl, read or write of the client, until it is completed.
using Call = UMockdevIoctlClient;

// The lock of all nodes; their answers are called with it.
[[nodiscard]] std::recursive_mutex& node_lock();

class MockNode {
 public:
  // `path`: "/dev/…", already part of the testbed. Replaces it by the pseudo terminal.
  MockNode(UMockdevTestbed* testbed, const std::string& path);
  ~MockNode();  // hangs up: whoever polls it is woken with an error
  MockNode(const MockNode&) = delete;
  MockNode& operator=(const MockNode&) = delete;

  // The answers; each must complete the call, now or later.
  std::function<void(Call*)> on_ioctl, on_read, on_write;

  // May the client's poll() return because it could write, or read?
  void let_write(bool ready);
  void add_readable();  // once for each thing to read
  void take_readable();

 private:
  static gboolean handle_ioctl(UMockdevIoctlBase*, Call* call, gpointer self);
  static gboolean handle_read(UMockdevIoctlBase*, Call* call, gpointer self);
  static gboolean handle_write(UMockdevIoctlBase*, Call* call, gpointer self);

  UMockdevTestbed* testbed_;
  std::string path_;
  UMockdevIoctlBase* base_;
  int master_ = -1, slave_ = -1;
};

// Completes a call, and keeps it alive until that has been sent.
void complete(Call* call, long result, int error = 0);

// Takes a device ("/sys/devices/…") and all below it out of the testbed, so that it can be added again.
void unplug(UMockdevTestbed* testbed, const std::string& path);

}  // namespace osteon::test
