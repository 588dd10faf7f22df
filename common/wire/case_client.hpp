// Sends cases to a server, lists its cases, and opens a room with one of them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace grpc {
class Channel;
class Status;
}  // namespace grpc

namespace osteon::wire {

// A case as the server stores it.
struct StoredCaseLine {
  Digest hash;
  std::string title;
  std::uint64_t bytes = 0;  // of its files
  bool known = false;       // only after an upload: the server had it before
};

// What a server's answer means to a person. Errors: what the server says, in its words; unavailable (it does not
// answer).
[[nodiscard]] Error error_of_answer(const grpc::Status& status);

// Sorted by hash. Waits for the answer. Errors: those of error_of_answer(), unsupported (no answer of an Osteon
// server).
[[nodiscard]] Result<std::vector<StoredCaseLine>> list_cases(const std::shared_ptr<grpc::Channel>& channel);

// Sends a zip archive of a case, and waits until the server has checked and stored it. `keep_going` gets the fraction
// that is sent, also while the server checks, ten times a second unless the disk is slow; false cancels the upload, of
// which the server keeps nothing. Errors: those of list_cases(), not_found (the archive cannot be read), cancelled.
[[nodiscard]] Result<StoredCaseLine> upload_case(const std::shared_ptr<grpc::Channel>& channel,
                                                 const std::filesystem::path& archive, const KeepGoing& keep_going);

// Opens a room with a case of the server. `keep_going` as above. Errors: those of error_of_answer(), cancelled (the
// server may open the room all the same).
[[nodiscard]] Result<void> create_room_with(const std::shared_ptr<grpc::Channel>& channel, const std::string& room,
                                            const Digest& case_hash, const KeepGoing& keep_going);

}  // namespace osteon::wire
