// A served room in this process, on the loopback device and a port that the system chooses.
#pragma once
#include "server/rpc/room_server.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {

class ServedRoom : public ::testing::Test {
 protected:
  void SetUp() override {
    const Case bone = test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto started = RoomServer::start(
        Room(bone), {.listen = "127.0.0.1:0", .case_folder = dir_ / "case", .save = dir_ / "bone.vdb", .rates = {}},
        {});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  const std::string& address() { return server_->address(); }
  RoomRuntime& runtime() { return (*server_->rooms().find(""))->runtime(); }
  std::unique_ptr<Surgeon> surgeon() { return std::make_unique<Surgeon>(address(), dir_ / "cache"); }
  void send(Surgeon& from, const std::vector<Cut>& cuts) {
    for (const Cut& cut : cuts) ASSERT_TRUE(wait_until([&] { return from.session().send(cut); }, kPatience));
  }

  TempDir dir_;
  std::unique_ptr<RoomServer> server_;
};

}  // namespace osteon::test
