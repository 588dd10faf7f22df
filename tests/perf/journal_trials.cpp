// osteon-journal-trials [SEEDS] [OPERATIONS] [DAMAGES]: runs journals on a disk that loses its power, fills up and
// fails, and damages their files. Counts what was lost, and what was lost silently. Prints JSON.
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/disk/damage_trials.hpp"
#include "tests/support/disk/journal_trials.hpp"

namespace {

nlohmann::json said(const osteon::test::Tally& tally) {
  return {{"trials", tally.trials},         {"acknowledged", tally.acknowledged},
          {"recovered", tally.recovered},   {"lost", tally.lost},
          {"failed_disks", tally.failed},   {"closed", tally.closed},
          {"bad_trials", tally.bad_trials}, {"faults", tally.faults}};
}

nlohmann::json said(const osteon::test::DamageTally& tally) {
  return {{"trials", tally.trials},   {"acknowledged", tally.acknowledged},
          {"whole", tally.whole},     {"named", tally.named},
          {"refused", tally.refused}, {"silent", tally.silent},
          {"done", tally.done},       {"called_damaged", tally.called_damaged},
          {"faults", tally.faults}};
}

}  // namespace

int main(int argc, char** argv) {
  using namespace osteon::test;
  const std::uint64_t seeds = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 2000;
  const std::uint64_t operations = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000;
  const std::uint64_t damages = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 2000;
  const nlohmann::json out{{"damage", said(damage_trials(1, damages))},
                           {"damage_only_log", said(damage_trials(1, damages / 10, DamagedFiles::only_log_left))},
                           {"kills", said(kill_trials(30000, 2000, false))},
                           {"power_failures", said(kill_trials(30000, 2000, true))},
                           {"power_loss", said(power_loss_trials(1, seeds))},
                           {"not_durable", said(power_loss_trials(1, 100, false))},
                           {"full_disk", said(failing_disk_trials(1, operations, ENOSPC))},
                           {"failing_disk", said(failing_disk_trials(1, operations, EIO))},
                           {"forgotten_sync", said(forgotten_sync_trials(1, seeds / 2))}};
  std::printf("%s\n", out.dump(2).c_str());
  return 0;
}
