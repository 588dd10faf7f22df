// Tests, with processes, a hand that an instructor has stopped and whose program is started again: in a room without a
// journal and in one with a journal.
#include <gtest/gtest.h>

#include <regex>

#include "tests/integration/stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class Instructor {
 public:
  explicit Instructor(const Stage& stage)
      : process_(stage.start("osteon-viewer", {"--console", "--server", stage.address(), "--plain", "--name", "Ada"})) {
  }
  std::string ask(const std::string& command) {
    process_.write(command + "\n");
    return process_.read_line(60s).value_or("");
  }
  // What `people` prints for one author. Empty if there is none.
  std::string person(std::uint64_t author) {
    const std::string all = ask("people");
    std::smatch found;
    return std::regex_search(all, found, std::regex("#" + std::to_string(author) + " [^;]*")) ? found[0]
                                                                                              : std::string();
  }
  std::uint64_t cuts(std::uint64_t author) {
    const std::string said = person(author);
    std::smatch found;
    return std::regex_search(said, found, std::regex("cuts ([0-9]+)")) ? std::stoull(found[1]) : 0;
  }

 private:
  Process process_;
};

void expect_held(Stage& stage) {
  Instructor ada(stage);
  ASSERT_TRUE(ada.ask("people").starts_with("ok 1 people"));
  // The numbers are known. 1 is the instructor.
  constexpr std::uint64_t kFirst = 2, kAgain = 3;
  const json plan = {{"steps", json::array({drill_at(-8.0, 0.0, "expert"), drill_at(-8.0, 8.0, "expert")})}};
  Process first = stage.start_haptic("first", plan, "Ben");
  ASSERT_TRUE(wait_until([&] { return ada.cuts(kFirst) >= 5; }, 60s)) << first.err();
  ASSERT_TRUE(ada.ask("freeze #2 wait for me").starts_with("ok at "));
  ASSERT_TRUE(ada.ask("limit force #2 3").starts_with("ok at "));
  ASSERT_TRUE(first.terminate(20s).has_value());

  Process again = stage.start_haptic("again", plan, "Ben");
  const auto held = [&] {
    return ada.person(kAgain).find("frozen force 3.000 words \"wait for me\" acknowledged") != std::string::npos;
  };
  ASSERT_TRUE(wait_until(held, 60s)) << ada.person(kAgain) << again.err();
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(ada.cuts(kAgain), 0u) << "it must not carry out its plan";
  EXPECT_TRUE(ada.ask("free #3").starts_with("ok at "));
  EXPECT_TRUE(wait_until([&] { return ada.cuts(kAgain) >= 5; }, 60s)) << again.err();
  EXPECT_TRUE(again.terminate(20s).has_value());
  EXPECT_EQ(ada.ask("quit"), "ok");
}

TEST(Held, AHandThatIsStartedAgain) {
  Stage stage(24.0);
  expect_held(stage);
}

TEST(Held, AHandThatIsStartedAgainInAPersistedRoom) {
  const TempDir folder;
  Stage stage(24.0, {"--plain", "--journal", (folder / "room.journal").string()});
  expect_held(stage);
}

}  // namespace
}  // namespace osteon::test
