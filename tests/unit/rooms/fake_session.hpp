// A session without a client, for tests of rooms. It ignores what it is sent; a test overrides what it looks at.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "server/rooms/room_runtime.hpp"

namespace osteon::test {

class FakeSession : public SessionSubscriber {
 public:
  explicit FakeSession(AuthorId author) : author_(author) {}
  AuthorId author() const override { return author_; }
  void begin(SessionStart) override {}
  void set_leaves(std::vector<FieldLeaf>) override {}
  void enqueue(const SessionMessage&) override {}
  void answer(const SessionMessage&) override {}
  void refuse(const Error& why) override { ADD_FAILURE() << why.message; }
  void decided() override {}
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }

 private:
  const AuthorId author_;
};

}  // namespace osteon::test
