// Decides whose order of ciphers counts in the TLS handshakes of this process.
#pragma once
#include "common/core/result.hpp"

namespace osteon {

// Makes the server's order count from now on. The order of OpenSSL begins with the strongest cipher; a client's order
// may not. gRPC 1.51 has no option for this, so the function changes the defaults of every TLS context of the process.
// All other defaults stay as in Debian. Call it before the first server starts, on any thread. Error internal: OpenSSL
// refuses.
[[nodiscard]] Result<void> prefer_own_cipher_order();

}  // namespace osteon
