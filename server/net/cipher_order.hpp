// Whose order of ciphers counts in the handshakes of this process.
#pragma once
#include "common/core/result.hpp"

namespace osteon {

// From now on the server's: OpenSSL's own begins with the strongest, and a client's may not. gRPC 1.51 has no option
// for it, so this changes what each TLS context of the process begins with. Otherwise that stays as Debian has it. Call
// it before the first server starts; any thread. Error internal: OpenSSL refuses.
[[nodiscard]] Result<void> prefer_own_cipher_order();

}  // namespace osteon
