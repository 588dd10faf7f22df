// The replica's thread of the haptic client. It applies own cuts and the room's messages to the replica, samples it
// round the tool for the haptic loop, and watches whether the room still follows.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/stop_signal.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/app/client_end.hpp"
#include "haptic_client/app/client_outcome.hpp"
#include "haptic_client/app/client_room.hpp"
#include "haptic_client/app/cut_log.hpp"
#include "haptic_client/app/room_queue.hpp"
#include "haptic_client/app/worker_exchange.hpp"
#include "haptic_client/contact/patch_builder.hpp"

namespace osteon::haptic {

class ReplicaWorker {
 public:
  // [replica] Called once, with the bone as it was joined. An error ends the client.
  using JoinCheck = std::function<Result<void>(const Replica& joined)>;

  // Longest wait for the room's decisions after finish(), if no stop was requested.
  static constexpr std::chrono::seconds kConfirmPatience{20};

  // `session`: its loop closes the cuts. All references must outlive this.
  ReplicaWorker(const ClientRoom& room, Session& session, JoinCheck check, WorkerExchange& exchange, ClientEnd& end,
                const StopSignal& stop);

  // What the room sends goes in here.
  [[nodiscard]] RoomQueue& queue() noexcept { return queue_; }
  // The whole bone was received, and the check was passed. Any thread.
  [[nodiscard]] bool joined() const noexcept { return joined_; }

  // The thread's function. Returns some time after finish(): when the room has decided every own cut, or the client's
  // end, or the patience for that, has come. From then on the queue takes nothing.
  void run();
  // The haptic loop is over: no more cuts will be closed. Any thread.
  void finish() noexcept { finishing_ = true; }
  // After run(), any thread.
  [[nodiscard]] ReplicaOutcome outcome() const;

 private:
  void take_own_cuts();
  void send_waiting();
  void take(const FieldLeaf& leaf);
  void take(const Interrupted& interrupted);
  void take(const RoomAtJoin& room);
  void take(const BonePart& part);
  void take(const HandSupervised& decided);
  void take(const ChatReceived& said);
  void take(const EventNoted& noted) { replica_.note(noted.seq); }
  void take(const SceneSet& scene);
  void take(const CutCommitted& committed);
  void take(const CutRejected& rejected);
  // Replaces the bone after an interruption.
  void renew(const RoomAtJoin& room);
  void follow_lease(std::uint64_t epoch);
  void make_partner_solid(const std::string& name);
  // The solid of a definition. It is made once, because that takes up to a tenth of a second.
  const std::shared_ptr<const SolidLattice>& solid_of(const ToolBox::Entry& entry);
  void watch_room(bool any_received);
  void build_patch();
  // Notes the bone removed by the steps before this one, unless it was noted.
  void note_removed(std::size_t step);

  const ClientRoom room_;
  HapticLoop& loop_;
  const JoinCheck check_;
  WorkerExchange& exchange_;
  ClientEnd& end_;
  const StopSignal& stop_;
  RoomQueue queue_;
  std::atomic<bool> joined_{false}, finishing_{false};

  // [replica] The rest.
  Replica replica_;
  PatchBuilder builder_;
  CutLog cut_log_;
  ConfirmationMonitor monitor_;
  std::map<Digest, std::shared_ptr<const SolidLattice>> solids_;  // of definitions, for guides and partners' tools
  PartnerSolids known_solids_;
  std::uint64_t lease_epoch_;  // of the room, as far as received
  std::deque<Cut> unsent_;     // bounded like the unconfirmed cuts
  bool supervised_ = false;    // the hand is restricted
  bool changing_ = false;      // part of a change of the bone has been received
  bool interrupted_ = false;   // since then leaves are collected in renewed_
  std::vector<FieldLeaf> renewed_;
  int rejected_in_a_row_ = 0;
  Pose built_at_;
  int built_tool_ = -1;
  std::size_t noted_steps_ = 0;
  double noted_mm3_ = 0;
  DurationHistogram patch_times_;
  ReplicaOutcome outcome_;
};

}  // namespace osteon::haptic
