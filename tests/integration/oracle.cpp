#include "tests/integration/oracle.hpp"

#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/tools/tool_box.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "osteon/v1/journal.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

using namespace std::chrono_literals;

Oracle::Oracle(const Oracle& other) {
  const std::lock_guard lock(other.mutex_);
  asked_ = other.asked_, furthest_ = other.furthest_;
  cuts_ = other.cuts_, marks_ = other.marks_, joins_ = other.joins_;
  kept_ = other.kept_;
}

void Oracle::asked() {
  const std::lock_guard lock(mutex_);
  ++asked_;
}

void Oracle::heard(RoomSeq place) {
  const std::lock_guard lock(mutex_);
  furthest_ = std::max(furthest_, place.value);
}

void Oracle::heard_cut(RoomSeq place, std::string bytes) {
  heard(place);
  const std::lock_guard lock(mutex_);
  cuts_[place.value] = std::move(bytes);
}

void Oracle::heard_mark(RoomSeq place, std::string label) {
  heard(place);
  const std::lock_guard lock(mutex_);
  marks_[place.value] = std::move(label);
}

void Oracle::heard_join(AuthorId author) {
  const std::lock_guard lock(mutex_);
  joins_.insert(author.value);
}

void Oracle::heard_kept(const wire::DurableSeq& kept) {
  heard(kept.room_seq);
  const std::lock_guard lock(mutex_);
  if (!kept_ || kept_->room_seq <= kept.room_seq) kept_ = kept;
}

std::uint64_t Oracle::acknowledged() const {
  const std::lock_guard lock(mutex_);
  return furthest_;
}

std::uint64_t Oracle::most() const {
  const std::lock_guard lock(mutex_);
  return std::max(asked_, furthest_);
}

std::optional<wire::DurableSeq> Oracle::kept() const {
  const std::lock_guard lock(mutex_);
  return kept_;
}

std::string Oracle::lacks(std::string_view lines, std::uint64_t up_to) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t place = 0;
  std::set<std::uint64_t> joined;
  while (!lines.empty() && place < up_to) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 1, lines.size()));
    ++place;
    constexpr std::string_view kEvent = ",\"event\":";
    const std::size_t event = line.find(kEvent);
    v1::JournalEntry entry;
    if (!line.starts_with("{\"room_seq\":" + std::to_string(place) + ",") || event == line.npos ||
        !google::protobuf::util::JsonStringToMessage(
             std::string(line.substr(event + kEvent.size(), line.size() - event - kEvent.size() - 1)), &entry)
             .ok())
      return "line " + std::to_string(place) + " is not that place's event: " + std::string(line.substr(0, 80));
    if (entry.has_join()) joined.insert(entry.join().author());
    if (const auto cut = cuts_.find(place);
        cut != cuts_.end() && (!entry.has_cut() || entry.cut().SerializeAsString() != cut->second))
      return "place " + std::to_string(place) + " is not the cut that was acknowledged";
    if (const auto mark = marks_.find(place);
        mark != marks_.end() && (!entry.has_mark() || entry.mark().label() != mark->second))
      return "place " + std::to_string(place) + " is not the mark that was acknowledged";
  }
  if (place < std::min(up_to, furthest_))
    return "it ends at place " + std::to_string(place) + ", " + std::to_string(std::min(up_to, furthest_)) +
           " were acknowledged";
  if (up_to < furthest_) return {};
  for (const std::uint64_t author : joins_)
    if (!joined.contains(author)) return "author " + std::to_string(author) + " never came";
  return {};
}

struct LightHand::Stream {
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> calls;
};

Result<std::unique_ptr<LightHand>> LightHand::come(const std::string& address, const std::string& name, Oracle& oracle,
                                                   std::uint64_t seed) {
  oracle.asked();
  auto joined = wire::join_room(address, wire::ClientKind::haptic, name, 5s, {});
  if (!joined) return tl::unexpected(joined.error());
  oracle.heard_join(joined->author);
  return std::unique_ptr<LightHand>(new LightHand(std::move(*joined), oracle, seed));
}

Result<std::unique_ptr<LightHand>> LightHand::come_again(const std::string& address, const wire::JoinedRoom& before,
                                                         Oracle& oracle, std::uint64_t seed) {
  wire::JoinedRoom room = before;
  auto channel = wire::reach_server(address, wire::ClientKind::haptic, 5s, {});
  if (!channel) return tl::unexpected(channel.error());
  room.channel = std::move(*channel);
  // A machine under load may take longer than the second of one attempt.
  for (int attempt = 0;; ++attempt) {
    auto again = wire::join_again(room, wire::ClientKind::haptic, oracle.kept());
    if (again) return std::unique_ptr<LightHand>(new LightHand(std::move(*again), oracle, seed));
    if (attempt == 10 || again.error().message.find("Deadline") == std::string::npos)
      return tl::unexpected(again.error());
  }
}

LightHand::LightHand(wire::JoinedRoom room, Oracle& oracle, std::uint64_t seed)
    : room_(std::move(room)),
      oracle_(&oracle),
      seed_(seed),
      stream_(std::make_unique<Stream>()),
      lease_(room_.lease_epoch) {
  stream_->calls = v1::CuttingService::NewStub(room_.channel)->Session(&stream_->context);
  v1::SessionRequest request;
  request.mutable_open()->set_author(room_.author.value);
  request.mutable_open()->set_server_epoch(room_.server_epoch);
  request.mutable_open()->set_secret(room_.secret);
  (void)stream_->calls->Write(request);
  cutter_ = std::thread([this] { cut(); });
  reader_ = std::thread([this] { read(); });
}

LightHand::~LightHand() {
  over_ = true;
  stream_->context.TryCancel();
  reader_.join();
}

std::optional<std::string> LightHand::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

std::string LightHand::rejected() const {
  const std::lock_guard lock(mutex_);
  return rejected_;
}

bool LightHand::mark(const std::string& label) {
  oracle_->asked();
  v1::MarkRequest request;
  request.set_author(room_.author.value);
  request.set_label(label);
  v1::MarkResponse response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 5s);
  if (!v1::RoomService::NewStub(room_.channel)->Mark(&context, request, &response).ok()) return false;
  oracle_->heard_mark(RoomSeq{response.room_seq()}, label);
  return true;
}

void LightHand::read() {
  v1::SessionResponse message;
  while (stream_->calls->Read(&message)) {
    switch (message.message_case()) {
      case v1::SessionResponse::kComplete:
        lease_ = message.complete().lease_epoch();
        decided_ = message.complete().decided_author_seq();
        complete_ = true;
        break;
      case v1::SessionResponse::kCommitted: {
        const v1::CommittedCut& committed = message.committed();
        oracle_->heard_cut(RoomSeq{committed.room_seq()}, committed.cut().SerializeAsString());
        if (committed.cut().author() == room_.author.value) decided_ = committed.cut().author_seq();
        break;
      }
      case v1::SessionResponse::kRejected: {
        oracle_->heard(RoomSeq{message.rejected().room_seq()});
        lease_ = message.rejected().lease_epoch();
        const std::lock_guard lock(mutex_);
        rejected_ = message.rejected().reason();
        decided_ = message.rejected().author_seq();
        break;
      }
      case v1::SessionResponse::kNoted:
        oracle_->heard(RoomSeq{message.noted().room_seq()});
        break;
      case v1::SessionResponse::kDurable: {
        const auto chain = wire::digest_from_wire(message.durable().chain()),
                   seal = wire::digest_from_wire(message.durable().seal());
        if (chain && seal) oracle_->heard_kept({RoomSeq{message.durable().room_seq()}, *chain, *seal});
        break;
      }
      default:
        break;
    }
  }
  over_ = true;
  cutter_.join();  // the reader may be in a call of the same stream
  const grpc::Status status = stream_->calls->Finish();
  const std::lock_guard lock(mutex_);
  ended_ = status.error_message();
}

void LightHand::cut() {
  constexpr std::uint64_t kMostWaiting = 40;
  const Tool burr = find_tool("burr-round-5").value();
  Random random(seed_);
  while (!complete_ && !over_) std::this_thread::sleep_for(1ms);
  std::uint64_t sent = decided_;
  auto before = std::chrono::steady_clock::now();
  while (!over_) {
    if (sent >= decided_ + kMostWaiting) {
      std::this_thread::sleep_for(500us);
      continue;
    }
    // A bur makes dimples in the upper face. They separate no fragments.
    const Vec3 at{random.between(-5, 5), random.between(-5, 5), random.between(-0.5, 0.5)};
    Cut cut = straight_cut(burr, at, at, {0, 0, -1}, sent + 1);
    cut.author = room_.author;
    cut.lease_epoch = lease_;
    const auto now = std::chrono::steady_clock::now();
    const auto took = std::chrono::duration_cast<std::chrono::microseconds>(now - std::exchange(before, now));
    cut.path_us = static_cast<std::uint32_t>(std::min<std::int64_t>(took.count(), 20'000));
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(cut);
    oracle_->asked();
    if (!stream_->calls->Write(request)) return;
    ++sent;
    std::this_thread::sleep_for(500us);
  }
}

}  // namespace osteon::test
