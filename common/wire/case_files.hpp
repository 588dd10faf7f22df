// Fetches the files of a room's case from its server.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>

#include "common/core/result.hpp"
#include "common/wire/room_client.hpp"

namespace grpc {
class ClientContext;
}

namespace osteon::wire {

// What the owner of a fetch may do from outside. Each may be empty.
struct FetchControl {
  std::function<bool()> stop{};                            // asked after each part
  std::function<bool(grpc::ClientContext& call)> begin{};  // before the call, which may be cancelled until `end`;
                                                           // false: it does not begin
  std::function<void(grpc::ClientContext& call)> end{};
  // Between two parts. A case over a slow line takes as long as it takes.
  std::chrono::milliseconds longest_silence{20'000};
};

// Writes the case's files to the folder as they are received. Errors: cancelled, unavailable (the server stopped or
// became silent), denied, not_found (the server has no such case), unsupported (it is older, or sent a file that no
// case has), internal (the folder cannot be written).
[[nodiscard]] Result<void> fetch_case_files(const JoinedRoom& room, const std::filesystem::path& folder,
                                            const FetchControl& control);

}  // namespace osteon::wire
