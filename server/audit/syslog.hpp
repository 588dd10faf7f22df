// Messages to the system's log (RFC 5424) over a Unix datagram socket, at which journald or rsyslog listens.
#pragma once
#include <filesystem>
#include <string>

#include "server/audit/audit_record.hpp"

namespace osteon {

// Where journald and rsyslog listen.
inline constexpr const char* kSystemLogSocket = "/dev/log";

// A record as a message: facility authpriv, severity notice, of a refusal warning. `line_hash` lets a reader tell
// later whether the end of the log is missing.
[[nodiscard]] std::string syslog_message(const AuditRecord& record, const AuditIdentity& who, const Digest& line_hash);

// Not thread safe.
class SyslogSocket {
 public:
  explicit SyslogSocket(std::filesystem::path path) : path_(std::move(path)) {}
  ~SyslogSocket();
  SyslogSocket(const SyslogSocket&) = delete;
  SyslogSocket& operator=(const SyslogSocket&) = delete;
  // Never waits. False: the message was not taken; the first time, the program's log says why.
  bool send(const std::string& message);

 private:
  const std::filesystem::path path_;
  int socket_ = -1;
  bool warned_ = false;
};

}  // namespace osteon
