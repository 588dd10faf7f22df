// The running haptic client: the 1 kHz thread, the thread of the replica and its patches, and the one that reports.
// They share no lock with the haptic thread; data crosses by TripleBuffer and fixed queues.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/stop_signal.hpp"
#include "common/runtime/tick_stats.hpp"
#include "haptic_client/app/record.hpp"
#include "haptic_client/app/recorder.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/net/room_session.hpp"

namespace osteon::haptic {

struct ClientOptions {
  std::filesystem::path session_log;
  std::filesystem::path record;            // HDF5
  const RecordedDevice* played = nullptr;  // in the hand; the room's bone must be as it was when it began
  bool status = false;                     // a line each second on standard output
};

// Something that an instructor decided about the hand, or what the hand's loop made of it.
struct OversightNote {
  std::int64_t mono_ns = 0;
  std::uint64_t room_seq = 0;  // of the decision; 0: the loop's own
  std::string what;
  std::string by{};  // who decided, as far as the room says it
};
struct WordsNote {
  std::int64_t mono_ns = 0;
  std::uint64_t room_seq = 0, from = 0;
  std::string words;
};

struct ClientOutcome {
  bool stopped = false;       // by a signal, before the plan was done
  std::optional<Error> lost;  // why it ended before its time: the room, or a log on a full disk
  std::vector<StepResult> steps;
  std::vector<double> removed_mm3;  // of each step, by the cut field
  std::vector<RecordedCut> cuts;
  TickStats ticks;
  bool realtime = false;     // the haptic thread had SCHED_FIFO
  std::uint64_t stalls = 0;  // times that it did not run for more than three periods, as its watchdog saw
  double longest_stall_ms = 0;
  // Of the bone that the room has confirmed up to room_seq; so is what was removed. None: leaves are missing.
  std::optional<Digest> field_hash;
  RoomSeq room_seq;
  double removed_total_mm3 = 0;
  std::size_t unconfirmed = 0;  // own cuts that are not in it, since the room never confirmed them
  std::uint64_t rejected = 0, patches = 0, uncovered_ticks = 0, cuts_waiting_ticks = 0, rows_dropped = 0;
  std::uint64_t held_for_room_ticks = 0;  // in which the spindle was held because the room did not follow
  std::vector<OversightNote> restrictions;   // as they came
  std::vector<WordsNote> words;
  std::int64_t began_ns = 0;          // of these times, the session's first
  std::uint64_t forbidden_ticks = 0;  // in which the tool might not cut
  std::uint64_t cuts_stopped = 0, cuts_taken = 0,
                cuts_elsewhere = 0;  // refused as stopped; as somebody else's tool; as of place or tool
  double supervised_step_n = 0;  // largest growth of the force shown in a tick, while anything was decided about the hand
  double guide_mm = 0, guide_most_mm = 0;  // from the hand that leads this one: when it did last, and at most
  struct MountReport {
    bool there = false;                // the room's bone stands on one, as far as the hand was told
    double most_mm = 0, most_rad = 0;  // that the bone was away from where it rests, as the hand felt it
    double put_in_mj = 0, released_mj = 0, given_mj = 0, granted_mj = 0;  // see MountFollower
    double low_pass_s = 0;
  } mount;
  FastPathHealth fast_path;
  std::uint64_t interruptions = 0;  // of the line to the room, after which it stood again
  double patch_p50_us = 0, patch_p99_us = 0;
  Recorder::Outcome recording;
  std::vector<RangeWatch::Use> outside_range;  // of force laws
  DeviceLimits limits;
  LoopParams loop;
  double coupling_n_per_mm = 0, workspace_scale = 0;  // of the last step: K_c, and bone mm for each mm of the handle
};

// Runs a session to its end and waits until the room has confirmed every cut. Where the server goes away, force and
// spindle are down by then, or it stops confirming, the outcome says so (`lost`) and tells what was done until then.
// Error internal: a log or recording cannot be made; nothing was begun.
[[nodiscard]] Result<ClientOutcome> run_client(RoomSession& room, Session& session, const ClientOptions& options,
                                               const StopSignal& stop);

}  // namespace osteon::haptic
