// Holds SDL's lock of all pads, as a device that does not answer does.
#pragma once
#include <atomic>
#include <future>
#include <thread>

namespace osteon::test {

// [one thread] It holds the lock until end(), and for 20 s at most.
class BusySdl {
 public:
  BusySdl();  // waits for the lock
  ~BusySdl() { end(); }
  BusySdl(const BusySdl&) = delete;
  BusySdl& operator=(const BusySdl&) = delete;
  // False: somebody waited for SDL until the lock was given up.
  bool end();

 private:
  std::promise<void> held_, free_;
  std::atomic<bool> asked_ = false, waited_too_long_ = false;
  std::thread thread_;
};

}  // namespace osteon::test
