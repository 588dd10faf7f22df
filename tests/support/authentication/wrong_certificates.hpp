// Certificates with which nobody may come in, each wrong in one way.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/authentication/people.hpp"

namespace osteon::test {

struct WrongCertificate {
  std::string kind;              // what is wrong with it
  std::filesystem::path folder;  // person.pem and person.key; empty: no certificate is shown
  std::string user = "anna";     // whose it says to be
};
// Made beneath `into`. Two are revoked by the people's lists, which whoever serves has to read after this.
[[nodiscard]] std::vector<WrongCertificate> wrong_certificates(People& people, const std::filesystem::path& into);

}  // namespace osteon::test
