// A Falcon on the emulated USB. Its node answers libusb's calls to Linux' usbfs, and passes bytes to a FalconModel.
#pragma once
#include <deque>
#include <memory>

#include "tests/support/usb/falcon_model.hpp"
#include "tests/support/usb/mock_node.hpp"

namespace osteon::test {

class MockFalcon {
 public:
  MockFalcon(UMockdevTestbed* testbed, bool loaded);
  ~MockFalcon();
  MockFalcon(const MockFalcon&) = delete;
  MockFalcon& operator=(const MockFalcon&) = delete;

  FalconModel model;
  int failing = 0;  // this number of bulk transfers end with a bus error
  std::uint64_t transfers = 0;

 private:
  // A request block of the client, in the client's memory and here.
  struct Block {
    UMockdevIoctlData* urb;
    UMockdevIoctlData* buffer;  // null if there is none
    std::uint64_t address;
  };
  void ioctl(Call* call);
  void submit(Call* call);
  void bulk(Call* call);
  void reap(Call* call);
  void discard(Call* call);
  void control(Block& block);
  void finish(const Block& block, int status, std::size_t length);
  void answer_reads(bool also_without_data);
  static gboolean latency_passed(gpointer self);

  UMockdevTestbed* testbed_;
  std::unique_ptr<MockNode> node_;
  std::deque<Block> reading_, done_;
  guint timer_ = 0;
};

}  // namespace osteon::test
