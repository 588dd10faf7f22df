#include "common/access/role.hpp"

#include <array>

namespace osteon {
namespace {

constexpr std::array<std::string_view, kRoles> kNames{"none",         "observer",   "trainee",
                                                      "collaborator", "instructor", "operator"};

}  // namespace

std::string_view to_string(Role role) { return kNames.at(static_cast<std::size_t>(role)); }

std::optional<Role> parse_role(std::string_view text) {
  for (std::size_t i = 1; i < kNames.size(); ++i)
    if (kNames[i] == text) return static_cast<Role>(i);
  return {};
}

}  // namespace osteon
