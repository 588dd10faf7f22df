// Cuts from datagrams wait for the room as those from the stream do, with the same limit. A client that does not wait
// for the room cannot fill the server's memory.
#include <gtest/gtest.h>

#include <future>
#include <span>

#include "common/link/udp_port.hpp"
#include "common/wire/client_link.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;

constexpr std::size_t kWindow = 1024;      // largest number of unacknowledged cuts of a haptic client
constexpr std::size_t kOfTheStream = 256;  // largest number of undecided cuts read from a stream

SealKey key_in(const std::string& bytes) {
  return key_of({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}).value();
}

// A room that decides only when the test says so, as slowly as one on a bad disk. It has one session, with no rules
// other than those of the wire.
class FloodTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Case bone = test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    RoomServerOptions options{.case_folder = dir_ / "case"};
    options.rates.tick = options.rates.pieces = 0ns;
    auto started = RoomServer::start(Room(bone), options, {});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    auto joining = std::async(std::launch::async, [&] { return join(server_->address(), wire::ClientKind::haptic); });
    while (joining.wait_for(1ms) != std::future_status::ready) tick();
    room_ = joining.get();
    open();
  }
  void TearDown() override {
    context_.TryCancel();
    if (reader_.joinable()) reader_.join();
    tick();  // The room holds the cuts that wait.
    (*server_->rooms().find(""))->runtime().stop();
    server_.reset();
  }

  void tick() { (*server_->rooms().find(""))->runtime().tick(now_ += 8ms); }
  std::size_t queued() { return server_->health().queued_cuts; }

  // Sends `cuts` in datagrams as fast as possible, and runs the datagram path until `holds` is true.
  bool send(std::span<const Cut> cuts, const std::function<bool()>& holds) {
    const auto begin = std::chrono::steady_clock::now();
    DatagramBuffer buffer;
    for (std::size_t next = 0; !holds();) {
      if (std::chrono::steady_clock::now() - begin > kPatience) return false;
      while (next < cuts.size() && link_->push(cuts[next])) ++next;
      while (const std::optional<Datagram> datagram = port_->receive(buffer)) link_->receive(datagram->bytes, now());
      while (link_->take_entry()) {
      }
      if (const auto bytes = link_->send(now(), buffer); !bytes.empty()) port_->send(*at_, bytes);
      port_->wait(200us);
    }
    return true;
  }
  bool is_over() const { return over_; }
  grpc::Status end() {
    reader_.join();
    return status_;
  }
  AuthorId author() const { return room_.author; }
  wire::ClientLink& link() { return *link_; }

 private:
  void open() {
    stream_ = v1::CuttingService::NewStub(room_.channel)->Session(&context_);
    v1::SessionRequest request;
    request.mutable_open()->set_author(room_.author.value);
    request.mutable_open()->set_server_epoch(room_.server_epoch);
    request.mutable_open()->set_secret(room_.secret);
    ASSERT_TRUE(stream_->Write(request));
    v1::SessionResponse said;
    while (stream_->Read(&said) && !said.has_complete()) {
      if (said.has_link()) {
        const v1::LinkOffer& offer = said.link();
        wire::LinkOptions hasty;  // It sends what it has, whatever the room acknowledges.
        hasty.rate.interval = hasty.rate.fresh_interval = 100us;
        hasty.rate.bytes_per_s = 1e9;
        hasty.rate.burst_bytes = 1 << 20;
        hasty.window.bytes = 1 << 28;
        hasty.window.items = 1 << 20;
        link_.emplace(SessionKeys{offer.session(), key_in(offer.key_up()), key_in(offer.key_down())}, 1, 1, hasty);
        at_ = find_endpoint("127.0.0.1", static_cast<std::uint16_t>(offer.udp_port())).value();
        port_ = UdpPort::open({.address = "0.0.0.0"}).value();
      }
      if (said.has_tool() && link_)
        link_->tools().add(said.tool().tool_number(), wire::digest_from_wire(said.tool().tool().tool_hash()).value());
    }
    ASSERT_TRUE(said.has_complete());
    ASSERT_TRUE(link_.has_value());
    reader_ = std::thread([this] {
      v1::SessionResponse entry;
      while (stream_->Read(&entry)) {
      }
      status_ = stream_->Finish();
      over_ = true;
    });
  }
  static std::chrono::nanoseconds now() {
    static const auto begin = std::chrono::steady_clock::now();
    return std::chrono::steady_clock::now() - begin;
  }

  TempDir dir_;
  std::unique_ptr<RoomServer> server_;
  std::chrono::nanoseconds now_{};
  wire::JoinedRoom room_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> stream_;
  std::optional<wire::ClientLink> link_;
  std::optional<Endpoint> at_;
  std::unique_ptr<UdpPort> port_;
  std::thread reader_;
  grpc::Status status_;
  std::atomic<bool> over_{false};
};

TEST_F(FloodTest, AWindowOfCutsWaitsForASlowRoom) {
  const std::vector<Cut> cuts = strokes(author(), static_cast<int>(kWindow), 1);
  ASSERT_TRUE(send(cuts, [&] { return queued() == kWindow || is_over(); })) << queued();
  ASSERT_FALSE(is_over()) << end().error_message();
  tick();
  EXPECT_TRUE(send({}, [&] { return link().acknowledged() == kWindow; }))
      << "each cut was acknowledged: " << link().acknowledged();
  EXPECT_FALSE(is_over());
}

TEST_F(FloodTest, AClientThatDoesNotWaitForTheRoomIsSentTheReasonAndEnded) {
  const std::vector<Cut> cuts = strokes(author(), 4 * static_cast<int>(kWindow), 1);
  std::size_t most = 0;
  EXPECT_TRUE(send(cuts,
                   [&] {
                     most = std::max(most, queued());
                     return is_over();
                   }))
      << most << " cuts wait";
  EXPECT_GE(most, kWindow) << "so many may wait without a refusal";
  EXPECT_LE(most, kWindow + kOfTheStream);
  if (!is_over()) return;
  const grpc::Status why = end();
  EXPECT_EQ(why.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << why.error_message();
  EXPECT_NE(why.error_message().find("cuts of this session wait"), std::string::npos) << why.error_message();
  tick();  // The queued cuts are decided.
  EXPECT_EQ(queued(), 0u);
}

}  // namespace
}  // namespace osteon
