// The configuration of osteon-server: from a YAML file, from the command line, or from both.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "server/publish/mesh_publisher.hpp"
#include "server/room/room.hpp"
#include "server/rooms/rooms.hpp"
#include "server/storage/case_cache.hpp"

namespace osteon {

// Limits of cuts that come over a network. No surgical motor gives more than 500 W [A]. A swept voxel takes about a
// nanosecond of a core; a cup reamer needs 2e8.
inline constexpr CutLimits kServedLimits{
    .time_slack = std::chrono::milliseconds(1000), .swept_voxels_per_s = 5e8, .power_w = 500.0};

inline constexpr int kMostCaseMemoryMib = 1 << 20;

struct ServerConfig {
  std::vector<std::filesystem::path> case_folders;
  std::string listen = "127.0.0.1:0";  // HOST:PORT
  std::string udp_listen;              // HOST:PORT of the fast path; empty: the host of `listen`, a free port
  std::filesystem::path certificates;  // folder, as in Authorizer::open
  std::filesystem::path proxy_socket;  // Unix socket for a proxy of this machine; empty: none
  bool plain = false;                  // without certificates: plain text, on this machine alone
  int most_ticket_hours = 0;           // 0: no limit for the life of a ticket
  int most_connections = 512;          // of all clients together
  int most_rooms = kMostRooms;         // open and closed ones together
  int most_rooms_per_person = kMostRoomsPerPerson, most_backups_per_person = kMostBackupsPerPerson;
  std::filesystem::path address_file, summary_file, tools_folder;
  std::filesystem::path save_file, resume_file, journal_file, rooms_folder, uploads_folder;
  std::filesystem::path signing_key;   // empty: beside the journals
  std::filesystem::path audit_file;    // empty: audit.log beside the journals, if there are any
  std::filesystem::path audit_syslog;  // Unix datagram socket; empty: none
  int audit_retention_days = 365;      // 0: records are never removed
  int case_memory_mib = static_cast<int>(kMostCaseMemory >> 20);  // of all cases in memory
  int retention_days = 0;                                         // 0: nobody is erased
  Detail detail = Detail::automatic;
  std::string metrics;    // HOST:PORT or PORT, for this machine alone; empty: no metrics
  bool mount = false;     // the bones of rooms stand on compliant mounts
  int drain_seconds = 5;  // time that clients get to leave in good order
  CutLimits limits = kServedLimits;
};

struct ConfigRead {
  ServerConfig config;
  // Each is one sentence: "FILE:LINE: "field": what is wrong; what to write". None: the file is correct.
  std::vector<std::string> faults;
};

// Reads a file over the values in `config`. A relative path begins at the file's folder. Error not_found or internal:
// the file cannot be read.
[[nodiscard]] Result<ConfigRead> read_server_config(const std::filesystem::path& file, ServerConfig config = {});

// Checks whether all values fit together, wherever they came from. Error invalid_input, naming the field as the command
// line does.
[[nodiscard]] Result<void> check_server_config(const ServerConfig& config);
// Checks whether the folders and files that it names exist. Error not_found, naming the field and the path.
[[nodiscard]] Result<void> check_server_places(const ServerConfig& config);

// The fields that a file may have, in order of their names; those of "limits" as limits.NAME.
[[nodiscard]] std::vector<std::string> server_config_fields();

}  // namespace osteon
