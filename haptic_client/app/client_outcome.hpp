// What a session of the haptic client came to. Each worker fills its own part.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/field/field_hash.hpp"
#include "common/runtime/tick_stats.hpp"
#include "haptic_client/app/record.hpp"
#include "haptic_client/app/recorder.hpp"
#include "haptic_client/net/room_port.hpp"

namespace osteon::haptic {

// An instructor's decision about the hand, or what the haptic loop did because of it.
struct RestrictionNote {
  std::int64_t mono_ns = 0;
  std::uint64_t room_seq = 0;  // of the decision; 0: the loop's own note
  std::string what;
  std::string by{};  // who decided, as far as the room says it
};
struct WordsNote {
  std::int64_t mono_ns = 0;
  std::uint64_t room_seq = 0, from = 0;
  std::string words;
};

// Of the 1 kHz thread.
struct HapticOutcome {
  std::int64_t began_ns = 0;  // the session's first time
  TickStats ticks;
  bool realtime = false;     // the haptic thread had SCHED_FIFO
  std::uint64_t stalls = 0;  // times that it did not run for more than three periods, as its watchdog measured
  double longest_stall_ms = 0;
  std::uint64_t uncovered_ticks = 0, cuts_waiting_ticks = 0, rows_dropped = 0;
  std::uint64_t held_for_room_ticks = 0;  // ticks in which the spindle was held because the room was silent or behind
  struct MountReport {
    bool there = false;                // the room's bone stands on a mount, as far as the client knows
    double most_mm = 0, most_rad = 0;  // largest displacement of the bone from its rest pose, as the hand felt it
    double put_in_mj = 0, released_mj = 0, given_mj = 0, granted_mj = 0;  // see MountFollower
    double low_pass_s = 0;
  } mount;
};

// Of the replica's thread: the bone, and what the room decided.
struct ReplicaOutcome {
  // Of the bone that the room has confirmed up to room_seq; removed_total_mm3 too. None: leaves are missing.
  std::optional<Digest> field_hash;
  RoomSeq room_seq;
  double removed_total_mm3 = 0;
  std::vector<double> removed_mm3;  // of each step, by the cut field
  std::vector<RecordedCut> cuts;
  std::size_t unconfirmed = 0;  // own cuts that are not in it, because the room never confirmed them
  std::uint64_t rejected = 0;
  // Rejected: while stopped; because somebody else held the tool; because of the position or the tool.
  std::uint64_t cuts_stopped = 0, cuts_taken = 0, cuts_elsewhere = 0;
  std::vector<RestrictionNote> decisions;  // in the order received
  std::vector<WordsNote> words;
  std::uint64_t interruptions = 0;  // of the connection to the room, each followed by a reconnection
  std::uint64_t patches = 0;
  double patch_p50_us = 0, patch_p99_us = 0;
};

// Of the telemetry thread: what the rows of the ticks show.
struct TelemetryOutcome {
  std::vector<RestrictionNote> effects;    // of an instructor's decisions in the loop, in the order of the ticks
  std::uint64_t forbidden_ticks = 0;       // ticks in which the tool was not permitted to cut
  double supervised_step_n = 0;            // largest growth of the shown force in a tick while the hand was restricted
  double guide_mm = 0, guide_most_mm = 0;  // distance from the guiding handle: the last one, and the largest
  std::vector<RangeWatch::Use> outside_range;  // of force laws
};

struct ClientOutcome {
  bool stopped = false;       // by a signal, before the plan was done
  std::optional<Error> lost;  // why it ended early: the room was lost, or a disk with a log is full
  HapticOutcome haptic;
  ReplicaOutcome replica;
  TelemetryOutcome telemetry;
  std::vector<RestrictionNote> restrictions;  // decisions and effects, in the order of their times
  std::vector<StepResult> steps;
  FastPathHealth fast_path;
  Recorder::Outcome recording;
  DeviceLimits limits;
  LoopParams loop;
  double coupling_n_per_mm = 0, workspace_scale = 0;  // of the last step: K_c, and bone mm for each mm of the handle
};

}  // namespace osteon::haptic
