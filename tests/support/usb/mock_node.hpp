// A device node that a program under libumockdev-preload opens. It is a pseudo terminal, so that the program's poll()
// sleeps until we allow it to continue. Every ioctl, read and write of it is answered here. The calls come on a thread
// of umockdev's own: any other thread must hold the lock of all nodes to use a node, or what its answers use.
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

// The lock of all nodes. It is held while their answers are called.
[[nodiscard]] std::recursive_mutex& node_lock();

class MockNode {
 public:
  // `path`: "/dev/…", already part of the testbed. The pseudo terminal replaces it.
  MockNode(UMockdevTestbed* testbed, const std::string& path);
  ~MockNode();  // hangs up: a client in poll() wakes up with an error
  MockNode(const MockNode&) = delete;
  MockNode& operator=(const MockNode&) = delete;

  // The answers. Each must complete the call, now or later.
  std::function<void(Call*)> on_ioctl, on_read, on_write;

  // Whether the client's poll() may return as ready to write, or to read.
  void let_write(bool ready);
  void add_readable();  // once for each item to read
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

// Completes a call, and keeps it alive until the answer was sent.
void complete(Call* call, long result, int error = 0);

// Removes a device ("/sys/devices/…") and all below it from the testbed, so that it can be added again.
void unplug(UMockdevTestbed* testbed, const std::string& path);

}  // namespace osteon::test
