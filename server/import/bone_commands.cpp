#include <CLI/CLI.hpp>
#include <memory>

#include "common/volume/cut_field.hpp"
#include "server/import/command.hpp"

namespace osteon::import {

void add_bone_commands(CLI::App&, std::vector<Command>&) {}

}  // namespace osteon::import
