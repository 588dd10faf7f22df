#include "server/audit/syslog.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/runtime/log.hpp"

namespace osteon {
namespace {

constexpr int kAuthPriv = 10, kWarning = 4, kNotice = 5;
constexpr std::size_t kLongestHost = 255, kLongestMessageId = 32;

// HOSTNAME, PROCID and MSGID are printable ASCII without spaces, or "-" if empty (RFC 5424, 6.2).
std::string header_field(std::string_view text, std::size_t most) {
  std::string field(text.substr(0, most));
  std::ranges::replace_if(
      field, [](char c) { return c < 33 || c > 126; }, '_');
  return field.empty() ? "-" : field;
}

std::string host_name() {
  std::array<char, kLongestHost + 1> name{};
  if (::gethostname(name.data(), kLongestHost) != 0) return "-";
  return header_field(name.data(), kLongestHost);
}

// A value in quotes. These three characters have to be escaped (RFC 5424, 6.3.3).
std::string parameter(std::string_view name, std::string_view value) {
  std::string text = " " + std::string(name) + "=\"";
  for (const char c : clean_text(value)) {
    if (c == '"' || c == '\\' || c == ']') text += '\\';
    text += c;
  }
  return text + '"';
}

}  // namespace

std::string syslog_message(const AuditRecord& record, const AuditIdentity& who, const Digest& line_hash) {
  const int severity = record.result == "refused" ? kWarning : kNotice;
  // 32473 is the number for examples (RFC 5612); this project has none of its own.
  return "<" + std::to_string(kAuthPriv * 8 + severity) + ">1 " + record.time + " " + host_name() + " osteon-server " +
         std::to_string(::getpid()) + " " + header_field(record.action, kLongestMessageId) + " [osteon@32473" +
         parameter("sequence", std::to_string(record.sequence)) + parameter("person", who.person) +
         parameter("certificate", who.certificate) + parameter("ticket", who.ticket) +
         parameter("address", who.address) + parameter("identity", record.identity) +
         parameter("action", record.action) + parameter("object", record.object) + parameter("result", record.result) +
         parameter("detail", record.detail) + parameter("hash", to_hex(line_hash)) + "] " + clean_text(record.action) +
         (record.object.empty() ? "" : " " + clean_text(record.object)) + ": " + clean_text(record.result);
}

SyslogSocket::~SyslogSocket() {
  if (socket_ >= 0) ::close(socket_);
}

bool SyslogSocket::send(const std::string& message) {
  if (path_.empty()) return false;
  if (socket_ < 0) socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  const std::string name = path_.string();
  int reason = name.size() < sizeof at.sun_path ? 0 : ENAMETOOLONG;
  if (reason == 0) {
    std::memcpy(at.sun_path, name.data(), name.size());
    // Addressed by name each time, so that a restarted system log is found.
    const auto* to = reinterpret_cast<const sockaddr*>(&at);
    if (::sendto(socket_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL, to, sizeof at) >= 0) return true;
    reason = errno;
  }
  if (!std::exchange(warned_, true))
    log::warn("audit records do not reach the system's log",
              {{"socket", name}, {"reason", std::generic_category().message(reason)}});
  return false;
}

}  // namespace osteon
