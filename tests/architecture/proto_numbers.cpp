// Prints every number of the compiled protocol, for tests/architecture/osteon.v1.numbers.
#include <fstream>
#include <iostream>
#include <iterator>

#include "tests/architecture/proto_rules.hpp"

int main() {
  std::ifstream in(OSTEON_DESCRIPTOR, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const auto protocol = osteon::test::load_protocol(bytes);
  if (protocol.files.empty()) {
    std::cerr << "osteon-proto-numbers: cannot read the descriptor " << OSTEON_DESCRIPTOR
              << "; build osteon_proto first\n";
    return 1;
  }
  std::cout
      << "# Numbers of the protocol, never to change their meaning. Written by the target update_proto_numbers.\n";
  for (const auto& line : osteon::test::numbers(protocol)) std::cout << line << '\n';
}
