// A HID device on the emulated USB, seen through its hidraw node. We queue input reports and keep the output reports.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/usb/mock_node.hpp"

namespace osteon::test {

struct HidKind {
  std::uint16_t vendor = 0, model = 0;
  std::string name;
  std::vector<std::uint8_t> descriptor;
  int port = 0;  // the port that it is plugged into
  int node = 0;  // N of /dev/hidrawN; a testbed accepts each only once
};

class MockHid {
 public:
  MockHid(UMockdevTestbed* testbed, const HidKind& kind);
  ~MockHid();
  MockHid(const MockHid&) = delete;
  MockHid& operator=(const MockHid&) = delete;

  void report(std::vector<std::uint8_t> bytes);
  [[nodiscard]] std::size_t unread() const { return reports_.size(); }
  std::vector<std::uint8_t> written;  // the last output report

 private:
  void ioctl(Call* call);
  void read(Call* call);
  void write(Call* call);

  UMockdevTestbed* testbed_;
  HidKind kind_;
  std::string usb_path_;
  std::unique_ptr<MockNode> node_;
  std::deque<std::vector<std::uint8_t>> reports_;
};

}  // namespace osteon::test
