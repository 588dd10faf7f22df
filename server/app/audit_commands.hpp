// osteon-server audit verify, show and forget; and what other commands add to the audit log beside their journal.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "server/audit/audit_log.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds them to the program. `chosen` is set by parsing where one was given.
void add_audit_commands(CLI::App& app, std::function<Result<void>()>& chosen);

// Runs a command and records what came of it in the audit log in the folder of `file`, a journal or a key, where there
// is one; by the system's user. `event`: its action, object and detail. `signing_key`: empty for the one in that
// folder. Where it cannot be recorded, standard error says so: whoever may read journals can copy them unseen as well.
[[nodiscard]] Result<void> run_audited(const std::filesystem::path& file, const std::filesystem::path& signing_key,
                                       AuditEvent event, const std::function<Result<void>()>& command);

// The record alone.
void record_beside(const std::filesystem::path& file, const std::filesystem::path& signing_key, AuditEvent event);

}  // namespace osteon
