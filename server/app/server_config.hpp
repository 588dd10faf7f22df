// Everything that osteon-server is told: from a YAML file, from the command line, or from both.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "server/net/case_cache.hpp"
#include "server/net/mesh_publisher.hpp"
#include "server/net/rooms.hpp"
#include "server/room/room.hpp"

namespace osteon {

// What is asked of a hand over a network. No surgical motor gives more than 500 W [A]. A swept voxel takes about a
// nanosecond of a core; a cup reamer asks for 2e8.
inline constexpr CutLimits kServedLimits{
    .time_slack = std::chrono::milliseconds(1000), .swept_voxels_per_s = 5e8, .power_w = 500.0};

inline constexpr int kMostCaseMemoryMib = 1 << 20;

struct ServerConfig {
  std::vector<std::filesystem::path> case_folders;
  std::string listen = "127.0.0.1:0";  // HOST:PORT
  std::string udp_listen;              // HOST:PORT of the fast path; empty: where `listen` is, a free port
  std::filesystem::path certificates;  // folder, as Authorizer::open has it
  std::filesystem::path proxy_socket;  // Unix socket for a proxy of this machine; empty: none
  bool plain = false;                  // without: plain text, on this machine alone
  int most_ticket_hours = 0;           // 0: however long a ticket is good
  int most_connections = 512;          // of everybody together
  int most_rooms = kMostRooms;         // open and closed ones together
  int most_rooms_per_person = kMostRoomsPerPerson, most_backups_per_person = kMostBackupsPerPerson;
  std::filesystem::path address_file, summary_file, tools_folder;
  std::filesystem::path save_file, resume_file, journal_file, rooms_folder, uploads_folder;
  std::filesystem::path signing_key;   // empty: beside the journals
  std::filesystem::path audit_file;    // empty: audit.log beside the journals, where any are kept
  std::filesystem::path audit_syslog;  // Unix datagram socket; empty: none
  int audit_retention_days = 365;      // 0: records are never removed
  int case_memory_mib = static_cast<int>(kMostCaseMemory >> 20);  // of all cases in memory
  int retention_days = 0;                                         // 0: nobody is forgotten
  Detail detail = Detail::automatic;
  std::string metrics;    // HOST:PORT or PORT, of this machine alone; empty: none are served
  bool mount = false;     // the bones of rooms stand on mounts
  int drain_seconds = 5;  // that clients are given to leave in good order
  CutLimits limits = kServedLimits;
};

struct ConfigRead {
  ServerConfig config;
  std::vector<std::string>
      faults;  // "FILE:LINE: "field": what is wrong; what to write", each one sentence; none: it is sound
};

// Reads a file over what `config` holds. A path that is not absolute begins at the file's folder. Error not_found or
// internal: the file cannot be read.
[[nodiscard]] Result<ConfigRead> read_server_config(const std::filesystem::path& file, ServerConfig config = {});

// Whether what was told fits together, wherever it was told. Error invalid_input, naming the field as the command line
// does.
[[nodiscard]] Result<void> check_server_config(const ServerConfig& config);
// Whether the folders and files that it names are there. Error not_found, naming the field and the path.
[[nodiscard]] Result<void> check_server_places(const ServerConfig& config);

// The fields that a file may have, in the order of their names; those of "limits" as limits.NAME.
[[nodiscard]] std::vector<std::string> server_config_fields();

}  // namespace osteon
