// An instructor's connection to a room. It receives the state of the people and sends the instructor's requests.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/result.hpp"
#include "common/wire/credentials.hpp"
#include "common/wire/room_client.hpp"
#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

struct PeopleClientOptions {
  std::string address;  // host:port
  std::string room{};   // empty: the only open room
  wire::ClientCredentials credentials{};
  std::string name = "console";  // shown to others
  std::chrono::milliseconds patience{5000};
  // The newest join of a window that is already in the room. The state of the people is then received under that
  // window's identity. None: the client joins by itself, as a console.
  std::function<wire::JoinedRoom()> window{};
};

// Any thread may call it. It has one reader thread. That thread reconnects after a lost connection, until the room
// refuses it.
class PeopleClient final : public SupervisionClient {
 public:
  // Joins, and waits for the first state. Errors: those of wire::join_room.
  [[nodiscard]] static Result<std::unique_ptr<PeopleClient>> start(const PeopleClientOptions& options,
                                                                   std::function<bool()> stop);
  ~PeopleClient() override;
  // The error that ended the connection for good.
  [[nodiscard]] std::optional<Error> failure_seen() const;

  // The latest shots of everybody, one state of each press, in the order in which they came.
  [[nodiscard]] std::vector<ShotRun> shots() const;

  AuthorId self() const override;
  std::vector<PersonSeen> people() const override;
  std::vector<Annotation> annotations() const override;
  std::vector<WordsSeen> words() const override;
  bool wait(const std::function<bool()>& done, std::chrono::milliseconds patience) const override;
  Result<RoomSeq> supervise(AuthorId subject, const Restrictions& supervision) override;
  Result<std::pair<RoomSeq, std::size_t>> undo(const UndoSelection& what) override;
  Result<std::pair<RoomSeq, std::size_t>> redo(std::uint32_t count) override;
  Result<RoomSeq> mark(const std::string& label) override;
  Result<std::uint32_t> draw(const Annotation& drawn) override;
  Result<void> wipe_off(std::uint32_t annotation) override;
  Result<RoomSeq> say(AuthorId to, const std::string& words) override;
  Result<std::pair<AuthorId, std::size_t>> demonstrate(const DemonstrationSource& what) override;
  Result<void> end_demonstration(AuthorId demonstrator) override;
  Result<std::vector<std::pair<std::string, Digest>>> tools() override;
  Result<RoomSeen> status() override;

 private:
  struct Impl;
  explicit PeopleClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
