// The access list: revoked certificates, people and tickets, and changed roles. It is a text file that its owner may
// edit while the server runs.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "common/access/role.hpp"
#include "common/core/result.hpp"

namespace osteon {

// One entry in each line. Text after a # at the beginning of a line is a comment.
//   revoke certificate SERIAL     hexadecimal, as openssl x509 -serial prints it
//   revoke user NAME
//   revoke ticket ID              hexadecimal, as osteon-server ticket prints it
//   role NAME ROLE [ROOM]         replaces the role of the ticket, in all rooms or only in ROOM
// A role applies only in the rooms that the ticket is for. Calls that concern no room (cases) use the line without a
// room if there is one, otherwise the ticket's role.
class AccessList {
 public:
  // Error invalid_input: a line is none of these. `name` is the name of the file, for the message.
  [[nodiscard]] static Result<AccessList> parse(std::string_view text, const std::string& name);

  // The reason, one sentence, or nothing if certificate, user and ticket are all admitted. Serial numbers and ids may
  // be in any hexadecimal notation.
  [[nodiscard]] std::optional<std::string> refuses(std::string_view serial, std::string_view user,
                                                   std::string_view ticket_id) const;
  // Whether the other list revokes the same certificates, users and tickets.
  [[nodiscard]] bool revokes_as(const AccessList& other) const {
    return serials_ == other.serials_ && users_ == other.users_ && tickets_ == other.tickets_;
  }
  // The role that replaces the ticket's role.
  [[nodiscard]] Role role(std::string_view user, std::string_view room, Role of_ticket) const;
  [[nodiscard]] std::size_t size() const { return serials_.size() + users_.size() + tickets_.size() + roles_.size(); }

 private:
  std::set<std::string, std::less<>> serials_, users_, tickets_;
  std::map<std::pair<std::string, std::string>, Role> roles_;  // by user and room; empty room: every room
};

// The list in a file, read again when the file has changed. Not thread safe.
class AccessFile {
 public:
  explicit AccessFile(std::filesystem::path file) : file_(std::move(file)) {}
  // True if the list has changed. A missing file is an empty list at first. If the file later vanishes, cannot be read
  // or has an error, the list stays as it was and the error is returned. So a typing error never restores revoked
  // access.
  [[nodiscard]] Result<bool> refresh();
  [[nodiscard]] const AccessList& list() const { return list_; }

 private:
  std::filesystem::path file_;
  std::optional<std::string> text_;  // the text that was read last
  AccessList list_;
};

}  // namespace osteon
