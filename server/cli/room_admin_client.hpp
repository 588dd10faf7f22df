// Asks a server about its rooms as a whole, for the command line.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/wire/case_client.hpp"
#include "common/wire/credentials.hpp"

namespace grpc {
class Channel;
}

namespace osteon {

// A room as in proto/osteon/v1/rooms.proto.
struct RoomLine {
  std::string name;
  bool open = false;  // not open, but at an event: it has stopped and takes no more cuts
  bool kept = false, replay = false;
  std::string case_title;
  RoomSeq room_seq;
  std::uint32_t sessions = 0, watchers = 0;
  std::string parent;
  RoomSeq parent_room_seq;
};

// Every call waits for the server's answer, which may take long. Errors: what the server says, in its words;
// unavailable (the server does not answer).
class RoomAdminClient {
 public:
  [[nodiscard]] static Result<RoomAdminClient> reach(const std::string& address, std::chrono::milliseconds patience,
                                                     const std::function<bool()>& stop,
                                                     const wire::ClientCredentials& credentials = {});

  [[nodiscard]] Result<std::vector<RoomLine>> list();
  [[nodiscard]] Result<RoomLine> create(const std::string& name, const std::string& case_hash_hex);
  [[nodiscard]] Result<RoomLine> close(const std::string& name);
  [[nodiscard]] Result<RoomLine> resume(const std::string& name);
  [[nodiscard]] Result<RoomLine> branch(const std::string& name, const std::string& new_name, RoomSeq to);
  [[nodiscard]] Result<RoomLine> replay(const std::string& name, const std::string& new_name, RoomSeq from, RoomSeq to,
                                        double speed);
  [[nodiscard]] Result<std::vector<std::string>> remove(const std::string& name, bool with_branches);
  struct Checked {
    RoomSeq room_seq;
    Digest chain, field_hash;
    std::uint32_t checkpoints = 0;
    std::vector<std::string> faults;
  };
  [[nodiscard]] Result<Checked> verify(const std::string& name);
  struct Copied {
    RoomSeq room_seq;
    std::string file;
  };
  [[nodiscard]] Result<Copied> back_up(const std::string& name, const std::string& file_name);
  [[nodiscard]] Result<std::vector<wire::StoredCaseLine>> cases() { return wire::list_cases(channel_); }
  // `archive`: a zip of a case. See wire::upload_case().
  [[nodiscard]] Result<wire::StoredCaseLine> upload_case(const std::filesystem::path& archive,
                                                         const KeepGoing& keep_going) {
    return wire::upload_case(channel_, archive, keep_going);
  }

 private:
  explicit RoomAdminClient(std::shared_ptr<grpc::Channel> channel) : channel_(std::move(channel)) {}
  std::shared_ptr<grpc::Channel> channel_;  // shared with the stubs made from it
};

}  // namespace osteon
