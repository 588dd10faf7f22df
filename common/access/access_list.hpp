// Whom the server no longer lets in, and whose role has changed: a text file that its owner edits while the server
// runs.
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

// One entry in a line; what follows a # at its beginning is for people:
//   revoke certificate SERIAL     hexadecimal, as openssl x509 -serial says it
//   revoke user NAME
//   revoke ticket ID              hexadecimal, as osteon-server ticket says it
//   role NAME ROLE [ROOM]         instead of the ticket's: in every room, or in that one alone. It opens no room that
//   the ticket is
//                                 not for, and what is about no room, as cases are, goes by the ticket or the line
//                                 without a room
class AccessList {
 public:
  // Error invalid_input: the line that is none of these. `name`: of the file, for the sentence.
  [[nodiscard]] static Result<AccessList> parse(std::string_view text, const std::string& name);

  // The reason, one sentence; nothing where all three may come in. Serial numbers and ids in any writing of
  // hexadecimal.
  [[nodiscard]] std::optional<std::string> refuses(std::string_view serial, std::string_view user,
                                                   std::string_view ticket_id) const;
  // Whether the other list revokes the same certificates, users and tickets.
  [[nodiscard]] bool revokes_as(const AccessList& other) const {
    return serials_ == other.serials_ && users_ == other.users_ && tickets_ == other.tickets_;
  }
  // What holds instead of the ticket's role.
  [[nodiscard]] Role role(std::string_view user, std::string_view room, Role of_ticket) const;
  [[nodiscard]] std::size_t size() const { return serials_.size() + users_.size() + tickets_.size() + roles_.size(); }

 private:
  std::set<std::string, std::less<>> serials_, users_, tickets_;
  std::map<std::pair<std::string, std::string>, Role> roles_;  // by user and room; room empty: every room
};

// The list in a file, read again when it has changed. Not thread safe.
class AccessFile {
 public:
  explicit AccessFile(std::filesystem::path file) : file_(std::move(file)) {}
  // True when the list is another one now. A file that is not there is an empty list at first; one that vanishes, or
  // cannot be read or understood (the error), leaves the list as it was: nobody comes in again by a slip of the pen.
  [[nodiscard]] Result<bool> refresh();
  [[nodiscard]] const AccessList& list() const { return list_; }

 private:
  std::filesystem::path file_;
  std::optional<std::string> text_;  // that was read last
  AccessList list_;
};

}  // namespace osteon
