// Two users push one bone on its mount over a bad line, on virtual time: the server at 120 Hz, clients and hands at 1
// kHz. Hands and energies are computed here, independently of the tested code.
#pragma once
#include <cstdint>

#include "common/mechanics/compliant_mount.hpp"

namespace osteon::test {

struct TwoUsersRun {
  long ticks = 20000;
  double delay_ms[2] = {0.0, 0.0};  // one way, of each user's line
  double jitter_ms = 0.0;           // deviation of the delay, more or less, uniform
  double loss = 0.0;                // share of lost packets
  std::uint64_t seed = 1;
  double cycle_s = 16.0;        // push, rest, release; only the end of a push is measured
  double hand_stiffness = 1.0;  // of the expert's, along the push
  double arm_mm = 30.0;         // distance of the line of push from the centre
  double least_push_mm = 3.0, most_push_mm = 7.0;
  bool shaken = false;  // the hands never rest
  MountServerParams server;
  MountFollowerParams client;
};

struct TwoUsersResult {
  int rests = 0;           // ends of pushes at which both were measured
  double worst_error = 0;  // of either force against the closed form, relative to the other user's part
  double mean_error = 0;
  double least_other_n = 1e300;           // the least part of the felt force that came from the other
  double most_created_mj = 0;             // at any time: what both bones gave, less what both hands put in
  double most_force_n[2] = {};            // in the first and in the second half of the time
  double most_step_mm = 0;                // of a shown bone in a tick
  double rest_speed_mm_per_s = 0;         // of a shown bone at the ends of pushes
  long held_back = 0;                     // ticks of either client
  double put_in_mj = 0, released_mj = 0;  // as reported by the clients
  double account_difference_mj = 0;       // between that and the work computed here
  double slowest_low_pass_s = 0;
};

[[nodiscard]] TwoUsersResult push_each_other(const TwoUsersRun& run);

}  // namespace osteon::test
