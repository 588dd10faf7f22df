// Messages to the system's log (RFC 5424) over a Unix datagram socket on which journald or rsyslog listens.
#pragma once
#include <filesystem>
#include <string>

#include "server/audit/audit_record.hpp"

namespace osteon {

// The socket of journald and rsyslog.
inline constexpr const char* kSystemLogSocket = "/dev/log";

// A record as a message: facility authpriv, severity notice, or warning for a refusal. `line_hash` later shows a reader
// whether the end of the log is missing.
[[nodiscard]] std::string syslog_message(const AuditRecord& record, const AuditIdentity& who, const Digest& line_hash);

// Not thread safe.
class SyslogSocket {
 public:
  explicit SyslogSocket(std::filesystem::path path) : path_(std::move(path)) {}
  ~SyslogSocket();
  SyslogSocket(const SyslogSocket&) = delete;
  SyslogSocket& operator=(const SyslogSocket&) = delete;
  // Never blocks. False: the message was not accepted. The first time, the program's log says why.
  bool send(const std::string& message);

 private:
  const std::filesystem::path path_;
  int socket_ = -1;
  bool warned_ = false;
};

}  // namespace osteon
