// A user of the window's bench in a program that is no test. What goes wrong is a message on standard error.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

#include "tests/integration/window_bench.hpp"

namespace osteon::test {

class ToStandardError : public testing::EmptyTestEventListener {
 public:
  explicit ToStandardError(std::string program) : program_(std::move(program)) {}

 private:
  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed()) std::fprintf(stderr, "%s: %s\n", program_.c_str(), result.message());
  }
  std::string program_;
};

// Each step of a user returns false, after a message, if the window did not do what it should.
class WindowUser : public WindowBench {
 public:
  // Once, before anything else. False, after a message: there is no screen. Then clears_desk() is due as well.
  [[nodiscard]] static bool gets_desk(const std::string& program) {
    program_ = program;
    testing::InitGoogleTest();
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new ToStandardError(program));
    SetUpTestSuite();
    if (!desk_->stands()) tell("Xvfb, of Debian's package xvfb, did not start");
    return desk_->stands();
  }
  static void clears_desk() { TearDownTestSuite(); }

 protected:
  static void tell(const std::string& what) { std::fprintf(stderr, "%s: %s\n", program_.c_str(), what.c_str()); }
  template <class Condition>
  bool sees(const std::string& what, Condition condition) {
    if (until(condition, std::chrono::seconds(180))) return true;
    tell(what + " did not come: " + problem());
    return false;
  }

 private:
  void TestBody() override {}
  static inline std::string program_;
};

}  // namespace osteon::test
