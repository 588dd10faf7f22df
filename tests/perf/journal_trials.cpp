// osteon-journal-trials [SEEDS] [OPERATIONS]: journals on a disk that loses its power, fills up and fails; what was lost. JSON.
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/disk/journal_trials.hpp"

namespace {

nlohmann::json said(const osteon::test::Tally& tally) {
  return {{"trials", tally.trials},       {"acknowledged", tally.acknowledged}, {"recovered", tally.recovered},
          {"lost", tally.lost},           {"failed_disks", tally.failed},       {"closed", tally.closed},
          {"bad_trials", tally.bad_trials}, {"faults", tally.faults}};
}

}  // namespace

int main(int argc, char** argv) {
  using namespace osteon::test;
  const std::uint64_t seeds = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 2000;
  const std::uint64_t operations = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000;
  const nlohmann::json out{{"power_loss", said(power_loss_trials(1, seeds))},
                           {"not_durable", said(power_loss_trials(1, 100, false))},
                           {"full_disk", said(failing_disk_trials(1, operations, ENOSPC))},
                           {"failing_disk", said(failing_disk_trials(1, operations, EIO))},
                           {"forgotten_sync", said(forgotten_sync_trials(1, seeds / 2))}};
  std::printf("%s\n", out.dump(2).c_str());
  return 0;
}
