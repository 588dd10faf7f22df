#include "common/access/access_list.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

#include "common/access/ticket.hpp"

namespace osteon {
namespace {

constexpr std::uintmax_t kMostFileBytes = 4 * 1024 * 1024;

// Upper case, without colons and leading zeros, so that 0A:1f and a1f are the same number. Empty: not a number.
std::string number_of(std::string_view text) {
  std::string number;
  for (const char c : text) {
    if (c == ':') continue;
    if (!std::isxdigit(static_cast<unsigned char>(c))) return {};
    if (c != '0' || !number.empty()) number += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  if (number.empty() && !text.empty()) number = "0";
  return number;
}

std::string trimmed(std::string_view text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

}  // namespace

Result<AccessList> AccessList::parse(std::string_view text, const std::string& name) {
  AccessList list;
  std::istringstream in{std::string(text)};
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string first, second, third, rest;
    if (!(words >> first) || first.starts_with('#')) continue;
    words >> second >> third;
    std::getline(words, rest);
    rest = trimmed(rest);
    const auto wrong = [&](const char* what) {
      return failure(ErrorCode::invalid_input,
                     name + ":" + std::to_string(number) + ": " + what +
                         "; a line is \"revoke certificate|user|ticket WHICH\" or \"role NAME ROLE [ROOM]\"");
    };
    if (first == "revoke" && rest.empty() && !third.empty()) {
      if (second == "user") {
        if (!is_user_name(third)) return wrong("this is not a user name");
        list.users_.insert(third);
      } else if (second == "certificate" || second == "ticket") {
        const std::string which = number_of(third);
        if (which.empty()) return wrong("this is not a hexadecimal number");
        (second == "ticket" ? list.tickets_ : list.serials_).insert(which);
      } else {
        return wrong("only certificates, users and tickets can be revoked");
      }
    } else if (first == "role" && !third.empty()) {
      const std::optional<Role> role = parse_role(third);
      if (!is_user_name(second)) return wrong("this is not a user name");
      if (!role) return wrong("this is not a role");
      list.roles_[{second, rest}] = *role;
    } else {
      return wrong("this line cannot be understood");
    }
  }
  return list;
}

std::optional<std::string> AccessList::refuses(std::string_view serial, std::string_view user,
                                               std::string_view ticket_id) const {
  if (serials_.contains(number_of(serial)))
    return "the certificate " + std::string(serial) + " was revoked; ask for a new one";
  if (users_.contains(user)) return "the user " + std::string(user) + " was revoked; ask whoever runs the server";
  if (tickets_.contains(number_of(ticket_id)))
    return "the ticket " + std::string(ticket_id) + " was revoked; ask for a new one";
  return {};
}

Role AccessList::role(std::string_view user, std::string_view room, Role of_ticket) const {
  for (const std::string_view where : {room, std::string_view()})
    if (const auto found = roles_.find({std::string(user), std::string(where)}); found != roles_.end())
      return found->second;
  return of_ticket;
}

Result<bool> AccessFile::refresh() {
  std::error_code error;
  if (!text_ && !std::filesystem::exists(file_, error) && !error) return false;
  const std::uintmax_t size = std::filesystem::file_size(file_, error);
  if (!error && size > kMostFileBytes)
    return failure(ErrorCode::invalid_input, file_.string() + " is larger than 4 MiB; this is not an access list");
  std::ifstream in(file_, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (error || !in)
    return failure(ErrorCode::not_found, file_.string() + " cannot be read; the list read before stays in force");
  if (text_ == text) return false;
  text_ = text;  // so that a faulty text is reported only once
  Result<AccessList> read = AccessList::parse(text, file_.string());
  if (!read) return tl::unexpected(read.error());
  list_ = std::move(*read);
  return true;
}

}  // namespace osteon
