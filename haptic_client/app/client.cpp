#include "haptic_client/app/client.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "haptic_client/app/haptic_worker.hpp"
#include "haptic_client/app/replica_worker.hpp"
#include "haptic_client/app/room_receiver.hpp"
#include "haptic_client/app/telemetry_worker.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kJoinPatience = 30s;  // without a message from the room

ClientRoom client_room(RoomSession& room) {
  return {room, room.bone(), room.tools(), room.room().author, room.room().lease_epoch};
}

class Client {
 public:
  Client(RoomSession& room, Session& session, const ClientOptions& options, const StopSignal& stop)
      : room_(room),
        session_(session),
        options_(options),
        stop_(stop),
        limits_(session.device().limits()),
        haptic_(session, room.bone().bounds().centre_mm(), exchange_, end_, stop),
        replica_(
            client_room(room), session, [this](const Replica& joined) { return begin_on(joined); }, exchange_, end_,
            stop),
        telemetry_(client_room(room), session, options.status, log_, recorder_, exchange_, end_),
        receiver_(session.plan().tools, replica_.queue(), exchange_, end_) {}

  Result<ClientOutcome> run() {
    if (Result<void> opened = log_.open(options_.session_log, session_.device().info(), room_.room().author); !opened)
      return tl::unexpected(opened.error());
    if (Result<void> opened = recorder_.open(options_.record, recording_info()); !opened)
      return tl::unexpected(opened.error());
    room_.open(receiver_.callbacks());
    std::thread replica([this] { replica_.run(); });
    std::thread telemetry([this] { telemetry_.run(); });
    if (wait_joined()) {
      std::thread haptic([this] { haptic_.run(); });
      haptic.join();
    }
    replica_.finish();
    replica.join();
    telemetry_.finish();
    telemetry.join();
    const FastPathHealth fast_path = room_.fast_path();
    room_.close();
    return outcome(fast_path);
  }

 private:
  // [replica] Called when the whole bone is there.
  Result<void> begin_on(const Replica& joined) {
    if (!recorder_.recording() && !options_.played) return {};
    const std::string found = to_hex(joined.hash());
    recorder_.begin_on(found);
    return options_.played ? check_played_on(*options_.played, found) : Result<void>();
  }

  bool wait_joined() {
    const Clock::time_point began = Clock::now();
    while (!replica_.joined() && !end_.lost() && !stop_.wait_for(2ms))
      if (Clock::now() - std::max(began, receiver_.last_received()) > kJoinPatience)
        end_.give_up({ErrorCode::unavailable, "the server has sent nothing for " +
                                                  std::to_string(kJoinPatience.count()) +
                                                  " s while the bone was fetched; look at the server's log"});
    return replica_.joined() && !end_.lost();
  }

  // After every thread has ended.
  ClientOutcome outcome(const FastPathHealth& fast_path) {
    ClientOutcome all;
    all.fast_path = fast_path;
    all.haptic = haptic_.outcome();
    all.replica = replica_.outcome();
    all.telemetry = telemetry_.outcome();
    all.stopped = stop_.requested() && !session_.done() && !session_.endless();
    all.lost = end_.why();
    if (!all.lost && !all.stopped && all.replica.unconfirmed > 0)
      all.lost =
          Error{ErrorCode::unavailable,
                "the server has not confirmed the last " + std::to_string(all.replica.unconfirmed) + " cuts within " +
                    std::to_string(ReplicaWorker::kConfirmPatience.count()) + " s; look at the server's log"};
    const std::string hash = all.replica.field_hash ? to_hex(*all.replica.field_hash) : "";
    all.recording = recorder_.finish({hash, all.replica.room_seq.value, all.haptic.rows_dropped, all.lost.has_value()});
    if (const Result<void> written = log_.finish(); !written && !all.lost) all.lost = written.error();
    all.restrictions = all.replica.decisions;
    all.restrictions.insert(all.restrictions.end(), all.telemetry.effects.begin(), all.telemetry.effects.end());
    std::ranges::stable_sort(all.restrictions, {}, &RestrictionNote::mono_ns);
    all.steps = session_.results();
    all.limits = limits_;
    all.loop = session_.loop().params();
    all.coupling_n_per_mm = session_.loop().coupling_n_per_mm();
    all.workspace_scale = session_.loop().mapping().scale();
    return all;
  }

  [[nodiscard]] RecordingInfo recording_info() {
    RecordingInfo info;
    info.device = session_.device().name();
    info.device_info = session_.device().info();
    info.limits = session_.device().limits();
    info.loop = session_.loop().params();
    info.case_hash = to_hex(room_.bone().hash());
    info.case_title = room_.bone().info().title;
    info.pitch_mm = room_.bone().pitch_mm();
    info.author = room_.room().author.value;
    info.plan_digest = to_hex(plan_digest(session_.plan()));
    for (const ToolModel& model : session_.plan().tools)
      info.tools.push_back({model.tool.name, law_name(model), model.tool.diameter_mm});
    return info;
  }

  RoomSession& room_;
  Session& session_;
  const ClientOptions& options_;
  const StopSignal& stop_;
  const DeviceLimits limits_;  // as the session began
  WorkerExchange exchange_;
  ClientEnd end_;
  SessionLog log_;
  Recorder recorder_;
  HapticWorker haptic_;
  ReplicaWorker replica_;
  TelemetryWorker telemetry_;
  RoomReceiver receiver_;
};

}  // namespace

Result<ClientOutcome> run_client(RoomSession& room, Session& session, const ClientOptions& options,
                                 const StopSignal& stop) {
  // On the heap because it is large: it contains its queues.
  const auto client = std::make_unique<Client>(room, session, options, stop);
  return client->run();
}

}  // namespace osteon::haptic
