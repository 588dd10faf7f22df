// Two users push one bone on its mount over a bad line, on virtual time: the server at 120 Hz, clients and hands at 1
// kHz. Hands and energies are reckoned here, apart from the code that is tested.
#pragma once
#include <cstdint>

#include "common/mechanics/compliant_mount.hpp"

namespace osteon::test {

struct TwoUsersRun {
  long ticks = 20000;
  double delay_ms[2] = {0.0, 0.0};  // one way, of each user's line
  double jitter_ms = 0.0;           // as much more or less, evenly
  double loss = 0.0;                // share of the packets
  std::uint64_t seed = 1;
  double cycle_s = 16.0;        // push, rest, let go; only the last of it is measured
  double hand_stiffness = 1.0;  // of the expert's, along the push
  double arm_mm = 30.0;         // the line of push passes the centre at this distance
  double least_push_mm = 3.0, most_push_mm = 7.0;
  bool shaken = false;  // the hands never rest
  MountServerParams server;
  MountFollowerParams client;
};

struct TwoUsersResult {
  int rests = 0;           // ends of pushes at which both were measured
  double worst_error = 0;  // of either's force against the closed form, as a part of what the other made of it
  double mean_error = 0;
  double least_other_n = 1e300;           // the least that one made of what the other felt
  double most_created_mj = 0;             // at any time: what both bones gave, less what both hands put in
  double most_force_n[2] = {};            // in the first and in the second half of the time
  double most_step_mm = 0;                // of a shown bone in a tick
  double rest_speed_mm_per_s = 0;         // of a shown bone at the ends of pushes
  long held_back = 0;                     // ticks of either client
  double put_in_mj = 0, released_mj = 0;  // as the clients tell it
  double account_difference_mj = 0;       // of that from the work reckoned here
  double slowest_low_pass_s = 0;
};

[[nodiscard]] TwoUsersResult push_each_other(const TwoUsersRun& run);

}  // namespace osteon::test
