// Certificates that a server must refuse, each wrong in one way.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/authentication/people.hpp"

namespace osteon::test {

struct WrongCertificate {
  std::string kind;              // what is wrong with it
  std::filesystem::path folder;  // person.pem and person.key; empty: no certificate is shown
  std::string user = "anna";     // the person that it claims to be
};
// Makes them below `into`. Two are revoked by the people's lists; the server must read these lists afterwards.
[[nodiscard]] std::vector<WrongCertificate> wrong_certificates(People& people, const std::filesystem::path& into);

}  // namespace osteon::test
