// The commands osteon-server audit verify, show and erase-person, and the audit records of commands that work on a
// journal.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "server/audit/audit_log.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the commands to the program. Parsing sets `chosen` if one of them was given.
void add_audit_commands(CLI::App& app, std::function<Result<void>()>& chosen);

// Runs a command and records its result, as done by the system's user. The record goes to the audit log in the folder
// of `file` (a journal or a key), if there is one. `event`: action, object and detail. `signing_key`: empty: the key in
// that folder. If the record cannot be written, standard error says so. This is no error of the command, since anybody
// who can read journals can copy them unseen anyway.
[[nodiscard]] Result<void> run_audited(const std::filesystem::path& file, const std::filesystem::path& signing_key,
                                       AuditEvent event, const std::function<Result<void>()>& command);

// Writes the record alone.
void record_beside(const std::filesystem::path& file, const std::filesystem::path& signing_key, AuditEvent event);

}  // namespace osteon
